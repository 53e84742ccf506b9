//! A connection to an identified board, with the model of its scene.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::answer::BoardAnswer;
use super::board::{load, Board};
use super::client::Client;
use super::error::HostError;
use super::host_uart::require_uart;
use super::network::NetworkClient;
use anyhow::{anyhow, bail, Result};
use dermis_cosim::device_error::device_error;
use dermis_golden::data::frame::Frame;
use dermis_golden::data::input::tare::require_readings;
use dermis_golden::data::input::Input;
use dermis_golden::engine::{Engine, EngineError, State};
use dermis_golden::fixed::Model;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::link_kind::LinkKind;
use dermis_golden::spec::scene::{EstimatorKind, Scene};
use dermis_golden::wire::link::{Identity, Kind};

/// Longest wait of a read of the port for a byte.
const READ_TIMEOUT: Duration = Duration::from_millis(10);

/// A connection to an identified board, with the model of its scene.
pub struct Session {
    /// The board.
    pub board: Box<dyn Board + Send>,
    /// The bit-true model.
    pub model: Model,
    /// The board's identification.
    pub identity: Identity,
    /// Subtracted from each reading before it is sent: the tare frame, less the zero that the board subtracts.
    offset: Option<Vec<f64>>,
    forces: bool,
    check: bool,
}

impl Session {
    /// Identifies the board and checks that it was built for `hardware`; the model is then that of the board's array. With `specimen`,
    /// the model of that hardware with other tables, writes these into the board.
    ///
    /// # Errors
    /// No answer, another packet version, another scene, tables that are not whole afterwards, files of the array that are wrong.
    pub fn new(
        mut board: Box<dyn Board + Send>,
        hardware: Model,
        specimen: Option<Model>,
        tare: Option<&Frame>,
        forces: bool,
        check: bool,
    ) -> Result<Self> {
        let identity = board.identify(&hardware)?;
        if let Some(specimen) = &specimen {
            load(board.as_mut(), specimen, !identity.supports(Kind::FrameForResultants))?;
        }
        let model = specimen.map_or_else(|| hardware.of_array(board.array()), Ok)?;
        let offset = tare.map(|tare| offset(&model.scene, model.input(), tare)).transpose()?;
        Ok(Session { board, model, identity, offset, forces, check })
    }

    /// The readings to send for a frame, so that after the scene's own zero the tare frame has been subtracted once; 0
    /// for dead taxels.
    fn subtract_tare(&self, frame: &Frame) -> Frame {
        less(frame, self.offset.as_deref().unwrap_or_default()).mask_dead(&self.model.scene.input.dead)
    }

    /// Sends a frame; returns the readings sent, and the answer, compared with the model if requested.
    ///
    /// # Errors
    /// A frame of another sensor, a board that scans its array, no answer.
    pub fn request(&mut self, frame: &Frame) -> Result<(Frame, BoardAnswer)> {
        if self.identity.scans() {
            bail!("hardware.source = adc-scan: the board scans its array and takes no frames");
        }
        let frame = self.subtract_tare(frame);
        let codes = self.sent_codes(self.model.readings(std::slice::from_ref(&frame))?);
        let answer = self.exchange(&codes)?;
        let answer = self.checked(answer, &codes);
        Ok((frame, answer))
    }

    /// Asks a board that scans its array for the next scan; returns its readings as a frame named `id`, and the answer, compared
    /// with the model if requested.
    ///
    /// # Errors
    /// A board that does not scan, no answer.
    pub fn scan(&mut self, id: &str) -> Result<(Frame, BoardAnswer)> {
        if !self.identity.scans() {
            bail!("hardware.source = stream: the board takes frames and scans no array");
        }
        let answer = self.exchange(&[])?;
        let readings = self.model.readings_of(id, &answer.codes);
        let readings = readings.ok_or_else(|| anyhow!("the answer has {} codes", answer.codes.len()))?;
        let codes = answer.codes.clone();
        let answer = self.checked(answer, &codes);
        Ok((readings, answer))
    }

    /// Whether all forces are requested: a board that cannot sum them sends them all, and the host sums them. One that sends
    /// records has no forces.
    fn requests_forces(&self) -> bool {
        match self.forces {
            true => self.identity.supports(Kind::FrameForForces),
            false => !self.identity.supports(Kind::FrameForResultants),
        }
    }

    /// Codes rounded down to the bits that are sent.
    fn sent_codes(&self, codes: Vec<i32>) -> Vec<i32> {
        let left_out = self.board.bits_left_out();
        codes.into_iter().map(|code| code >> left_out << left_out).collect()
    }

    fn exchange(&mut self, codes: &[i32]) -> Result<BoardAnswer, HostError> {
        let forces = self.requests_forces();
        self.board.frame(&self.model, codes, forces)
    }

    /// The answer compared with the model if requested, with the forces that the user wants.
    fn checked(&self, mut answer: BoardAnswer, codes: &[i32]) -> BoardAnswer {
        if self.check {
            answer.difference = Some(answer.compare_with_model(&self.model, codes));
        }
        answer.forces = answer.forces.filter(|_| self.forces || !self.requests_forces());
        answer
    }
}

/// A board as an engine, which takes no blocks of several frames; its session must ask for forces.
pub struct BoardEngine {
    /// The model of the board's hardware.
    model: Model,
    session: Mutex<Session>,
}

impl BoardEngine {
    /// The board of a session.
    pub fn new(session: Session) -> Self {
        BoardEngine { model: session.model.clone(), session: Mutex::new(session) }
    }

    fn result(&self, frames: &[Frame]) -> Result<Reconstruction> {
        let [frame] = frames else { bail!("{} frames: a board takes one for each result", frames.len()) };
        let (readings, answer) = self.session.lock().unwrap_or_else(PoisonError::into_inner).request(frame)?;
        answer.decode(&self.model, &readings)?.ok_or_else(|| anyhow!("the answer has no forces"))
    }
}

impl Engine for BoardEngine {
    fn scene(&self) -> &Scene {
        &self.model.scene
    }

    fn input(&self) -> &Input {
        self.model.input()
    }

    fn estimator(&self) -> EstimatorKind {
        self.model.estimator()
    }

    fn reconstruct_after(&self, _: &mut State, frames: &[Frame]) -> Result<Reconstruction, EngineError> {
        self.result(frames).map_err(device_error)
    }
}

/// What to subtract from readings before a board subtracts the zero of its own `input`, so that `tare` is subtracted in
/// total.
///
/// # Errors
/// A tare frame that lacks the reading of a live taxel.
fn offset(scene: &Scene, input: &Input, tare: &Frame) -> Result<Vec<f64>> {
    require_readings(&tare.id, std::slice::from_ref(tare), scene)?;
    Ok(less(tare, input.zero().unwrap_or_default()).stress_MPa)
}

/// The frame minus `offset`, an empty one being zero.
fn less(frame: &Frame, offset: &[f64]) -> Frame {
    let mut frame = frame.clone();
    frame.stress_MPa.iter_mut().zip(offset).for_each(|(reading, offset)| *reading -= offset);
    frame
}

/// What a port of a core behind Ethernet begins with.
const UDP: &str = "udp:";

/// Opens the port of a board with the hardware of `model`: a serial port at its bit rate unless `baud` gives another, or
/// `udp:HOST` or `udp:HOST:PORT` of a core behind Ethernet, with `#3` for an array of several; `command` is that of the user. Requests are repeated after `timeout`
/// without an answer.
///
/// # Errors
/// A link that is no serial port, a board without one, a port that does not exist, is in use, or does not support the bit rate.
pub fn open_board(
    port: &str,
    model: &Model,
    baud: Option<u32>,
    timeout: Duration,
    command: &str,
) -> Result<Box<dyn Board + Send>> {
    if let Some(address) = port.strip_prefix(UDP) {
        let address = address.strip_prefix("//").unwrap_or(address);
        return Ok(Box::new(NetworkClient::open(address, timeout)?));
    }
    require_uart(&model.scene, command)?;
    let baud = baud.map_or_else(|| LinkKind::Uart.bit_rate(&model.board), Ok)?;
    Ok(Box::new(open(port, baud, timeout)?))
}

/// Opens a serial port at `baud` bit/s.
///
/// # Errors
/// A port that does not exist, is in use, or does not support the bit rate.
pub fn open(port: &str, baud: u32, timeout: Duration) -> Result<Client<Box<dyn serialport::SerialPort>>, HostError> {
    let opened = serialport::new(port, baud).timeout(READ_TIMEOUT).open();
    let opened = opened.map_err(|error| HostError::Port { port: port.to_owned(), reason: error.to_string() })?;
    Ok(Client::new(opened, port, timeout))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::scene::Scene;

    #[test]
    fn a_tare_of_the_host_takes_the_place_of_the_scenes() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        let reads = |value: f64| Frame::from_stress("reads", &scene.sensor, vec![value; 64]).unwrap();
        let (own, later, pressed) = (reads(0.25), reads(0.5), reads(0.75));
        let path = folder.path().join("zero.json");
        std::fs::write(&path, own.to_json()).unwrap();
        let sent = |scene: &Scene| {
            let model = Model::new(scene).unwrap();
            let sent = less(&pressed, &offset(scene, &Input::new(scene).unwrap(), &later).unwrap());
            model.stress(&[sent]).unwrap().stress_MPa
        };
        assert_eq!(sent(&scene), vec![0.25; 64]);
        (scene.input.tare, scene.input.full_scale_MPa) = (Some(path), Some(1.0));
        assert_eq!(sent(&scene), vec![0.25; 64]);
        // A taxel without a reading has no zero.
        let lacking = Frame { missing: vec![9], ..later.clone() };
        let error = offset(&scene, &Input::new(&scene).unwrap(), &lacking).unwrap_err().to_string();
        assert_eq!(error, "reads: no frame has a reading of row 1, column 1");
    }
}
