//! The [running zero](crate::data::input::running_zero) in the words of the hardware.
//!
//! ```text
//! o ← o + (d of the frame before, if nothing pressed in it), held to ±2^k L      when the taxel's code arrives
//! d = code − zero − ⌊o / 2^k + 1/2⌋                                              what goes on, and held to ±L is stored
//! ```
//! | word | bits | LSB |
//! |---|---|---|
//! | o | those of 2^k L, signed | 2^−k code |
//! | d as it is stored | those of L, signed | code |
//!
//! Whether something pressed is known with the last code of a frame; so the step of a taxel waits until its next code. A
//! frame that an early `tlast` drops moves nothing: those of its taxels that came have taken the step of the frame before,
//! the others lose it. Whether some zero is at its limit goes with the next frame, from its first word on.

use crate::fixed::words::arith::{round_shift, signed_bits};
use crate::spec::scene::{largest_code, Scene};

/// How zeros follow the readings, in codes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunningZero {
    /// k.
    pub average: u32,
    /// L in codes, 1 to the largest code.
    pub limit: i32,
    /// Indices of taxels that are dead in every table, row-major; one whose gain is 0 is dead too.
    pub dead: Vec<usize>,
}

/// What a frame of codes is as long as a drift goes with it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drift {
    /// o of each taxel.
    moved: Vec<i64>,
    /// d of each taxel.
    steps: Vec<i64>,
    /// Nothing pressed in the frame before.
    rests: bool,
    /// Some zero was at its limit in the frame before the last, and is in the last one.
    limited: [bool; 2],
}

impl Drift {
    /// Of so many taxels, after a reset.
    pub fn new(taxels: usize) -> Drift {
        Drift { moved: vec![0; taxels], steps: vec![0; taxels], rests: false, limited: [false; 2] }
    }

    /// What goes with the last frame: whether some zero was at its limit in the one before.
    pub fn was_limited(&self) -> bool {
        self.limited[0]
    }
}

impl RunningZero {
    /// That of a scene; the limit is rounded up. `None` where zeros are fixed.
    pub fn of_scene(scene: &Scene) -> Option<RunningZero> {
        let spec = scene.input.running_zero()?;
        let most = f64::from(largest_code(scene.fixed.input_bits));
        let full_scale_MPa = scene.input.full_scale_MPa.unwrap_or(1.0);
        // Held to the codes before the cast.
        let limit = (spec.limit_MPa / full_scale_MPa * most).ceil().clamp(1.0, most) as i32;
        let dead = match scene.hardware.has_writable_dead_taxels() {
            true => Vec::new(),
            false => scene.input.dead.iter().map(|[row, col]| row * scene.sensor.cols + col).collect(),
        };
        Some(RunningZero { average: spec.average, limit, dead })
    }

    /// Width of o.
    pub fn moved_bits(&self) -> u32 {
        signed_bits((i64::from(self.limit) << self.average).unsigned_abs())
    }

    /// Width of d as it is stored.
    pub fn step_bits(&self) -> u32 {
        signed_bits(i64::from(self.limit).unsigned_abs())
    }

    /// A frame of differences `code − zero`, or the first of them if it ends `early`, without drift. `direction` of a taxel
    /// is the sign of its gain, 0 of one whose gain is 0.
    pub fn follow(&self, drift: &mut Drift, off: &[i64], direction: impl Fn(usize) -> i64, early: bool) -> Vec<i64> {
        let (limit, most) = (i64::from(self.limit), i64::from(self.limit) << self.average);
        let (mut pressed, rested) = (false, std::mem::take(&mut drift.rests));
        let mut limited = false;
        let mut without = Vec::with_capacity(off.len());
        for (taxel, &off) in off.iter().enumerate() {
            let direction = if self.dead.contains(&taxel) { 0 } else { direction(taxel) };
            let (moved, step) = (&mut drift.moved[taxel], &mut drift.steps[taxel]);
            *moved = (*moved + if rested { *step } else { 0 }).clamp(-most, most);
            let rest = off - round_shift(*moved, self.average);
            pressed |= direction * off > limit && direction * rest > limit;
            limited |= moved.abs() == most;
            *step = if direction == 0 { 0 } else { rest.clamp(-limit, limit) };
            without.push(rest);
        }
        drift.rests = !early && !pressed;
        drift.limited = if early { drift.limited } else { [drift.limited[1], limited] };
        without
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zero() -> RunningZero {
        RunningZero { average: 2, limit: 10, dead: vec![2] }
    }

    /// Steps of d/4, in the frame after; the third taxel is dead, the fourth reads less under load.
    #[test]
    fn by_hand() {
        let (zero, mut drift) = (zero(), Drift::new(4));
        let direction = |taxel: usize| if taxel == 3 { -1 } else { 1 };
        let mut next = |off: [i64; 4], early: bool| {
            let without = zero.follow(&mut drift, &off, direction, early);
            (without, drift.moved.clone(), drift.rests)
        };
        assert_eq!(next([8, -50, 99, 10], false), (vec![8, -50, 99, 10], vec![0, 0, 0, 0], true));
        // 8/4 is 2, −50 is held to −10, −10/4 rounds to −2; the fourth presses.
        assert_eq!(next([8, -50, 99, -11], false), (vec![6, -48, 99, -14], vec![8, -10, 0, 10], false));
        assert_eq!(next([8, -50, 99, 0], false), (vec![6, -48, 99, -3], vec![8, -10, 0, 10], true));
        // The first two have come before an early end, and the others lose their step.
        let (mut early, direction) = (drift.clone(), |_: usize| 1);
        assert_eq!(zero.follow(&mut early, &[8, -50], direction, true), [4, -45]);
        assert_eq!((early.moved, early.rests), (vec![14, -20, 0, 10], false));
    }

    /// The limit is a sum of steps away, and then the zero stays.
    #[test]
    fn the_limit_holds_and_is_seen() {
        let (zero, mut drift) = (zero(), Drift::new(1));
        let mut limited = Vec::new();
        for _ in 0..60 {
            zero.follow(&mut drift, &[-300], |_| 1, false);
            limited.push(drift.was_limited());
        }
        assert_eq!((drift.moved[0], limited.iter().position(|limited| *limited)), (-40, Some(5)));
        assert!(limited[5..].iter().all(|limited| *limited));
        assert_eq!((zero.moved_bits(), zero.step_bits()), (7, 5));
    }
}
