//! Converters that the hardware reads by itself, and how it scans an array with them: `hardware.source = "adc-scan"`.
//!
//! ```text
//!  row ──> line driver ──> array ──> columns ──> converters ──(SCLK, CS, MOSI shared; one MISO each)──> codes
//! ```
//! Of each row the converters take all their channels, one after the other, all converters at once; column
//! `channel · converters + k` is on that channel of converter k. So the codes leave row-major without a buffer.
//!
//! A [`Converter`] is written once: the checks of a scene, the hardware, the model of the converter in the
//! co-simulation and the table of the guide take it from here. [`timing::Timing`] is what follows for a clock, in cycles.

pub mod timing;

/// A converter with its serial interface, in facts of its data sheet. Both sides change their output at the leading edge of
/// SCLK and sample at the trailing one (CPHA = 1); the input is sampled when CS falls, and the command in a frame chooses
/// the channel of the next frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    /// Name in a scene file.
    pub name: &'static str,
    /// Data sheet.
    pub source: &'static str,
    /// Bits of a result, straight binary; the result is the end of a frame.
    pub bits: u32,
    /// Whether the middle of the range means 0 (bipolar input) and not its lower end.
    pub bipolar: bool,
    /// Number of input channels.
    pub channels: usize,
    /// Bits from CS falling to CS rising.
    pub frame_bits: u32,
    /// Bits with the number of the channel, directly before the result; 0 if a result does not name its channel.
    pub tag_bits: u32,
    /// SCLK is high while idle (CPOL).
    pub idle_high: bool,
    /// Command, `frame_bits` wide, that chooses channel 0.
    pub command: u32,
    /// Position of the channel's number in the command.
    pub channel_shift: u32,
    /// Highest SCLK, MHz.
    pub most_sclk_MHz: f64,
    /// From the end of a frame to the falling CS that samples the input, ns.
    pub acquisition_ns: f64,
    /// Shortest time with CS high, ns.
    pub cs_high_ns: f64,
    /// From CS falling to the first edge of SCLK, ns.
    pub cs_setup_ns: f64,
    /// MOSI before the trailing edge, ns.
    pub input_setup_ns: f64,
    /// MOSI after the trailing edge, ns.
    pub input_hold_ns: f64,
    /// From the leading edge until MISO is valid, ns.
    pub output_delay_ns: f64,
}

/// The converters that a scene can name. Commands and the order of the bits are those of public drivers of these parts; the
/// times must be compared with the data sheet of the part that is soldered in, since the model of the converter has the same.
pub const CONVERTERS: [Converter; 2] = [
    // Sections Timing Characteristics, ADC Mode Control Register and Manual Mode. Manual mode with the external clock: bits 14
    // to 11 are SCAN = 0001, 10 to 7 the channel, 2 CHAN_ID, 1 SWCNV.
    Converter {
        name: "max11125",
        source: "Maxim MAX11120–MAX11128",
        bits: 12,
        bipolar: false,
        channels: 8,
        frame_bits: 16,
        tag_bits: 4,
        idle_high: true,
        command: 0x0806,
        channel_shift: 7,
        most_sclk_MHz: 16.0,
        acquisition_ns: 156.0,
        cs_high_ns: 10.0,
        cs_setup_ns: 4.0,
        input_setup_ns: 4.0,
        input_hold_ns: 1.0,
        output_delay_ns: 16.5,
    },
    // Sections Timing Requirements: Serial Interface and Command Register Map. Commands MAN_Ch_n, in the range after a reset,
    // ±2.5 · 4.096 V. The result follows 16 bits of zeros.
    Converter {
        name: "ads8688",
        source: "TI ADS8688, SBAS582",
        bits: 16,
        bipolar: true,
        channels: 8,
        frame_bits: 32,
        tag_bits: 0,
        idle_high: false,
        command: 0xc000_0000,
        channel_shift: 26,
        most_sclk_MHz: 17.0,
        acquisition_ns: 1150.0,
        cs_high_ns: 30.0,
        cs_setup_ns: 30.0,
        input_setup_ns: 5.0,
        input_hold_ns: 5.0,
        output_delay_ns: 10.0,
    },
];

impl Converter {
    /// Bits of a result without its sign: a code with a sign holds them.
    pub fn magnitude_bits(&self) -> u32 {
        self.bits - u32::from(self.bipolar)
    }

    /// LSBs from 0 to the upper end of the range.
    pub fn full_steps(&self) -> f64 {
        (1u64 << self.magnitude_bits()) as f64
    }

    /// Bits of tag and result, the end of a frame.
    pub fn answer_bits(&self) -> u32 {
        self.tag_bits + self.bits
    }

    /// The command that chooses a channel.
    pub fn command_of(&self, channel: usize) -> u32 {
        self.command | (channel as u32) << self.channel_shift
    }

    /// The channel that a command chooses; `None` if it is another command.
    pub fn channel_of(&self, command: u32) -> Option<usize> {
        (0..self.channels).find(|&channel| self.command_of(channel) == command)
    }
}

/// Table `[hardware.adc_scan]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdcScan {
    /// The converters' type.
    pub converter: Converter,
    /// Number of converters, 1 to [`MOST_CONVERTERS`].
    pub converters: usize,
    /// Channels that are used of each; times `converters` the columns of the array.
    pub channels: usize,
    /// SCLK in MHz, above 0: the clock's next lower even fraction is taken.
    pub sclk_MHz: f64,
    /// Time from switching a row until its columns have settled, µs, ≥ 0.
    pub row_settling_us: f64,
    /// Least time between two samples where the channel changes, µs, ≥ 0; the converter's own acquisition is kept in any case.
    pub channel_settling_us: f64,
    /// Binary logarithm of the samples of a taxel that are averaged, 0 to [`MOST_AVERAGE`].
    pub average: u32,
    /// Time from one scan to the next, µs, above 0.
    pub period_us: f64,
}

/// Largest number of converters on one CS.
pub const MOST_CONVERTERS: usize = 8;
/// Largest binary logarithm of the samples of a taxel.
pub const MOST_AVERAGE: u32 = 8;

impl AdcScan {
    /// Samples of a taxel that are averaged.
    pub fn samples(&self) -> usize {
        1 << self.average
    }

    /// Columns of the array that the converters read.
    pub fn cols(&self) -> usize {
        self.converters * self.channels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_read_back_and_no_other_is_one() {
        for converter in CONVERTERS {
            for channel in 0..converter.channels {
                let command = converter.command_of(channel);
                assert_eq!(converter.channel_of(command), Some(channel));
                assert_eq!(converter.channel_of(command ^ 1), None);
            }
            assert!(converter.answer_bits() <= converter.frame_bits);
        }
    }
}
