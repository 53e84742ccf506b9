//! Fuzzing: every reader of files and packets, and the whole way from a scene's text to forces, on mutated and random
//! input.
//!
//! | part | input | must hold |
//! |---|---|---|
//! | scene, frame, calibration, manifest | seeds of `corpus/`, bytes and words changed | error or value, no panic |
//! | frame.json | the same | what is read is written and read again as the same |
//! | packets | the same | a packet found is found again when it is sent |
//! | whole | drawn scenes, drawn and broken frames | error or finite forces, in floating point and in integers |
//!
//! Besides: no input takes longer than [`LONGEST`], and reading allocates no more than [`BYTES_PER_BYTE`] for each byte
//! of text and [`BYTES`]. Inputs are drawn from a seed and repeat; failing ones are counted and printed, to be added to
//! `corpus/`, all of which is read first.
//!
//! `make fuzz` runs 10⁷ inputs over the readers and 10⁵ over the whole way, and keeps the counts in `build/tried` for
//! the report; without its variables a short part of both.

use std::time::{Duration, Instant};

use dermis_tests::wanted;
use fastrand::Rng;

mod counting;
mod draw;
mod readers;
mod run;
mod whole;

use counting::Counting;
use draw::mutated;
use readers::{corpus, TARGETS};
use run::{conclude, on_all_processors, Outcome};

/// Longest time for one input of a reader.
const LONGEST: Duration = Duration::from_secs(2);
/// Most bytes that reading may take, besides those for each byte of text.
const BYTES: usize = 8 << 20;
/// Most bytes for each byte of text: a parsed value for every character.
const BYTES_PER_BYTE: usize = 400;

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn readers_take_anything() {
    const SHORT: usize = 30_000;
    let inputs = wanted("DERMIS_FUZZ_INPUTS", SHORT as u64) as usize;
    let done = on_all_processors(TARGETS.len(), |number| reader(number, inputs.div_ceil(TARGETS.len())));
    for (name, outcome) in &done {
        // The draw reaches both sides of the reader.
        assert!(outcome.counted("accepted") > 0 && outcome.counted("refused") > 0, "{name}: {:?}", outcome.counts);
    }
    conclude("fuzz-readers", "inputs", inputs > SHORT, done);
}

/// The seeds of a reader and as many changed ones as asked for.
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
    // The draw is worth something: a good share of it goes all the way.
    let (golden, fixed) = (all.counted("golden result"), all.counted("fixed result"));
    assert!(3 * golden > all.tried && 10 * fixed > all.tried, "{golden} {fixed} of {}", all.tried);
    conclude("fuzz-whole", "frames", runs > SHORT, vec![("scene to forces", all)]);
}
