//! Frames whose `tlast` comes early or is missing, under Verilator and in kernel simulation: an incomplete frame
//! leaves nothing behind, the next complete frame is equal to the bit-true model to the bit, and its status has
//! `framing`, once.

use dermis_cosim::hardware::Hardware;
use dermis_cosim::simulator::Simulator;
use dermis_golden::fixed::stages::send::FRAMING;
use dermis_golden::fixed::Model;
use dermis_hdl::device::{Device, Inputs};
use dermis_tests::{build_dir, scene};

/// Limit of cycles, far more than a frame takes.
const PATIENCE: usize = 5_000;

type Beats = Vec<[i32; 3]>;

/// A device whose output is always accepted, and the frames received from it.
struct Line {
    device: Box<dyn Device>,
    beats: Beats,
    frames: Vec<Beats>,
}

impl Line {
    fn new(hardware: &Hardware, simulator: Simulator) -> Line {
        let mut line = Line { device: hardware.device(simulator).unwrap(), beats: Vec::new(), frames: Vec::new() };
        line.reset();
        line
    }

    fn reset(&mut self) {
        for _ in 0..4 {
            self.device.cycle(&Inputs { rst: true, ..Inputs::default() });
        }
    }

    /// Simulates one cycle; returns whether an offered code was accepted.
    fn cycle(&mut self, inputs: Inputs) -> bool {
        let outputs = self.device.cycle(&Inputs { m_ready: true, ..inputs });
        if outputs.m_valid {
            self.beats.push(outputs.m_data);
            if outputs.m_last {
                self.frames.push(std::mem::take(&mut self.beats));
            }
        }
        outputs.s_ready
    }

    /// Offers one code per cycle, with `tlast` on the code of index `last`.
    fn send(&mut self, codes: &[i32], last: Option<usize>) {
        for (index, &s_data) in codes.iter().enumerate() {
            let inputs = Inputs { s_valid: true, s_data, s_last: last == Some(index), ..Inputs::default() };
            assert!((0..PATIENCE).any(|_| self.cycle(inputs)), "code {index} is not taken");
        }
    }

    /// All frames received within the time for the expected ones.
    fn receive(&mut self) -> Vec<Beats> {
        for _ in 0..PATIENCE {
            self.cycle(Inputs::default());
        }
        assert!(self.beats.is_empty(), "{} beats of a frame without end", self.beats.len());
        std::mem::take(&mut self.frames)
    }
}

/// Hardware, the codes of two frames, and the model's output for each, without and with the flag.
struct Setting {
    hardware: Hardware,
    codes: [Vec<i32>; 2],
    plain: [Beats; 2],
    flagged: [Beats; 2],
}

fn setting() -> Setting {
    let (scene, frames) = scene("eight-by-eight");
    let hardware = Hardware::new(Model::new(&scene).unwrap(), &build_dir()).unwrap();
    let codes = [0, 1].map(|index| hardware.vector(&frames[index..=index]).unwrap().codes);
    let sent = |flag: u32| {
        [0, 1].map(|index| {
            let mut trace = hardware.model.run(&codes[index]);
            trace.status[0][2] |= flag as i32;
            [trace.beats, trace.status].concat()
        })
    };
    Setting { plain: sent(0), flagged: sent(FRAMING.mask()), codes, hardware }
}

const SIMULATORS: [Simulator; 2] = [Simulator::Verilator, Simulator::Kernel];

#[test]
fn an_early_tlast_drops_its_frame_and_flags_the_next_one_once() {
    let s = setting();
    let end = Some(s.codes[0].len() - 1);
    for simulator in SIMULATORS {
        for cut in [1, 9, 63] {
            let mut line = Line::new(&s.hardware, simulator);
            line.send(&s.codes[1][..cut], Some(cut - 1));
            line.send(&s.codes[0], end);
            assert!(line.receive() == [s.flagged[0].clone()], "{}, cut after {cut}", simulator.name());
            line.send(&s.codes[1], end);
            assert!(line.receive() == [s.plain[1].clone()], "{}, second frame after {cut}", simulator.name());
        }
    }
}

#[test]
fn a_missing_tlast_keeps_its_frame_and_flags_it_once() {
    let s = setting();
    let end = Some(s.codes[0].len() - 1);
    for simulator in SIMULATORS {
        let mut line = Line::new(&s.hardware, simulator);
        line.send(&s.codes[0], None);
        assert!(line.receive() == [s.flagged[0].clone()], "{}", simulator.name());
        line.send(&s.codes[1], end);
        assert!(line.receive() == [s.plain[1].clone()], "{}, second frame", simulator.name());
    }
}

#[test]
fn two_cuts_are_one_flag_and_a_reset_clears_it() {
    let s = setting();
    let end = Some(s.codes[0].len() - 1);
    for simulator in SIMULATORS {
        let mut line = Line::new(&s.hardware, simulator);
        line.send(&s.codes[0], end);
        // While the first frame is computed, which must not be affected.
        line.send(&s.codes[1][..5], Some(4));
        line.send(&s.codes[1][..5], Some(4));
        assert!(line.receive() == [s.plain[0].clone()], "{}, before", simulator.name());
        line.send(&s.codes[1], end);
        assert!(line.receive() == [s.flagged[1].clone()], "{}, after", simulator.name());
        line.send(&s.codes[1][..5], Some(4));
        line.reset();
        line.send(&s.codes[0], end);
        assert!(line.receive() == [s.plain[0].clone()], "{}, reset", simulator.name());
    }
}
