//! The table logarithm in three steps, shared by the two blocks that need one.
//!
//! A binary search finds the leading one: if the upper half of the word is zero, the lower half is moved up. Each
//! decision is a bit of the leading one's position, and the remaining bits start with the leading one. The search is
//! split into two functions with a register between them, and another inside the first, because up to 64 bits need too many
//! steps for one cycle. The first function computes which nibbles are non-zero before it moves any, so that a decision does
//! not wait for the previous move.

use dermis_golden::fixed::stages::search::log_table;
use dermis_golden::fixed::words::formats::{LOG_FRACTION, LOG_TABLE_BITS};

use crate::language::{concat, Builder, Expr};

/// Bits of the integer part of a logarithm of an argument below 2^64.
const LENGTH_BITS: usize = 6;
/// Bits of a logarithm, [`LOG_FRACTION`] of them the fraction.
pub const LOG_BITS: usize = LENGTH_BITS + LOG_FRACTION as usize;
/// Halves that the second function tests, in bits.
const LAST: [usize; 2] = [2, 1];
/// Bits of a nibble, the unit that the first function tests for zero.
const NIBBLE: usize = 2 * LAST[0];
/// Bits that the second function needs: a nibble that holds the leading one, and the table index below it.
const REST_BITS: usize = NIBBLE + LOG_TABLE_BITS as usize;

/// Halves that the first function tests, in bits, for arguments of `bits` bits.
fn first_halves(bits: usize) -> Vec<usize> {
    let width = bits.next_power_of_two().max(2 * NIBBLE);
    (LAST.len()..LENGTH_BITS).rev().map(|k| 1 << k).filter(|half| 2 * half <= width).collect()
}

/// `word` without change if `stays`, else its bits moved up by `by`.
fn move_up<'k>(stays: Expr<'k>, word: Expr<'k>, by: usize) -> Expr<'k> {
    stays.mux(word, word.low(word.bits() - by).shift_left(by))
}

/// Leading-one detection to the nibble, with a latency of one cycle. The result has the upper bits of the leading one's position
/// on top; below them the top `REST_BITS` bits of the argument, shifted left until its top nibble holds the leading one.
/// [`logarithm`] takes it. Names of wires start with `name`.
pub fn locate<'k>(k: &'k Builder, name: &str, argument: Expr<'k>) -> Expr<'k> {
    let halves = first_halves(argument.bits());
    let width = 2 * halves[0];
    let mut word = argument.extend(width);
    let nibbles: Vec<Expr> = (0..width / NIBBLE).rev().map(|n| word.slice(n * NIBBLE, NIBBLE).any()).collect();
    let mut used = k.wire(&format!("{name}_used"), concat(&nibbles));
    let mut parts = Vec::new();
    let before = halves.len() / 2;
    for (index, half) in halves.into_iter().enumerate() {
        if index == before {
            (used, word) = (k.delay(&format!("{name}_nibbles"), used), k.delay(&format!("{name}_word"), word));
            let part = |(index, part): (usize, &mut Expr<'k>)| *part = k.delay(&format!("{name}_part_{index}"), *part);
            parts.iter_mut().enumerate().for_each(part);
        }
        let upper = half / NIBBLE;
        let high = k.wire(&format!("{name}_high_{half}"), used.slice(used.bits() - upper, upper).any());
        used = move_up(high, used, upper);
        word = move_up(high, word, half);
        parts.push(high);
    }
    parts.push(word.slice(width - REST_BITS, REST_BITS));
    concat(&parts)
}

/// The logarithm, [`LOG_BITS`] bits, from the result of [`locate`]: detects the leading one within the nibble and reads the table.
/// The logarithm of 0 is that of 1.
pub fn logarithm<'k>(k: &'k Builder, name: &str, located: Expr<'k>) -> Expr<'k> {
    let mut rest = located.low(REST_BITS);
    let mut position = located.slice(REST_BITS, located.bits() - REST_BITS);
    for half in LAST {
        let high = k.wire(&format!("{name}_high_{half}"), rest.slice(REST_BITS - half, half).any());
        rest = move_up(high, rest, half);
        position = position.concat(high);
    }
    let table: Vec<u64> = log_table().iter().map(|&value| value as u64).collect();
    let cell = k.wire(&format!("{name}_cell"), rest.slice(NIBBLE - 1, LOG_TABLE_BITS as usize));
    position.extend(LENGTH_BITS).concat(cell.table(LOG_FRACTION as usize, &table))
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::stages::search::log2;

    use super::*;
    use crate::block;
    use crate::language::testbench::{check, Pipeline};
    use crate::language::{kernel_of, Block, Inside};
    use crate::wire::Word;

    const WIDTHS: [usize; 4] = [5, 17, 32, 63];
    /// Bits from one argument to the next.
    const STEP: usize = 64;

    block! {
        struct Logarithms {}
        ports LogarithmsPorts {
            clock;
            /// An argument of each width.
            in arguments: WIDTHS.len() * STEP;
            /// Their logarithms.
            out logarithms: WIDTHS.len() * LOG_BITS;
        }
    }

    impl Block for Logarithms {
        fn build<'k>(&self, k: &'k Builder, io: LogarithmsPorts<Inside<'k>>) {
            let log = |(index, bits): (usize, usize)| {
                let argument = io.arguments.slice(index * STEP, bits);
                let located = k.wire(&format!("located{bits}"), locate(k, &format!("locate{bits}"), argument));
                logarithm(k, &format!("log{bits}"), located)
            };
            let logs: Vec<Expr> = WIDTHS.into_iter().enumerate().rev().map(log).collect();
            io.logarithms.set(concat(&logs));
        }
    }

    #[test]
    fn logarithms_are_those_of_the_model() {
        let mut random = fastrand::Rng::with_seed(1);
        // Leading ones at every position, and 0.
        let mut inputs = |_| {
            let mut word = Word::default();
            for (index, bits) in WIDTHS.into_iter().enumerate() {
                word.set(index * STEP, bits, random.u64(..) >> random.usize(64 - bits..64));
            }
            vec![word]
        };
        let stimulus: Vec<Vec<Word>> = (0..4000).map(&mut inputs).chain([vec![Word::default()]]).collect();
        let logs = |inputs: &[Word]| {
            let log = |(index, bits)| log2(inputs[0].field(index * STEP, bits) as i64);
            let logs: Vec<i64> = WIDTHS.into_iter().enumerate().map(log).collect();
            vec![Some(Word::of_fields(&logs, LOG_BITS))]
        };
        check(&kernel_of(&Logarithms {}), &stimulus, &mut Pipeline::new(1, 1, logs));
    }
}
