//! Sums of 2^k frames, taxel by taxel.

use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::pass_through::pass_through;
use crate::wire::{Wire, Word};

/// ```text
/// s_axis --> read sum, hold word --> add --> memory; in the last of the 2^k frames also m_axis
/// ```
/// The sums have their own memory, so that frames arrive while the frame buffer is still being read. An early `tlast`
/// in any of the frames restarts the sum; its partial sum leaves as a beat with `tlast`, at which `receive` drops the
/// frame and sets `framing`. If `tlast` is missing in any of the frames, it is missing on the sum's last beat too. With
/// k = 0 the stream passes through.
///
/// Latency two cycles; all registers advance together while the output is free.
#[derive(LogicBlock)]
pub struct Average {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's word, `bits` wide, two's complement; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A taxel's sum, `bits + power` wide, two's complement; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of the sums; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    _sums: Vec<i64>,
    _power: u32,
    _taxel: usize,
    _frame: usize,
    _missed: bool,
    _held: Option<Held>,
    _out: Option<(i64, bool)>,
}

/// An accepted word and what becomes of its sum.
#[derive(Clone, Copy, Debug)]
struct Held {
    taxel: usize,
    word: i64,
    first: bool,
    leaves: bool,
    last: bool,
}

impl Average {
    /// Sums words of `bits` bits of `taxels` taxels over 2^`power` frames.
    pub fn new(taxels: usize, bits: usize, power: u32) -> Self {
        Average {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(bits + power as usize),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            _sums: vec![0; taxels],
            _power: power,
            _taxel: 0,
            _frame: 0,
            _missed: false,
            _held: None,
            _out: None,
        }
    }

    fn take(&mut self) -> Held {
        let (at_end, last) = (self._taxel + 1 == self._sums.len(), self.s_axis_tlast.val());
        let final_frame = self._frame + 1 == 1 << self._power;
        let early = last && !at_end;
        let held = Held {
            taxel: self._taxel,
            word: self.s_axis_tdata.val().signed(0, self.s_axis_tdata.width()),
            first: self._frame == 0,
            leaves: final_frame || early,
            last: last && (early || !self._missed),
        };
        self._missed = match (early, at_end) {
            (true, _) => false,
            (false, true) => !final_frame && (self._missed || !last),
            (false, false) => self._missed,
        };
        self._frame = match (early, at_end) {
            (true, _) => 0,
            (false, true) => (self._frame + 1) % (1 << self._power),
            (false, false) => self._frame,
        };
        self._taxel = if early || at_end { 0 } else { self._taxel + 1 };
        held
    }
}

impl Logic for Average {
    fn update(&mut self) {
        if self._power == 0 {
            self.m_axis_tdata.next = self.s_axis_tdata.val();
            self.m_axis_tvalid.next = self.s_axis_tvalid.val();
            self.m_axis_tlast.next = self.s_axis_tlast.val();
            self.s_axis_tready.next = self.m_axis_tready.val();
            return;
        }
        if self.clk.pos_edge() {
            if self._out.is_none() || self.m_axis_tready.val() {
                self._out = self._held.and_then(|held| {
                    let sum = held.word + if held.first { 0 } else { self._sums[held.taxel] };
                    self._sums[held.taxel] = sum;
                    held.leaves.then_some((sum, held.last))
                });
                self._held = self.s_axis_tvalid.val().then(|| self.take());
            }
            if self.rst.val() {
                (self._held, self._out, self._taxel, self._frame, self._missed) = (None, None, 0, 0, false);
            }
        }
        self.s_axis_tready.next = (self._out.is_none() || self.m_axis_tready.val()) && !self.rst.val();
        self.m_axis_tvalid.next = self._out.is_some();
        if let Some((sum, last)) = self._out {
            self.m_axis_tdata.next = Word::of_fields(&[sum], self.m_axis_tdata.width());
            self.m_axis_tlast.next = last;
        }
    }

    fn connect(&mut self) {
        self.s_axis_tready.connect();
        self.m_axis_tdata.connect();
        self.m_axis_tvalid.connect();
        self.m_axis_tlast.connect();
    }

    fn hdl(&self) -> Verilog {
        if self._power == 0 {
            return pass_through("No averaging: the stream passes through.");
        }
        let (k, bits, taxel) = (self._power as usize, self.s_axis_tdata.width(), count_bits(self._sums.len()));
        Verilog::Custom(format!(
            "\
reg [{sum_end}:0] sums [0:{last_taxel}];
reg [{taxel_end}:0] taxel, held_taxel;
reg [{k_end}:0] frame;
reg missed;
reg held, held_first, held_leaves, held_last;
reg [{end}:0] word;
reg [{sum_end}:0] sofar;
wire at_end = taxel == {taxel}'d{last_taxel};
wire final_frame = frame == {{{k}{{1'b1}}}};
wire early = s_axis_tlast && !at_end;
wire [{sum_end}:0] sum = {{{{{k}{{word[{end}]}}}}, word}} + (held_first ? {sum_bits}'d0 : sofar);
wire moves = !m_axis_tvalid || m_axis_tready;
always @(*) s_axis_tready = moves && !rst;
always @(posedge clk) begin
  if (rst) begin
    held <= 1'b0;
    m_axis_tvalid <= 1'b0;
    taxel <= {taxel}'d0;
    frame <= {k}'d0;
    missed <= 1'b0;
  end else if (moves) begin
    held <= s_axis_tvalid;
    m_axis_tvalid <= held && held_leaves;
    if (s_axis_tvalid) begin
      taxel <= early || at_end ? {taxel}'d0 : taxel + {taxel}'d1;
      if (early) begin
        frame <= {k}'d0;
        missed <= 1'b0;
      end else if (at_end) begin
        frame <= frame + {k}'d1;
        missed <= !final_frame && (missed || !s_axis_tlast);
      end
    end
  end
  if (moves) begin
    word <= s_axis_tdata;
    sofar <= sums[taxel];
    held_taxel <= taxel;
    held_first <= frame == {k}'d0;
    held_leaves <= final_frame || early;
    held_last <= s_axis_tlast && (early || !missed);
    m_axis_tdata <= sum;
    m_axis_tlast <= held_last;
  end
  if (moves && held) sums[held_taxel] <= sum;
end",
            sum_bits = bits + k,
            sum_end = bits + k - 1,
            last_taxel = self._sums.len() - 1,
            taxel_end = taxel - 1,
            k_end = k - 1,
            end = bits - 1,
        ))
    }
}
