//! A set of flags.

use std::ops::BitOr;

use super::Flag;

/// Flags without duplicates, in the order of their numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlagSet(u32);

impl FlagSet {
    /// The flags that are marked as raised.
    pub fn raised(all: impl IntoIterator<Item = (Flag, bool)>) -> Self {
        all.into_iter().filter_map(|(flag, raised)| raised.then_some(flag)).collect()
    }

    /// Whether the set has the flag.
    pub fn contains(self, flag: Flag) -> bool {
        self.0 & flag.bit() != 0
    }

    /// The flags in order.
    pub fn iter(self) -> impl Iterator<Item = Flag> {
        Flag::ALL.into_iter().filter(move |flag| self.contains(*flag))
    }

    /// The sum of [`Flag::bit`].
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The flags whose [own bit](Flag::status_bit) is set in the beats of a status.
    pub fn of_status(beats: &[[i32; 3]]) -> Self {
        let is_set = |flag: &Flag| flag.status_bit().is_some_and(|bit| bit.get(beats) != 0);
        Flag::ALL.into_iter().filter(is_set).collect()
    }

    /// Sets the own bits of these flags in the beats of a status.
    pub fn put(self, beats: &mut [[i32; 3]]) {
        self.iter().filter_map(Flag::status_bit).for_each(|bit| bit.put(beats, 1));
    }
}

impl BitOr for FlagSet {
    type Output = Self;

    /// The flags that are in one of both.
    fn bitor(self, other: Self) -> Self {
        FlagSet(self.0 | other.0)
    }
}

impl FromIterator<Flag> for FlagSet {
    fn from_iter<I: IntoIterator<Item = Flag>>(flags: I) -> Self {
        FlagSet(flags.into_iter().fold(0, |bits, flag| bits | flag.bit()))
    }
}
