//! Random input: mutated seeds for readers; scenes and stress for the whole path.

use fastrand::Rng;

/// Words with a special meaning for the readers.
const WORDS: [&str; 28] = [
    "nan",
    "NaN",
    "inf",
    "-inf",
    "1e400",
    "-1e-400",
    "1e308",
    "5e-324",
    "-0.0",
    "0",
    "-1",
    "1",
    "2",
    "256",
    "257",
    "65536",
    "9223372036854775807",
    "9223372036854775808",
    "null",
    "true",
    "[",
    "]",
    "{",
    "}",
    "\"",
    ",",
    "=",
    "\n",
];

/// A seed with a few mutations: bits, bytes, words, parts removed, repeated or taken from another seed.
pub fn mutated(random: &mut Rng, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[random.usize(..seeds.len())].clone();
    for _ in 0..random.usize(1..6) {
        let at = random.usize(..=bytes.len());
        let end = at + random.usize(..=(bytes.len() - at).min(24));
        match random.u8(..7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.u8(..8),
            1 => bytes.insert(at, random.u8(..)),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let word = WORDS[random.usize(..WORDS.len())];
                drop(bytes.splice(at..end, word.bytes()));
            }
            4 => {
                let piece = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, piece));
            }
            5 => {
                let other = &seeds[random.usize(..seeds.len())];
                let from = random.usize(..=other.len());
                let to = from + random.usize(..=(other.len() - from).min(64));
                drop(bytes.splice(at..end, other[from..to].iter().copied()));
            }
            _ => bytes.truncate(at),
        }
    }
    bytes
}

/// The text of a random scene; not all of its values can be combined.
pub fn drawn_scene(random: &mut Rng) -> String {
    fn pick<'a>(random: &mut Rng, of: &[&'a str]) -> &'a str {
        of[random.usize(..of.len())]
    }
    let pitch = [0, 1].map(|_| 10f64.powf(random.f64() * 1.2 - 0.6));
    let thickness = pitch[0].min(pitch[1]) * 10f64.powf(random.f64() * 1.6 - 1.2);
    let mut text = format!(
        "[sensor]\nrows = {}\ncols = {}\npitch_x_mm = {}\npitch_y_mm = {}\nthickness_mm = {}\n",
        2 * random.u8(1..4),
        random.u8(2..7),
        pitch[0],
        pitch[1],
        thickness,
    );
    let mut table = |name: &str, fields: Vec<String>| {
        text.push_str(&format!("[{name}]\n{}\n", fields.join("\n")));
    };
    let mu_max = pick(random, &["0", "0.001", "0.2", "0.4", "0.4", "0.6", "0.6", "2.0"]);
    let objective = pick(
        random,
        &["sparse", "sparse", "sparse", "sparse", "sparse", "sparse", "compressive", "symmetric", "patch", "auto"],
    );
    let form = pick(random, &["oblique", "oblique", "oblique", "oblique", "oblique", "orthogonal"]);
    table(
        "search",
        vec![
            format!("mu_max = {mu_max}\nobjective = \"{objective}\"\nform = \"{form}\""),
            format!("noise_floor_MPa = {}", pick(random, &["0", "0", "0", "0", "1e-9", "1e-3", "1e9"])),
        ],
    );
    let case = pick(random, &["0", "0", "0", "0", "0", "0", "1", "2", "3", "\"adaptive\"", "\"contacts\""]);
    table(
        "partition",
        vec![format!("case = {case}"), format!("condition = \"{}\"", pick(random, &["loaded", "both-signs"]))],
    );
    let level = pick(random, &["", "level = 1e-12", "level = 1e-3", "level = 0.5"]);
    let kind = pick(random, &["tsvd", "tikhonov", "exact"]);
    table("inverse", vec![format!("kind = \"{kind}\""), if kind == "exact" { "" } else { level }.to_owned()]);
    table("threshold", vec![format!("min_force_N = {}", pick(random, &["0", "0", "0", "0", "0", "1e-3", "1e300"]))]);
    let bits = [random.u32(8..=24), random.u32(12..=18), random.u32(8..=18)];
    let inverse_bits = random.u32(bits[2]..=32);
    table(
        "fixed",
        vec![format!(
            "input_bits = {}\ndata_bits = {}\ncoef_bits = {}\ninverse_bits = {inverse_bits}\nprune_bits = {}",
            bits[0],
            bits[1],
            bits[2],
            random.u32(8..=31)
        )],
    );
    let scale = pick(random, &["", "full_scale_MPa = 1.0", "full_scale_MPa = 1e-300", "full_scale_MPa = 1e300"]);
    let dead = pick(random, &["", "", "", "", "", "", "dead = [[0, 0]]", "dead = [[0, 1], [1, 0], [1, 1]]"]);
    let unipolar = pick(random, &["false", "false", "false", "false", "false", "true"]);
    let running = ["zero = \"running\"", "zero = \"running\"\nzero_average = 1\nzero_limit_MPa = 0.01"];
    let zero = pick(random, &["", "", "", "", "", running[0], running[1]]);
    table("input", vec![scale.to_owned(), dead.to_owned(), format!("unipolar = {unipolar}"), zero.to_owned()]);
    table("output", vec![format!("forces = \"{}\"", pick(random, &["taxels", "resultants"]))]);
    if random.u8(..8) == 0 {
        let poisson = pick(random, &["0.3", "0.49", "0.4999"]);
        table("medium", vec![format!("kind = \"bonded-layer\"\npoisson = {poisson}")]);
    }
    text
}

/// Random stress as from a converter, a fault or a wrong unit.
pub fn drawn_stress(random: &mut Rng, taxels: usize) -> Vec<f64> {
    let size = 10f64.powi(*random.choice(&[-300, -30, -9, -3, -1, 0, 3, 9, 150, 307]).unwrap_or(&0));
    let kind = random.u8(..7);
    let one = random.usize(..taxels);
    let value = |random: &mut Rng, taxel: usize| match kind {
        0 => 0.0,
        1 => size * f64::from(u8::from(taxel == one)),
        2 => size,
        3 => -size * random.f64(),
        4 => size * if taxel.is_multiple_of(2) { 1.0 } else { -1.0 },
        5 => size * (-((taxel as f64 - one as f64) / 2.0).powi(2)).exp(),
        _ => size * (2.0 * random.f64() - 1.0),
    };
    (0..taxels).map(|taxel| value(random, taxel)).collect()
}
