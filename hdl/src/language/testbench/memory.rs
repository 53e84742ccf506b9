//! A memory in plain integers, for references.

use std::collections::VecDeque;

/// Words and the read registers behind them. Undefined are a word before it is written, and what is read in the cycle
/// that writes it.
pub(crate) struct MemoryReference<T> {
    words: Vec<Option<T>>,
    read: VecDeque<Option<T>>,
}

impl<T: Copy> MemoryReference<T> {
    /// `depth` words, shown `latency` cycles after their address.
    pub(crate) fn new(depth: usize, latency: usize) -> Self {
        MemoryReference { words: vec![None; depth], read: vec![None; latency].into() }
    }

    /// The word on the output.
    pub(crate) fn shown(&self) -> Option<T> {
        self.read[0]
    }

    /// A clock edge that reads and writes.
    pub(crate) fn clock(&mut self, read: Option<usize>, write: Option<(usize, T)>) {
        if let Some(address) = read {
            let written = write.is_some_and(|(at, _)| at == address);
            self.read.pop_front();
            self.read.push_back(self.words.get(address).copied().flatten().filter(|_| !written));
        }
        if let Some((at, word)) = write {
            self.words[at] = Some(word);
        }
    }
}
