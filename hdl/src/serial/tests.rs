//! Single blocks of the serial engine against the bit-true model on random words.

use dermis_golden::fixed::arith::{hadamard, round_shift, saturate};
use rust_hdl::prelude::*;

use super::{Horner, Mixer, Rounder};
use crate::wire::Word;

/// Settles the block with the clock at one level.
macro_rules! level {
    ($block:expr, $level:expr) => {
        $block.clk.next = $level.into();
        (0..8).for_each(|_| $block.update_all());
    };
}

fn random(random: &mut fastrand::Rng, bits: u32) -> i64 {
    random.i64(-(1 << (bits - 1))..1 << (bits - 1))
}

#[test]
fn the_rounder_is_round_shift_and_saturate() {
    const LATENCY: usize = 4;
    let mut rng = fastrand::Rng::with_seed(1);
    let mut rounder = Rounder::new(44, 20);
    for wide in [true, false] {
        let words: Vec<(i64, u32)> = (0..300).map(|_| (random(&mut rng, 44), rng.u32(0..=62))).collect();
        rounder.wide.next = wide;
        for at in 0..words.len() + LATENCY {
            let (word, shift) = words.get(at).copied().unwrap_or_default();
            rounder.word.next = Word::of_fields(&[word], 44);
            rounder.shift.next = Word::from(u64::from(shift));
            rounder.valid.next = at < words.len();
            level!(rounder, false);
            assert_eq!(rounder.done.val(), at >= LATENCY);
            if let Some(&(word, shift)) = at.checked_sub(LATENCY).and_then(|at| words.get(at)) {
                let expected = saturate(round_shift(word, shift), if wide { 32 } else { 20 });
                assert_eq!((rounder.rounded.val().signed(0, 32), rounder.clipped.val()), expected);
            }
            level!(rounder, true);
        }
    }
}

#[test]
fn the_mixer_is_a_hadamard_butterfly() {
    let mut rng = fastrand::Rng::with_seed(2);
    let mut mixer = Mixer::new(20);
    for _ in 0..50 {
        let quad: [i64; 4] = std::array::from_fn(|_| random(&mut rng, 20));
        for word in quad {
            mixer.word.next = Word::of_fields(&[word], 20);
            mixer.valid.next = true;
            level!(mixer, false);
            assert!(!mixer.mixed_valid.val());
            level!(mixer, true);
        }
        mixer.valid.next = false;
        for (at, expected) in hadamard(quad).into_iter().enumerate() {
            level!(mixer, false);
            assert!(mixer.mixed_valid.val() && mixer.quad_valid.val() == (at == 0));
            assert_eq!(mixer.mixed.val().signed(0, 22), expected);
            level!(mixer, true);
        }
    }
}

#[test]
fn horner_moves_the_centre_of_polynomials_back_to_back() {
    let mut rng = fastrand::Rng::with_seed(3);
    let mut horner = Horner::new(30);
    for by in [-1, 0, 1i64] {
        horner.moves.next = by != 0;
        horner.down.next = by < 0;
        let mut before: Option<(usize, [i64; 4])> = None;
        for _ in 0..50 {
            let top = rng.usize(0..4);
            let c: [i64; 4] = std::array::from_fn(|k| if k <= top { random(&mut rng, 24) } else { 0 });
            for element in 0..4 {
                horner.element.next = Word::from(element as u64);
                horner.top.next = Word::from(top as u64);
                // Arbitrary words above the degree.
                let word = if 3 - element <= top { c[3 - element] } else { 12345 };
                horner.word.next = Word::of_fields(&[word], 30);
                level!(horner, false);
                if let Some((top, moved)) = before.filter(|(top, _)| element <= *top) {
                    assert_eq!(horner.moved.val().signed(0, 30), moved[element], "degree {top}, by {by}");
                }
                level!(horner, true);
            }
            let [c0, c1, c2, c3] = c;
            let square = by * by;
            let moved =
                [c0 + by * c1 + square * c2 + by * c3, c1 + 2 * by * c2 + 3 * square * c3, c2 + 3 * by * c3, c3];
            before = Some((top, moved));
        }
    }
}
