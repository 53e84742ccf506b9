//! A board's answers as text.

use dermis_golden::fixed::Model;
use dermis_golden::link::{payloads, takes, Kind, LinkKind};

use super::table::significant_digits;
use crate::host::{Answer, PhysicalAnswer};

/// The resultants of one frame.
pub fn resultants(frame: &str, physical: &PhysicalAnswer, answer: &Answer) -> String {
    let largest = physical.resultant_N.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let sign = |x: f64| if x.is_sign_negative() { "" } else { "+" };
    let [x, y, normal] = physical.resultant_N.map(|force| sign(force).to_owned() + &significant_digits(force, largest));
    let centre = physical.centre_mm.map_or("-".to_owned(), |[x, y]| format!("({x:+.2}, {y:+.2}) mm"));
    let flags: Vec<String> =
        physical.flags.iter().filter_map(|f| serde_json::to_value(f).ok()?.as_str().map(str::to_owned)).collect();
    format!(
        "{frame}: N x {x}   y {y}   normal {normal}   centre {centre}   taxels {}   flags {}\n{}",
        physical.loaded,
        if flags.is_empty() { "none".to_owned() } else { flags.join(", ") },
        equality(answer),
    )
}

/// Whether an answer equals the bit-true model's, if compared, and whether the board has dropped a packet before it.
pub fn equality(answer: &Answer) -> String {
    let checked = match &answer.difference {
        None => String::new(),
        Some(None) => "against model   equal, every bit\n".to_owned(),
        Some(Some(difference)) => format!("against model   DIFFERS: {difference}\n"),
    };
    let dropped =
        if answer.dropped_before() { "board           dropped a packet of this or an earlier frame\n" } else { "" };
    checked + dropped
}

/// Transfer times of a frame's packets on each link that the board supports.
pub fn wire_times(model: &Model) -> String {
    let sums = takes(model.board.engine, Kind::FrameForResultants);
    let sent = || payloads(model).into_iter().filter(|(what, _)| sums || *what != Kind::Resultants.name());
    let of = |(name, link): (&str, LinkKind)| {
        let rate = link.bit_rate(&model.board).ok()?;
        let time = |(what, bytes)| format!("{what} {:.3} ms", link.wire_ms(bytes, rate));
        let times: Vec<String> = sent().map(time).collect();
        Some(format!("{} at {rate} bit/s: {}\n", name.to_uppercase(), times.join(", ")))
    };
    LinkKind::NAMES.into_iter().filter_map(of).collect()
}
