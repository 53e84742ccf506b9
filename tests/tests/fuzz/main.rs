//! Fuzzing: every reader of files and packets, and the whole path from a scene's text to forces, on mutated and random
//! input.
//!
//! | part | input | must hold |
//! |---|---|---|
//! | scene, frame, calibration, manifest, recordings, lines, requests | seeds of `corpus/`, mutated bytes and words | error in plain words or value, no panic |
//! | frame.json | the same | a frame that is read, written and read again is the same |
//! | packets, datagrams | the same | a packet that is found is found again after encoding |
//! | whole | random scenes, random and invalid frames | error or finite forces, in floating and fixed point |
//!
//! No input takes longer than [`LONGEST`], and reading allocates at most [`BYTES_PER_BYTE`] per byte of text plus
//! [`BYTES`]. Inputs depend on a seed only and are reproducible; failing ones are counted and printed, to be added to
//! `corpus/`, which is read first. The same readers are fuzzed by libFuzzer, which sees what code an input reaches: `tests/fuzz-targets`
//! has added what it found to `corpus/`.
//!
//! `make fuzz` runs 10⁷ inputs on the readers and 10⁵ on the whole path, and stores the counts in `build/tried` for the
//! report; without its variables both parts are short.

use std::time::{Duration, Instant};

use dermis_tests::readers::{corpus, TARGETS};
use dermis_tests::wanted;
use fastrand::Rng;

mod counting;
mod draw;
mod run;
mod whole;

use counting::Counting;
use draw::mutated;
use run::{conclude, on_all_processors, Outcome};

/// Time limit for one input of a reader.
const LONGEST: Duration = Duration::from_secs(2);
/// Limit of bytes allocated, besides those per byte of text.
const BYTES: usize = 8 << 20;
/// Limit of bytes allocated per byte of text: a parsed value for every character.
const BYTES_PER_BYTE: usize = 400;

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn readers_take_anything() {
    const SHORT: usize = 30_000;
    let inputs = wanted("DERMIS_FUZZ_INPUTS", SHORT as u64) as usize;
    let done = on_all_processors(TARGETS.len(), |number| reader(number, inputs.div_ceil(TARGETS.len())));
    for (name, outcome) in &done {
        // Some inputs are accepted and some rejected.
        assert!(outcome.counted("accepted") > 0 && outcome.counted("refused") > 0, "{name}: {:?}", outcome.counts);
    }
    conclude("fuzz-readers", "inputs", inputs > SHORT, done);
}

/// Runs the seeds of a reader and the requested number of mutated ones.
fn reader(number: usize, changed: usize) -> (&'static str, Outcome) {
    let (name, target) = TARGETS[number];
    let (seeds, start) = (corpus(name), Instant::now());
    let mut random = Rng::with_seed(number as u64);
    let mut outcome = Outcome { tried: seeds.len() + changed, ..Outcome::default() };
    for k in 0..outcome.tried {
        let bytes = seeds.get(k).cloned().unwrap_or_else(|| mutated(&mut random, &seeds));
        let input = || format!("{:?}", String::from_utf8_lossy(&bytes));
        let Some((accepted, taken)) = outcome.survive(name, &input, LONGEST, || target(&bytes)) else { continue };
        outcome.count(if accepted { "accepted" } else { "refused" }, 1);
        if taken > BYTES + BYTES_PER_BYTE * bytes.len() {
            outcome.failures.push(format!("{taken} bytes for {name}: {}", input()));
        }
    }
    outcome.elapsed = start.elapsed();
    (name, outcome)
}

#[test]
fn the_whole_way_takes_anything() {
    const SHORT: usize = 600;
    let runs = wanted("DERMIS_FUZZ_RUNS", SHORT as u64) as usize;
    let start = Instant::now();
    let mut all = Outcome::default();
    on_all_processors(runs.div_ceil(whole::FRAMES), |seed| whole::drawn(seed as u64))
        .into_iter()
        .for_each(|o| all.add(o));
    all.elapsed = start.elapsed();
    // A good part of the inputs reaches the end of the path.
    let (golden, fixed) = (all.counted("golden result"), all.counted("fixed result"));
    assert!(3 * golden > all.tried && 10 * fixed > all.tried, "{golden} {fixed} of {}", all.tried);
    conclude("fuzz-whole", "frames", runs > SHORT, vec![("scene to forces", all)]);
}
