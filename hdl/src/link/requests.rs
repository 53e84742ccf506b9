//! Queue of the requests that the board has accepted and not answered yet.

use dermis_golden::link::Kind;
use rust_hdl::prelude::*;

use super::{COUNTERS, FORCES, IDENTITY, RESULTANTS};
use crate::primitives::count_bits;
use crate::wire::{Wire, Word};

/// Holds accepted requests until they are answered: one identification, one reading of the counters, and the frames in
/// the engine, in order. `offer` is high when one can be answered, with the number of the request and the source of the
/// answer; `begun` removes it.
///
/// The parallel engine holds at most three frames (one being sent, one computed, one received), so a queue of four
/// never overflows; the serial one holds two.
#[derive(LogicBlock)]
pub struct Requests {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A correct packet has been received; high for one cycle.
    pub good: Signal<In, Bit>,
    /// Its type; valid with `good`.
    pub kind: Wire<In>,
    /// Its sequence number; valid with `good`.
    pub number: Wire<In>,
    /// It is a frame, and the engine gets it; with `good`.
    pub taken: Signal<In, Bit>,
    /// A request without payload is accepted; with `good`.
    pub noted: Signal<Out, Bit>,
    /// A request without payload is dropped, because one of its type is not answered yet; with `good`.
    pub overrun: Signal<Out, Bit>,
    /// The engine offers a beat of an answer.
    pub answered: Signal<In, Bit>,
    /// An answer can start.
    pub offer: Signal<Out, Bit>,
    /// The offered answer starts in this cycle.
    pub begun: Signal<In, Bit>,
    /// Sequence number of its request; valid with `offer`.
    pub answer_number: Wire<Out>,
    /// Source of its payload, 2 bits; valid with `offer`.
    pub source: Wire<Out>,
    /// Frames are in the engine.
    pub waiting: Signal<Out, Bit>,
    _depth: usize,
    _state: State,
}

#[derive(Clone, Debug, Default)]
struct State {
    /// Sequence numbers of a pending identification and of a pending reading of the counters.
    plain: [Option<u8>; 2],
    /// Sequence numbers of the frames, and whether all forces (not resultants) are requested.
    frames: Vec<(u8, bool)>,
}

const PLAIN: [u8; 2] = [Kind::Identify as u8, Kind::ReadCounters as u8];

impl Requests {
    /// With a queue of `depth` frames, a power of two.
    pub fn new(depth: usize) -> Self {
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
            answer_number: Wire::new(8),
            source: Wire::new(2),
            waiting: Default::default(),
            _depth: depth,
            _state: State::default(),
        }
    }

    /// Which of the two requests without payload has been received in this cycle, if any.
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
        self.answer_number.next = Word::from(u64::from(number));
        self.source.next = Word::from(source as u64);
        self.waiting.next = waiting;
    }

    fn connect(&mut self) {
        for bit in [&mut self.noted, &mut self.overrun, &mut self.offer, &mut self.waiting] {
            bit.connect();
        }
        self.answer_number.connect();
        self.source.connect();
    }

    fn hdl(&self) -> Verilog {
        let at = count_bits(self._depth);
        Verilog::Custom(format!(
            "\
reg [7:0] identity_number, counters_number;
reg identity, counters;
reg [8:0] frames [0:{depth_end}];
reg [{at_end}:0] head, tail;
reg [{at}:0] fill;
wire [8:0] frame = frames[head];
wire asks_identity = good && kind == 8'd{ask_identity};
wire asks_counters = good && kind == 8'd{ask_counters};
always @(*) begin
  waiting = |fill;
  noted = (asks_identity && !identity) || (asks_counters && !counters);
  overrun = (asks_identity && identity) || (asks_counters && counters);
  offer = identity || counters || (waiting && answered);
  source = identity ? 2'd{IDENTITY} : counters ? 2'd{COUNTERS} : waiting && frame[8] ? 2'd{FORCES} : 2'd{RESULTANTS};
  answer_number = identity ? identity_number : counters ? counters_number : frame[7:0];
end
wire pop = begun && !identity && !counters;
always @(posedge clk) begin
  if (asks_identity && !identity) identity_number <= number;
  if (asks_counters && !counters) counters_number <= number;
  if (taken) frames[tail] <= {{kind == 8'd{ask_forces}, number}};
  if (rst) begin
    identity <= 1'b0;
    counters <= 1'b0;
    head <= {at}'d0;
    tail <= {at}'d0;
    fill <= {wide}'d0;
  end else begin
    identity <= identity ? !begun : asks_identity;
    counters <= counters ? !begun || identity : asks_counters;
    if (pop) head <= head + {at}'d1;
    if (taken) tail <= tail + {at}'d1;
    if (taken != pop) fill <= taken ? fill + {wide}'d1 : fill - {wide}'d1;
  end
end",
            depth_end = self._depth - 1,
            at_end = at - 1,
            wide = at + 1,
            ask_identity = Kind::Identify as u8,
            ask_counters = Kind::ReadCounters as u8,
            ask_forces = Kind::FrameForForces as u8,
        ))
    }
}
