//! Converters on one bus, modelled from their data sheet: what they answer, and which of its times the hardware breaks.
//!
//! | checked | at |
//! |---|---|
//! | CS high, acquisition, settling of row and channel | CS falling |
//! | CS setup, SCLK idle | first edge of SCLK, CS falling |
//! | period of SCLK | leading edge |
//! | setup and hold of MOSI | trailing edge, change of MOSI |
//! | number of bits, command | CS rising |
//!
//! A row or channel that has not settled yet gives the voltages of the one before. The output is inverted until its delay
//! is over, so that a sample taken too early is wrong.

use dermis_golden::spec::adc::{AdcScan, Converter};
use dermis_hdl::scan::ScanPins;

use super::array::Array;

/// Violations that are kept.
const KEPT: usize = 20;

/// All converters of a scan.
#[derive(Clone, Debug)]
pub struct Converters {
    scan: AdcScan,
    array: Array,
    /// Length of a clock cycle, ns.
    cycle_ns: f64,
    /// Cycles so far.
    now: u64,
    before: ScanPins,
    /// Row before the switch, and when it was switched.
    row: (u64, u64),
    /// Channel chosen before and now, and when.
    channels: [usize; 2],
    chosen: u64,
    rose: u64,
    fell: u64,
    led: Option<u64>,
    trailed: Option<u64>,
    moved: u64,
    command: u64,
    bits: u32,
    answers: Vec<u32>,
    frames: usize,
    violations: Vec<String>,
    count: usize,
}

impl Converters {
    /// The converters of `scan` at `array`; the hardware's clock has `clock_MHz`.
    pub fn new(scan: AdcScan, array: Array, clock_MHz: f64) -> Self {
        let idle = ScanPins { cs_n: true, sclk: scan.converter.idle_high, ..ScanPins::default() };
        Converters {
            scan,
            array,
            cycle_ns: 1e3 / clock_MHz,
            // All that was before is long ago.
            now: 1 << 40,
            before: idle,
            row: (0, 0),
            channels: [0; 2],
            chosen: 0,
            rose: 0,
            fell: 0,
            led: None,
            trailed: None,
            moved: 0,
            command: 0,
            bits: 0,
            answers: vec![0; scan.converters],
            frames: 0,
            violations: Vec::new(),
            count: 0,
        }
    }

    /// The times that were broken: the first of them as text, and their number.
    pub fn violations(&self) -> (&[String], usize) {
        (&self.violations, self.count)
    }

    /// Frames on the bus so far.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// The converters' outputs in the next cycle, as the hardware's input registers take them at its end; bit k is converter
    /// k.
    pub fn outputs(&self) -> u64 {
        let Some(led) = self.led else { return 0 };
        let converter = &self.scan.converter;
        let late = (self.now + 1 - led) as f64 * self.cycle_ns < converter.output_delay_ns;
        let at = converter.frame_bits.saturating_sub(self.bits);
        let bit = |answer: &u32| u64::from(at < 32 && answer >> at & 1 == 1) ^ u64::from(late);
        self.answers.iter().enumerate().fold(0, |pins, (own, answer)| pins | bit(answer) << own)
    }

    /// The hardware's pins of one cycle, which begin with it.
    pub fn cycle(&mut self, pins: &ScanPins) {
        let (before, converter) = (self.before, self.scan.converter);
        if pins.row != before.row {
            self.row = (before.row, self.now);
        }
        if pins.mosi != before.mosi {
            self.moved = self.now;
            if !pins.cs_n {
                self.require("hold of MOSI", self.trailed, converter.input_hold_ns);
            }
        }
        if before.cs_n && !pins.cs_n {
            self.fall(pins, &converter);
        }
        if !pins.cs_n && pins.sclk != before.sclk {
            if pins.sclk == converter.idle_high {
                self.trail(pins, &converter);
            } else {
                self.lead(&converter);
            }
        }
        if !before.cs_n && pins.cs_n {
            self.rise(&converter);
        }
        self.before = *pins;
        self.now += 1;
    }

    /// CS falls: the inputs are sampled.
    fn fall(&mut self, pins: &ScanPins, converter: &Converter) {
        self.require("CS high", Some(self.rose), converter.cs_high_ns);
        self.require("acquisition", Some(self.rose), converter.acquisition_ns);
        if pins.sclk != converter.idle_high {
            self.violate("SCLK is not idle where CS falls".to_owned());
        }
        let since = |at: u64| (self.now - at) as f64 * self.cycle_ns / 1e3;
        // A billionth for what divides exactly.
        let settled = |at: u64, us: f64| since(at) + 1e-9 >= us;
        let row = if settled(self.row.1, self.scan.row_settling_us) { pins.row } else { self.row.0 };
        let channel = self.channels[usize::from(settled(self.chosen, self.scan.channel_settling_us))];
        let answer = |own| self.array.answer(row as usize, channel, own, self.frames);
        self.answers = (0..self.scan.converters).map(answer).collect();
        (self.fell, self.bits, self.command, self.led, self.trailed) = (self.now, 0, 0, None, None);
    }

    fn lead(&mut self, converter: &Converter) {
        match self.led {
            None => self.require("CS setup", Some(self.fell), converter.cs_setup_ns),
            led => self.require("period of SCLK", led, 1e3 / converter.most_sclk_MHz),
        }
        self.led = Some(self.now);
        self.bits += 1;
    }

    fn trail(&mut self, pins: &ScanPins, converter: &Converter) {
        self.require("setup of MOSI", Some(self.moved), converter.input_setup_ns);
        self.command = self.command << 1 | u64::from(pins.mosi);
        self.trailed = Some(self.now);
    }

    fn rise(&mut self, converter: &Converter) {
        if self.bits != converter.frame_bits {
            self.violate(format!("a frame of {} bits, not {}", self.bits, converter.frame_bits));
        }
        match converter.channel_of(self.command as u32) {
            None => self.violate(format!("command 0x{:x}", self.command)),
            Some(channel) if channel != self.channels[1] => {
                (self.channels, self.chosen) = ([self.channels[1], channel], self.now);
            }
            Some(_) => {}
        }
        (self.rose, self.led) = (self.now, None);
        self.frames += 1;
    }

    fn require(&mut self, what: &str, since: Option<u64>, least_ns: f64) {
        let Some(since) = since else { return };
        let ns = (self.now - since) as f64 * self.cycle_ns;
        // A thousandth for what divides exactly.
        if ns + 1e-3 < least_ns {
            self.violate(format!("{what}: {ns:.1} ns, the data sheet asks for {least_ns} ns"));
        }
    }

    fn violate(&mut self, what: String) {
        self.count += 1;
        if self.violations.len() < KEPT {
            self.violations.push(format!("frame {} on the bus: {what}", self.frames));
        }
    }
}
