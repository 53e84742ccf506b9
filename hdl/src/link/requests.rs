//! What the board owes the host.

use dermis_golden::link::{Kind, Sums, ANSWER, BEAT_BYTES};
use rust_hdl::prelude::*;

use super::{Shape, COUNTERS, FORCES, IDENTITY, IDENTITY_WORDS, RESULTANTS};
use crate::wire::{Wire, Word};

/// Keeps the requests taken until they are answered: one identification, one reading of the counters, and the frames
/// in the engine, in order. `offer` when one can be answered, with the answer's header and source; `begun` takes it.
///
/// The engine holds three frames at most (one being sent, one computed, one received), so that a queue of four
/// never overflows.
#[derive(LogicBlock)]
pub struct Requests {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Reset.
    pub rst: Signal<In, Bit>,
    /// A good packet.
    pub good: Signal<In, Bit>,
    /// Its type.
    pub kind: Wire<In>,
    /// Its sequence number.
    pub number: Wire<In>,
    /// It is a frame, and the engine has it.
    pub taken: Signal<In, Bit>,
    /// A good request without payload is taken.
    pub noted: Signal<Out, Bit>,
    /// It is dropped, because its like is not answered yet.
    pub overrun: Signal<Out, Bit>,
    /// The engine offers an answer.
    pub answered: Signal<In, Bit>,
    /// An answer can begin.
    pub offer: Signal<Out, Bit>,
    /// It begins.
    pub begun: Signal<In, Bit>,
    /// Its packet's header.
    pub header: Wire<Out>,
    /// Where its payload comes from.
    pub source: Wire<Out>,
    /// Frames are in the engine.
    pub waiting: Signal<Out, Bit>,
    _lengths: [usize; 4],
    _state: State,
}

#[derive(Clone, Debug, Default)]
struct State {
    /// Sequence numbers of a pending identification and reading of counters.
    plain: [Option<u8>; 2],
    /// Sequence numbers of the frames, and whether their forces are asked for.
    frames: Vec<(u8, bool)>,
}

/// Frames in the queue.
const DEPTH: usize = 4;
const PLAIN: [u8; 2] = [Kind::Identify as u8, Kind::ReadCounters as u8];

impl Requests {
    /// For the packets of `shape`.
    pub fn new(shape: &Shape) -> Self {
        let status = shape.status_beats * BEAT_BYTES;
        let mut lengths = [0; 4];
        lengths[IDENTITY] = IDENTITY_WORDS * BEAT_BYTES;
        lengths[COUNTERS] = BEAT_BYTES;
        lengths[RESULTANTS] = Sums::BYTES + status;
        lengths[FORCES] = shape.rows * shape.cols * BEAT_BYTES + status;
        Requests {
            clk: Default::default(),
            rst: Default::default(),
            good: Default::default(),
            kind: Wire::new(8),
            number: Wire::new(8),
            taken: Default::default(),
            noted: Default::default(),
            overrun: Default::default(),
            answered: Default::default(),
            offer: Default::default(),
            begun: Default::default(),
            header: Wire::new(32),
            source: Wire::new(2),
            waiting: Default::default(),
            _lengths: lengths,
            _state: State::default(),
        }
    }

    /// Which of the two requests without payload comes.
    fn plain(&self) -> Option<usize> {
        let kind = self.kind.val().number() as u8;
        PLAIN.iter().position(|&plain| plain == kind).filter(|_| self.good.val())
    }

    /// Source and sequence number of the next answer.
    fn next_answer(&self) -> (usize, u8) {
        match (&self._state.plain, self._state.frames.first()) {
            ([Some(number), _], _) => (IDENTITY, *number),
            ([None, Some(number)], _) => (COUNTERS, *number),
            (_, Some(&(number, forces))) => (if forces { FORCES } else { RESULTANTS }, number),
            (_, None) => (RESULTANTS, 0),
        }
    }

    fn advance(&mut self) {
        let number = self.number.val().number() as u8;
        let plain = self.plain().filter(|&plain| self._state.plain[plain].is_none());
        let (source, _) = self.next_answer();
        let s = &mut self._state;
        if self.begun.val() {
            match source {
                IDENTITY | COUNTERS => s.plain[source] = None,
                _ => {
                    s.frames.remove(0);
                }
            }
        }
        if let Some(plain) = plain {
            s.plain[plain] = Some(number);
        }
        if self.taken.val() {
            s.frames.push((number, self.kind.val().number() as u8 == Kind::FrameForForces as u8));
        }
        if self.rst.val() {
            *s = State::default();
        }
    }
}

impl Logic for Requests {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            self.advance();
        }
        let (source, number) = self.next_answer();
        let s = &self._state;
        let plain = self.plain().map(|plain| s.plain[plain].is_none());
        self.noted.next = plain == Some(true);
        self.overrun.next = plain == Some(false);
        let waiting = !s.frames.is_empty();
        self.offer.next = s.plain.iter().any(Option::is_some) || (waiting && self.answered.val());
        let kind = u64::from(ANSWER) + source as u64 + 1;
        self.header.next = Word::from((self._lengths[source] as u64) << 16 | u64::from(number) << 8 | kind);
        self.source.next = Word::from(source as u64);
        self.waiting.next = waiting;
    }

    fn connect(&mut self) {
        for bit in [&mut self.noted, &mut self.overrun, &mut self.offer, &mut self.waiting] {
            bit.connect();
        }
        self.header.connect();
        self.source.connect();
    }

    fn hdl(&self) -> Verilog {
        let [identity, counters, resultants, forces] = self._lengths;
        Verilog::Custom(format!(
            "\
reg [7:0] identity_number, counters_number;
reg identity, counters;
reg [8:0] frames [0:{depth_end}];
reg [1:0] head, tail;
reg [2:0] fill;
wire [8:0] frame = frames[head];
wire asks_identity = good && kind == 8'd{ask_identity};
wire asks_counters = good && kind == 8'd{ask_counters};
always @(*) begin
  waiting = fill != 3'd0;
  noted = (asks_identity && !identity) || (asks_counters && !counters);
  overrun = (asks_identity && identity) || (asks_counters && counters);
  offer = identity || counters || (waiting && answered);
  source = identity ? 2'd{IDENTITY} : counters ? 2'd{COUNTERS} : waiting && frame[8] ? 2'd{FORCES} : 2'd{RESULTANTS};
  case (source)
    2'd{IDENTITY}: header = {{16'd{identity}, identity_number, 8'd{identity_kind}}};
    2'd{COUNTERS}: header = {{16'd{counters}, counters_number, 8'd{counters_kind}}};
    2'd{RESULTANTS}: header = {{16'd{resultants}, frame[7:0], 8'd{resultants_kind}}};
    default: header = {{16'd{forces}, frame[7:0], 8'd{forces_kind}}};
  endcase
end
wire pop = begun && !identity && !counters;
always @(posedge clk) begin
  if (asks_identity && !identity) identity_number <= number;
  if (asks_counters && !counters) counters_number <= number;
  if (taken) frames[tail] <= {{kind == 8'd{ask_forces}, number}};
  if (rst) begin
    identity <= 1'b0;
    counters <= 1'b0;
    head <= 2'd0;
    tail <= 2'd0;
    fill <= 3'd0;
  end else begin
    identity <= identity ? !begun : asks_identity;
    counters <= counters ? !begun || identity : asks_counters;
    head <= head + {{1'b0, pop}};
    tail <= tail + {{1'b0, taken}};
    fill <= fill + {{2'd0, taken}} - {{2'd0, pop}};
  end
end",
            depth_end = DEPTH - 1,
            ask_identity = Kind::Identify as u8,
            ask_counters = Kind::ReadCounters as u8,
            ask_forces = Kind::FrameForForces as u8,
            identity_kind = Kind::Identity as u8,
            counters_kind = Kind::Counters as u8,
            resultants_kind = Kind::Resultants as u8,
            forces_kind = Kind::Forces as u8,
        ))
    }
}
