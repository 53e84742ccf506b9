//! The table of `dermis converters`.

use dermis_golden::spec::adc::{Converter, CONVERTERS};

use super::table::markdown;

/// A fact: its name, and its value for a converter.
type Fact = (&'static str, fn(&Converter) -> String);

const FACTS: [Fact; 15] = [
    ("bits of a result", |c| c.bits.to_string()),
    ("input", |c| if c.bipolar { "bipolar" } else { "unipolar" }.to_owned()),
    ("channels", |c| c.channels.to_string()),
    ("bits of a frame", |c| c.frame_bits.to_string()),
    ("bits that name the channel", |c| c.tag_bits.to_string()),
    ("SCLK while idle", |c| if c.idle_high { "high" } else { "low" }.to_owned()),
    ("command of channel 0", |c| format!("0x{:x}", c.command)),
    ("bit of the channel in it", |c| c.channel_shift.to_string()),
    ("highest SCLK, MHz", |c| c.most_sclk_MHz.to_string()),
    ("acquisition, ns", |c| c.acquisition_ns.to_string()),
    ("CS high, ns", |c| c.cs_high_ns.to_string()),
    ("CS before SCLK, ns", |c| c.cs_setup_ns.to_string()),
    ("MOSI before and after its edge, ns", |c| format!("{}, {}", c.input_setup_ns, c.input_hold_ns)),
    ("MISO after its edge, ns", |c| c.output_delay_ns.to_string()),
    ("data sheet", |c| c.source.to_owned()),
];

/// A row per fact, a column per converter.
pub fn converters() -> String {
    let head: Vec<&str> = ["fact"].into_iter().chain(CONVERTERS.iter().map(|converter| converter.name)).collect();
    let row = |(name, of): &Fact| [(*name).to_owned()].into_iter().chain(CONVERTERS.iter().map(of)).collect();
    markdown(&head, FACTS.iter().map(row).collect())
}
