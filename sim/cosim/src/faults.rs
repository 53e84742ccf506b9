//! Flips single bits in the simulated hardware and classifies the effect.
//!
//! Each run sends two frames at full speed through the verilated engine. At a random cycle of the first frame one bit
//! flips. A third of the runs each flips a bit of a ROM, a RAM and a register; within these the stages take turns, so
//! that small stages are covered as well, and the bits of a stage are equally likely. A flipped ROM bit stays; RAM and
//! register bits last until they are written again. Then the ROM is restored, the engine is reset, and the next frame
//! must be right.
//!
//! | outcome | when |
//! |---|---|
//! | harmless | all beats of both frames are right |
//! | detected | a beat is wrong and the device reports it: `tlast` on the wrong beat, or one of these that the model's status |
//! | | does not have: framing or coefficient flag, saturations, a search without result |
//! | hang | beats are missing until the reset |
//! | silent | a beat is wrong and the device reports nothing; the largest force error is recorded |
//!
//! Force errors are relative to the frame's largest force component.

mod bit_flip;
mod classify;
pub mod interval;

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{bail, Result};
use dermis_golden::data::frame::Frame;
use dermis_hdl::state::{StateElement, StorageClass, CLASSES};
use serde::Serialize;

use super::drive::{record, InputFrame, Stimulus};
use super::hardware::Hardware;
use super::stress::{shipped_samples, synthetic_samples, Sample};
use super::verilator::Optimisation;
use bit_flip::{FaultInjector, StateBit};
use classify::{classify, Outcome};
use dermis_flow::progress::Progress;

/// Relative force error above which a silent fault counts as large.
pub const LARGE: f64 = 0.01;

/// Counts of the faults in one storage class of one stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BitFlipRow {
    /// ROM, RAM or registers.
    pub class: StorageClass,
    /// Stage name.
    pub stage: &'static str,
    /// Number of registers and memories.
    pub signals: usize,
    /// Number of their bits.
    #[serde(rename = "places")]
    pub bits: usize,
    /// Number of bit flips.
    #[serde(rename = "tried")]
    pub flips: usize,
    /// Number of different bits flipped.
    #[serde(rename = "hit")]
    pub distinct_bits: usize,
    /// Flips without any wrong beat.
    pub harmless: usize,
    /// Flips with a wrong beat that the device reported.
    pub detected: usize,
    /// Flips after which beats were missing until the reset.
    pub hang: usize,
    /// Flips with a wrong beat that the device did not report.
    pub silent: usize,
    /// Silent flips with a force error above [`LARGE`].
    pub large: usize,
    /// Largest force error of a silent flip, relative to the frame's largest force component.
    pub largest_error: f64,
    /// Flips after which the frame following the reset was wrong.
    pub not_recovered: usize,
}

/// Flips `count` bits of a scene's Verilog, one per run.
///
/// # Errors
/// No Verilator, a design that it refuses, or frames of another sensor.
pub fn inject_faults(hardware: &Hardware, frames: &[Frame], count: usize, seed: u64) -> Result<Vec<BitFlipRow>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut pool = shipped_samples(&hardware.model, frames)?;
    if !pool.iter().any(Sample::has_force) {
        pool = synthetic_samples(&hardware.model, &mut random);
    }
    pool.retain(Sample::has_force);
    let elements = &hardware.generated.state;
    let longest = pool.iter().map(|sample| sample.cycles.total).max().unwrap_or(0);
    // Two frames and one after the reset.
    let optimisation = Optimisation::of_cycles(3 * longest * count as u64);
    let mut device = hardware.device_with_open_state(optimisation)?;
    let mut rows: BTreeMap<(StorageClass, &str), BitFlipRow> = BTreeMap::new();
    let mut found = Vec::new();
    for element in elements {
        let StateElement { scope, signal, words, bits, .. } = element;
        // Flips a bit twice, which leaves it unchanged: shows that it can be flipped.
        let [word, bit] = [words - 1, bits - 1];
        let own = device.find(scope, signal).filter(|own| [(); 2].iter().all(|()| device.flip(*own, word, bit)));
        let Some(own) = own else { bail!("{scope}.{signal}, word {word}, bit {bit} cannot be flipped") };
        found.push(own);
        let row = rows.entry((element.class, element.stage)).or_insert_with(|| BitFlipRow::new(element));
        (row.signals, row.bits) = (row.signals + 1, row.bits + element.words * element.bits);
    }
    let mut flipped = BTreeSet::new();
    let bar = Progress::steps("faults", count as u64);
    for run in 0..count {
        bar.set(run as u64);
        let Some((index, word, bit)) = draw(elements, run, &mut random) else { continue };
        let element = &elements[index];
        let bit = StateBit { element: found[index], word, bit };
        let [first, second, after] = [(); 3].map(|()| &pool[random.usize(..pool.len())]);
        let second = &second.behind(&hardware.model, first);
        let flip_cycle = random.u64(..first.cycles.total);
        let mut injector = FaultInjector::new(&mut device, bit, flip_cycle);
        let frames = [first, second].map(input_frame);
        let recording = record(&mut injector, 0, &frames, Stimulus::FullSpeed, 4 * longest);
        let outcome = classify(&recording, &[first, second]);
        if element.class == StorageClass::Rom {
            injector.flip();
        }
        let again = record(&mut device, 0, &[input_frame(after)], Stimulus::FullSpeed, 4 * longest);
        let recovered = classify(&again, &[after]) == Outcome::Harmless;
        if let Some(row) = rows.get_mut(&(element.class, element.stage)) {
            row.add(outcome, recovered, flipped.insert((index, word, bit.bit)));
        }
    }
    Ok(rows.into_values().collect())
}

/// Draws a bit as index of its element, word and bit: the classes and their stages take turns, the bits of a stage are
/// equally likely. `None` where the class has no bits.
fn draw(elements: &[StateElement], run: usize, random: &mut fastrand::Rng) -> Option<(usize, usize, usize)> {
    let class = CLASSES[run % CLASSES.len()];
    let stages: BTreeSet<&str> =
        elements.iter().filter(|element| element.class == class).map(|element| element.stage).collect();
    let stage = stages.iter().nth(run / CLASSES.len() % stages.len().max(1))?;
    let own = || elements.iter().enumerate().filter(|(_, element)| (element.class, element.stage) == (class, *stage));
    let mut left = random.usize(..own().map(|(_, element)| element.words * element.bits).sum::<usize>());
    for (index, element) in own() {
        if left < element.words * element.bits {
            return Some((index, left / element.bits, left % element.bits));
        }
        left -= element.words * element.bits;
    }
    None
}

fn input_frame(sample: &Sample) -> InputFrame<'_> {
    InputFrame { codes: &sample.codes, taxels: sample.taxels, beats: sample.beats.len(), array: 0 }
}

impl BitFlipRow {
    fn new(element: &StateElement) -> BitFlipRow {
        BitFlipRow {
            class: element.class,
            stage: element.stage,
            signals: 0,
            bits: 0,
            flips: 0,
            distinct_bits: 0,
            harmless: 0,
            detected: 0,
            hang: 0,
            silent: 0,
            large: 0,
            largest_error: 0.0,
            not_recovered: 0,
        }
    }

    fn add(&mut self, outcome: Outcome, recovered: bool, new: bool) {
        self.flips += 1;
        self.distinct_bits += usize::from(new);
        self.not_recovered += usize::from(!recovered);
        match outcome {
            Outcome::Harmless => self.harmless += 1,
            Outcome::Detected => self.detected += 1,
            Outcome::Hang => self.hang += 1,
            Outcome::Silent(error) => {
                self.silent += 1;
                self.large += usize::from(error > LARGE);
                self.largest_error = self.largest_error.max(error);
            }
        }
    }
}

/// Shares of the outcomes of a flip in a random bit of a storage class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Shares {
    /// Number of bits of the class.
    pub bits: usize,
    /// Number of flips that were simulated.
    pub flips: usize,
    /// No wrong beat.
    pub harmless: f64,
    /// A wrong beat that the device reports.
    pub detected: f64,
    /// Missing beats until the reset.
    pub hang: f64,
    /// A wrong beat that the device does not report.
    pub silent: f64,
    /// 95 % confidence interval of `silent`, see [`interval`].
    pub silent_interval: [f64; 2],
    /// Silent, with a force error above [`LARGE`].
    pub large: f64,
    /// 95 % confidence interval of `large`.
    pub large_interval: [f64; 2],
}

impl Shares {
    /// The stages' shares, weighted by their bits; `None` where the class has no bits or none was flipped.
    pub fn of(rows: &[BitFlipRow], class: StorageClass) -> Option<Shares> {
        let of_class = || rows.iter().filter(move |row| row.class == class);
        let flipped = || of_class().filter(|row| row.flips > 0);
        let weight: usize = flipped().map(|row| row.bits).sum();
        let share = |count: fn(&BitFlipRow) -> usize| {
            flipped().map(|row| row.bits as f64 * count(row) as f64 / row.flips as f64).sum::<f64>() / weight as f64
        };
        let interval = |count: fn(&BitFlipRow) -> usize| {
            let of = |row: &BitFlipRow| {
                let weight = row.bits as f64 / weight as f64;
                interval::Stratum { weight, hits: count(row), trials: row.flips }
            };
            interval::weighted(&flipped().map(of).collect::<Vec<_>>())
        };
        (weight > 0).then(|| Shares {
            bits: of_class().map(|row| row.bits).sum(),
            flips: flipped().map(|row| row.flips).sum(),
            harmless: share(|row| row.harmless),
            detected: share(|row| row.detected),
            hang: share(|row| row.hang),
            silent: share(|row| row.silent),
            silent_interval: interval(|row| row.silent),
            large: share(|row| row.large),
            large_interval: interval(|row| row.large),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_hold_the_share_as_often_as_they_say() {
        // Stages of unlike size and share; 100 flips each.
        const STAGES: [(usize, f64); 3] = [(100, 0.3), (1000, 0.02), (5000, 0.1)];
        let row = |(bits, silent)| BitFlipRow {
            class: StorageClass::Rom,
            stage: "fold",
            signals: 1,
            bits,
            flips: 100,
            distinct_bits: 100,
            harmless: 100 - silent,
            detected: 0,
            hang: 0,
            silent,
            large: 0,
            largest_error: 0.0,
            not_recovered: 0,
        };
        let all: usize = STAGES.iter().map(|(bits, _)| bits).sum();
        let truth: f64 = STAGES.iter().map(|(bits, share)| *bits as f64 * share).sum::<f64>() / all as f64;
        let mut random = fastrand::Rng::with_seed(5);
        let held = (0..1000).filter(|_| {
            let rows = STAGES.map(|(bits, share)| row((bits, (0..100).filter(|_| random.f64() < share).count())));
            let shares = Shares::of(&rows, StorageClass::Rom).unwrap();
            let [low, high] = shares.silent_interval;
            // No flip had a large error, which does not prove that none has.
            assert!(shares.large_interval[0] == 0.0 && (0.01..0.05).contains(&shares.large_interval[1]), "{shares:?}");
            assert!(low <= shares.silent && shares.silent <= high);
            low <= truth && truth <= high
        });
        assert!((925..=990).contains(&held.count()));
    }
}
