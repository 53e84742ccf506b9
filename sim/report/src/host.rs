//! A board's answers as text.

use dermis_golden::fixed::Model;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::wire::link::{payloads, supports, Kind};

use super::network;
use super::table::{aligned, significant_digits};
use dermis_host::link::{BoardAnswer, PhysicalAnswer};

/// The resultants of one frame.
pub fn resultants(frame: &str, physical: &PhysicalAnswer, answer: &BoardAnswer) -> String {
    let largest = physical.resultant_N.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let sign = |x: f64| if x.is_sign_negative() { "" } else { "+" };
    let [x, y, normal] = physical.resultant_N.map(|force| sign(force).to_owned() + &significant_digits(force, largest));
    let centre = physical.centre_mm.map_or("-".to_owned(), |[x, y]| format!("({x:+.2}, {y:+.2}) mm"));
    let flags: Vec<&str> = physical.flags.iter().map(|flag| flag.name()).collect();
    format!(
        "{frame}: N x {x}   y {y}   normal {normal}   centre {centre}   taxels {}   flags {}\n{}",
        physical.loaded.map_or("-".to_owned(), |loaded| loaded.to_string()),
        if flags.is_empty() { "none".to_owned() } else { flags.join(", ") },
        equality(answer),
    )
}

/// Whether an answer equals the bit-true model's, if compared, and whether the board has dropped a packet before it.
pub fn equality(answer: &BoardAnswer) -> String {
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
    let line = |link: LinkTimes| {
        let sent = link.packets.iter().filter_map(|(packet, ms)| Some(format!("{packet} {:.3} ms", (*ms)?)));
        format!("{} at {} bit/s: {}\n", link.name(), link.bit_rate, sent.collect::<Vec<_>>().join(", "))
    };
    times(model).into_iter().map(line).collect()
}

/// The same of several scenes as a table, a row per link of the board and per width of forces on a network.
pub fn link_times(models: &[Model]) -> String {
    let head = ["scene", "link", "codes to the board", "resultants back", "all forces back"];
    let rows = |model: &Model| {
        let scene = model.scene.name.clone();
        times(model).into_iter().map(move |link| {
            let unit = if link.kind.clock().is_some() { "MHz" } else { "Mbit/s" };
            let rate = format!("{}, {} {unit}", link.name(), f64::from(link.bit_rate) / 1e6);
            row(scene.clone(), rate, link.packets.into_iter().map(|(_, ms)| ms))
        })
    };
    let of_network = |model: &Model| {
        let scene = model.scene.name.clone();
        let rate = f64::from(network::BIT_RATE) / 1e6;
        network::times(model).into_iter().map(move |(bits, times)| {
            let link = format!("UDP, {rate} Mbit/s, forces of {bits} bits");
            row(scene.clone(), link, times.into_iter())
        })
    };
    let rows = |model: &Model| rows(model).chain(of_network(model)).collect::<Vec<_>>();
    aligned(2, &head, models.iter().flat_map(rows).collect())
}

/// A line of the table: a time in ms, or none, for each packet.
fn row(scene: String, link: String, times: impl Iterator<Item = Option<f64>>) -> Vec<String> {
    let times = times.map(|ms| ms.map_or("-".into(), |ms| format!("{ms:.3} ms")));
    [scene, link].into_iter().chain(times).collect()
}

/// A link with the transfer times of a frame's packets.
struct LinkTimes {
    kind: LinkKind,
    /// Bits per second.
    bit_rate: u32,
    /// Names of the [`payloads`] and their times in ms, `None` for those that the board does not send.
    packets: Vec<(&'static str, Option<f64>)>,
}

impl LinkTimes {
    fn name(&self) -> String {
        self.kind.name().to_uppercase()
    }
}

/// The links that the model's board has.
fn times(model: &Model) -> Vec<LinkTimes> {
    let of = |(_, kind): (&str, LinkKind)| {
        let bit_rate = kind.bit_rate(&model.board).ok()?;
        let sent = |packet: &str| match packet {
            _ if packet == Kind::Resultants.name() => supports(model, Kind::FrameForResultants),
            _ if packet == Kind::Forces.name() => supports(model, Kind::FrameForForces),
            _ => true,
        };
        let time = |(packet, bytes)| (packet, sent(packet).then(|| kind.wire_ms(bytes, bit_rate)));
        Some(LinkTimes { kind, bit_rate, packets: payloads(model).into_iter().map(time).collect() })
    };
    LinkKind::NAMES.into_iter().filter_map(of).collect()
}
