//! Experiment `tables`: images of tables between frames, right and wrong ones.

use dermis_golden::fixed::stages::load::{Tables, VERSION_BITS, WORD_BYTES};
use dermis_golden::fixed::stages::prepare::GAIN_BITS;
use dermis_golden::fixed::Model;

use super::handshake_rates::HandshakeRates;
use super::testbench::{Burst, Testbench};

/// Longest reset in cycles.
const LONGEST_RESET: u64 = 40;

/// The coefficients of specimens of the hardware of `model`, with which no word overflows: of its scene, and of its thinnest and
/// thickest cover if they are written.
fn coefficients(model: &Model) -> Vec<Vec<i64>> {
    let covers = model.scene.hardware.table_range.thickness_mm.into_iter().flatten();
    let specimen = |thickness_mm: f64| {
        let mut scene = model.scene.clone();
        scene.sensor.thickness_mm = thickness_mm;
        model.with_tables(&scene, 1).ok()?.tables()
    };
    model.tables().into_iter().chain(covers.filter_map(specimen)).map(|tables| tables.coefficients).collect()
}

/// Random tables for the hardware of `model`, with some of these coefficients.
fn random_tables(model: &Model, coefficients: &[Vec<i64>], random: &mut fastrand::Rng) -> Tables {
    let code_bits = model.formats().code_bits;
    let mut entries = |bits: u32| {
        let half = 1i32 << (bits - 1);
        (0..model.scene.sensor.taxels()).map(|_| random.i32(-half..half)).collect::<Vec<i32>>()
    };
    let [zero, gain] = [entries(code_bits - 4), entries(GAIN_BITS)];
    Tables {
        version: random.u16(1..1 << VERSION_BITS),
        threshold: random.u32(..) >> random.u32(..32),
        noise_floor: match random.u8(..4) {
            // With bits that the hardware does not have.
            0 => random.i32(..),
            _ => (random.u32(..) >> (33 - code_bits)) as i32 >> random.u32(..code_bits),
        },
        zero,
        gain,
        coefficients: match coefficients {
            [only] => only.clone(),
            several => random.choice(several).cloned().unwrap_or_default(),
        },
    }
}

/// Frames back to back and images between them: of which half are right, and the others damaged, too short, too long, for other
/// hardware, between the codes of a frame, broken off by a frame or by a reset.
pub(super) fn tables(bench: &mut Testbench, model: &Model, random: &mut fastrand::Rng, cycles: u64) {
    let (code_bits, coefficients) = (model.formats().code_bits, coefficients(model));
    while bench.can_continue() && bench.cycle() < cycles {
        let mut rates = HandshakeRates::random(random);
        for _ in 0..random.usize(..4) {
            let sample = random.usize(..bench.sample_count());
            let frame = Burst::whole(bench.sample(sample), sample).of_array(random.usize(..bench.arrays()));
            bench.send(&frame, &mut rates);
        }
        let mut image = random_tables(model, &coefficients, random).image(model.table_layout(), code_bits);
        let inner = random.usize(WORD_BYTES..image.len());
        let sample = random.usize(..bench.sample_count());
        let frame = Burst::whole(bench.sample(sample), sample).of_array(random.usize(..bench.arrays()));
        let mut resets = false;
        let burst = match random.u32(..14) {
            0 => {
                image[inner] ^= 1 << random.u32(..8);
                Burst::image(&image, code_bits)
            }
            1 => Burst::image(&image[..inner], code_bits),
            2 => {
                image.push(0);
                Burst::image(&image, code_bits)
            }
            3 => {
                image[random.usize(..WORD_BYTES)] ^= 1 << random.u32(..8);
                Burst::image(&image, code_bits)
            }
            4 => frame.with(1 + random.usize(..model.scene.sensor.taxels() - 1), Burst::image(&image, code_bits)),
            5 => frame.with(0, Burst::image(&image[..inner], code_bits).without_end()),
            6 => {
                resets = true;
                Burst::image(&image[..1 + random.usize(..image.len() - 1)], code_bits).without_end()
            }
            _ => Burst::image(&image, code_bits),
        };
        bench.send(&burst.of_array(random.usize(..bench.arrays())), &mut rates);
        if resets {
            let held = 1 + random.u64(..LONGEST_RESET);
            bench.reset(held, random);
            let outcome = bench.outcome();
            outcome.resets += 1;
            outcome.longest_reset = outcome.longest_reset.max(held);
        }
        if random.u32(..4) == 0 {
            bench.send_alone(&bench.any(random));
        }
    }
    bench.drain(&mut HandshakeRates::full_speed());
}
