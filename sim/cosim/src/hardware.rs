//! The generated hardware of one scene, and its simulations.
//!
//! | in | out |
//! |---|---|
//! | bit-true [`Model`] | Verilog, taps and manifest ([`Generated`]) |
//! | [`Simulator`] | a [`Device`] |

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use anyhow::Result;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::Input;
use dermis_golden::engine::{Engine, EngineError, State};
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_hdl::device::{Device, Tap};
use dermis_hdl::link::{board_simulator, generate_board, BoardDevice};
use dermis_hdl::{generate, simulator, Generated};
use thiserror::Error;

use super::against_model::Vector;
use super::array_frames::{ArrayFrames, ArrayResult};
use super::board::VerilatedBoard;
use super::drive::{record, InputFrame, Stimulus};
use super::scan::ScannedBoard;
use super::simulator::Simulator;
use super::verilator::{Design, Optimisation, Verilated, VerilatorError};
use crate::device_error::device_error;
use dermis_flow::netlist::netlist;

/// Cycles without a transfer after which a run is aborted; far above any scene's latency.
pub(super) const WATCHDOG: u64 = 1_000_000;

/// The simulated hardware stopped transferring beats: a defect of this program.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("frame {frame}, cycle {cycle}: {rule}")]
pub struct DeviceTimeout {
    /// Frame name.
    pub frame: String,
    /// Cycle in which the watchdog ended the run.
    pub cycle: u64,
    /// The transfer that was awaited, as text.
    pub rule: String,
}

/// A scene's model and the hardware generated from it.
pub struct Hardware {
    /// The bit-true model, with the tables that a run loads.
    pub model: Model,
    /// The model of what is built.
    built: Model,
    /// Verilog, memory files, taps, manifest.
    pub generated: Generated,
    /// Cache folder of Verilator libraries and netlists.
    cache: PathBuf,
}

impl Hardware {
    /// Generates the hardware of `model`; caches lie in the folder `build`.
    ///
    /// # Errors
    /// A design that the generator refuses.
    pub fn new(model: Model, build: &Path) -> Result<Self> {
        let generated = generate(&model)?;
        Ok(Hardware { built: model.clone(), model, generated, cache: build.join("verilator") })
    }

    /// From now on every run begins with the tables of `specimen`, which the model then has.
    ///
    /// # Errors
    /// As [`Model::with_tables`].
    pub fn load(&mut self, specimen: &Scene, version: u16) -> Result<()> {
        self.model = self.model.with_tables(specimen, version)?;
        Ok(())
    }

    /// The image with which every run begins, if tables have been loaded.
    pub fn image(&self) -> Option<Vector> {
        (self.model.own().version > 0).then(|| Vector::of_image(&self.model))
    }

    /// Starts a simulation of many cycles.
    ///
    /// # Errors
    /// No Verilator, a design that a simulator refuses, or files that cannot be written.
    pub fn device(&self, simulator: Simulator) -> Result<Box<dyn Device>> {
        self.device_with(simulator, Optimisation::On)
    }

    /// Starts a simulation that compares `vectors` in so many `runs`, and compiles it accordingly.
    ///
    /// # Errors
    /// As [`Hardware::device`].
    pub fn device_for(&self, simulator: Simulator, vectors: &[Vector], runs: usize) -> Result<Box<dyn Device>> {
        let cycles = vectors.iter().map(|vector| vector.expected.cycles.total).sum::<u64>() * runs as u64;
        self.device_with(simulator, Optimisation::of_cycles(cycles))
    }

    fn device_with(&self, simulator: Simulator, optimisation: Optimisation) -> Result<Box<dyn Device>> {
        Ok(match simulator {
            Simulator::Verilator => Box::new(self.verilated(&self.generated, false, optimisation)?),
            Simulator::Kernel => self::simulator(&self.built)?,
            Simulator::Netlist => {
                let netlist = netlist(&self.generated, self.model.board.family, &self.cache)?;
                Box::new(self.verilated(&netlist, false, optimisation)?)
            }
        })
    }

    /// Starts a Verilator simulation whose registers and memories can be read and changed.
    ///
    /// # Errors
    /// As [`Hardware::device`].
    pub fn device_with_open_state(&self, optimisation: Optimisation) -> Result<Verilated, VerilatorError> {
        self.verilated(&self.generated, true, optimisation)
    }

    fn verilated(
        &self,
        generated: &Generated,
        open_state: bool,
        optimisation: Optimisation,
    ) -> Result<Verilated, VerilatorError> {
        let design = Design {
            taps: &generated.taps,
            input_bits: self.model.stream_bits(),
            array_bits: self.built.scene.hardware.array_bits(),
            open_state,
            optimisation,
            ..Design::of_pins(generated)
        };
        Verilated::new(&design, &self.cache)
    }

    /// Starts a simulation of the whole board; [`Simulator::Netlist`] simulates its Verilog. A board that scans its array has the
    /// frames shipped for the sensor in front of its converters, one per scan, again and again.
    ///
    /// # Errors
    /// As [`Hardware::device`]; a scene whose board has no link; a scan of a sensor without shipped frames.
    pub fn board(&self, simulator: Simulator) -> Result<Box<dyn BoardDevice>> {
        let board: Box<dyn BoardDevice> = match simulator {
            Simulator::Kernel => board_simulator(&self.built)?,
            _ => Box::new(VerilatedBoard::new(&generate_board(&self.built)?, &self.built, &self.cache)?),
        };
        match self.built.scene.hardware.adc_scan {
            None => Ok(board),
            Some(_) => Ok(Box::new(ScannedBoard::new(board, &self.built, &Frame::shipped(&self.built.scene))?)),
        }
    }

    /// The taps that a simulator has; a netlist has none.
    pub fn taps(&self, simulator: Simulator) -> &[Tap] {
        match simulator {
            Simulator::Netlist => &[],
            Simulator::Verilator | Simulator::Kernel => &self.generated.taps,
        }
    }

    /// The names of a simulator's taps, and `vectors` reduced to what that simulator can be compared by.
    pub fn observable<'a>(
        &self,
        simulator: Simulator,
        vectors: &'a [Vector],
    ) -> (Vec<&'static str>, Cow<'a, [Vector]>) {
        let taps = self.taps(simulator);
        let vectors = match taps {
            [] => vectors.iter().map(Vector::without_stages).collect(),
            _ => Cow::Borrowed(vectors),
        };
        (taps.iter().map(|tap| tap.name).collect(), vectors)
    }

    /// Stage names of the taps, in the order of a device's outputs.
    pub fn tap_names(&self) -> Vec<&'static str> {
        self.generated.taps.iter().map(|tap| tap.name).collect()
    }

    /// The test vector of one reconstruction: codes of its frames and the bit-true model's results. With a sliding mean or a
    /// running zero these are all frames since the reset, of which the last are sent. Of several arrays the frames are of the first.
    ///
    /// # Errors
    /// A frame of another sensor, or a number of frames that the scene does not average.
    pub fn vector(&self, frames: &[Frame]) -> Result<Vector> {
        ArrayResult { array: 0, model: &self.model, frames }.vector()
    }

    /// The test vectors of frames that follow one another after a reset; of several arrays the frames are of one after the other.
    ///
    /// # Errors
    /// As [`Hardware::vector`] and [`ArrayFrames::all`].
    pub fn vectors(&self, frames: &[Frame]) -> Result<Vec<Vector>> {
        let arrays = ArrayFrames::all(&self.model, frames)?;
        ArrayFrames::results(&arrays).into_iter().map(ArrayResult::vector).collect()
    }

    /// The forces and status beats that the verilated hardware sends after the last of the frames.
    fn words(&self, frames: &[Frame]) -> Result<[Vec<[i32; 3]>; 2]> {
        let results = self.model.scene.input.frames_of_results(frames).into_iter();
        let vectors: Vec<Vector> = results.map(|frames| self.vector(frames)).collect::<Result<_>>()?;
        let inputs: Vec<InputFrame> = vectors.iter().map(Vector::input).collect();
        let mut device = self.device_for(Simulator::Verilator, &vectors, 1)?;
        let recording = record(device.as_mut(), 0, &inputs, Stimulus::FullSpeed, WATCHDOG);
        if let Some(timeout) = recording.timeout {
            let frame = frames.last().map_or_else(String::new, |frame| frame.id.clone());
            return Err(DeviceTimeout { frame, cycle: timeout.cycle, rule: timeout.rule }.into());
        }
        let before: usize = inputs.iter().rev().skip(1).map(|input| input.beats).sum();
        let mut forces: Vec<[i32; 3]> = recording.beats.iter().skip(before).map(|beat| beat.data).collect();
        let status = forces.split_off(self.model.force_beats().min(forces.len()));
        Ok([forces, status])
    }
}

impl Engine for Hardware {
    fn scene(&self) -> &Scene {
        &self.model.scene
    }

    fn input(&self) -> &Input {
        self.model.input()
    }

    fn estimator(&self) -> EstimatorKind {
        self.model.estimator()
    }

    /// In the verilated hardware (engine `rtl`), which begins with a reset.
    fn reconstruct_after(&self, state: &mut State, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        if state.has_begun() && self.scene().input.running_zero().is_some() {
            let text = "engine rtl: give all frames since a reset, with input.zero = \"running\"";
            return Err(EngineError::Device(text.into()));
        }
        let [forces, status] = self.words(frames).map_err(device_error)?;
        Ok(self.model.decode(frames, "rtl", &forces, &status)?)
    }
}
