//! Replacement for stage `receive` where the case is chosen per frame: a frame buffer per case, and the choice of the
//! case.
//!
//! Every buffer receives every code, each in the layout of its own subarrays; reads come from the buffer of the chosen
//! case. All buffers fill and become free together.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::{Choose, Receive};
use crate::primitives::{by_case, count_bits, frame_quads};
use crate::wire::{Wire, Word};

/// Ports as of [`Receive`]; `full` is high once the case has been chosen too.
#[derive(LogicBlock)]
pub struct Banks {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, `input_bits` wide, two's complement; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A beat is accepted in this cycle.
    pub accept: Signal<Out, Bit>,
    /// The accepted code, 0 for a dead taxel; valid with `accept`.
    pub taken_word: Wire<Out>,
    /// The frame buffers hold a whole frame and `which` is its case; high until `free`.
    pub full: Signal<Out, Bit>,
    /// The frame has been read: the buffers may be overwritten.
    pub free: Signal<In, Bit>,
    /// Index of the chosen case; valid with `full`.
    pub which: Wire<Out>,
    /// Address of the quad to read, over all subarrays.
    pub quad_address: Wire<In>,
    /// Four codes, `input_bits` each, signed; two cycles after `quad_address`.
    pub quad: Wire<Out>,
    /// Index of the subarray for `magnitude`, `positive` and `negative`; combinational.
    pub part: Wire<In>,
    /// OR of the magnitudes of the subarray's codes, `input_bits` − 1 wide; valid while `full`.
    pub magnitude: Wire<Out>,
    /// A code of the subarray is above the noise floor; valid while `full`.
    pub positive: Signal<Out, Bit>,
    /// A code of the subarray is below minus the noise floor; valid while `full`.
    pub negative: Signal<Out, Bit>,
    /// `tlast` was early or missing since the last `reported`.
    pub framing: Signal<Out, Bit>,
    /// Clears `framing`.
    pub reported: Signal<In, Bit>,
    banks: Vec<Receive>,
    choose: Choose,
}

impl Banks {
    /// A frame buffer for each case of `model`.
    pub fn new(model: &Model) -> Self {
        let cases = model.cases();
        let bits = model.formats.input_bits as usize;
        let parts = cases.iter().map(|case| case.parts.len()).max().unwrap_or(1);
        Banks {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            accept: Default::default(),
            taken_word: Wire::new(bits),
            full: Default::default(),
            free: Default::default(),
            which: Wire::new(count_bits(cases.len())),
            quad_address: Wire::new(count_bits(frame_quads(model.cases()))),
            quad: Wire::new(4 * bits),
            part: Wire::new(count_bits(parts)),
            magnitude: Wire::new(bits - 1),
            positive: Default::default(),
            negative: Default::default(),
            framing: Default::default(),
            reported: Default::default(),
            banks: cases.iter().map(Receive::new).collect(),
            choose: Choose::new(model),
        }
    }
}

impl Logic for Banks {
    fn update(&mut self) {
        let which = (self.choose.which.val().number() as usize).min(self.banks.len() - 1);
        for bank in &mut self.banks {
            bank.clk.next = self.clk.val();
            bank.rst.next = self.rst.val();
            bank.s_axis_tdata.next = self.s_axis_tdata.val();
            bank.s_axis_tvalid.next = self.s_axis_tvalid.val();
            bank.s_axis_tlast.next = self.s_axis_tlast.val();
            bank.free.next = self.free.val();
            bank.reported.next = self.reported.val();
            // An address beyond a smaller buffer is meant for another one; its data are not used.
            bank.quad_address.next = cut(&self.quad_address, bank.quad_address.width());
            bank.part.next = cut(&self.part, bank.part.width());
        }
        let (first, bank) = (&self.banks[0], &self.banks[which]);
        self.s_axis_tready.next = first.s_axis_tready.val();
        self.accept.next = first.accept.val();
        self.taken_word.next = first.taken_word.val();
        self.framing.next = first.framing.val();
        self.quad.next = bank.quad.val();
        self.magnitude.next = bank.magnitude.val();
        self.positive.next = bank.positive.val();
        self.negative.next = bank.negative.val();
        self.choose.clk.next = self.clk.val();
        self.choose.rst.next = self.rst.val();
        self.choose.code.next = self.s_axis_tdata.val();
        self.choose.accept.next = first.accept.val();
        self.choose.tlast.next = self.s_axis_tlast.val();
        self.choose.free.next = self.free.val();
        self.which.next = self.choose.which.val();
        self.full.next = self.choose.settled.val();
    }

    fn connect(&mut self) {
        for bank in &mut self.banks {
            bank.clk.connect();
            for bit in
                [&mut bank.rst, &mut bank.s_axis_tvalid, &mut bank.s_axis_tlast, &mut bank.free, &mut bank.reported]
            {
                bit.connect();
            }
            for wire in [&mut bank.s_axis_tdata, &mut bank.quad_address, &mut bank.part] {
                wire.connect();
            }
        }
        let choose = &mut self.choose;
        choose.clk.connect();
        choose.code.connect();
        for bit in [&mut choose.rst, &mut choose.accept, &mut choose.tlast, &mut choose.free] {
            bit.connect();
        }
        for bit in [&mut self.s_axis_tready, &mut self.accept, &mut self.full, &mut self.positive, &mut self.negative] {
            bit.connect();
        }
        self.framing.connect();
        for wire in [&mut self.taken_word, &mut self.which, &mut self.quad, &mut self.magnitude] {
            wire.connect();
        }
    }

    fn hdl(&self) -> Verilog {
        let same = ["clk", "rst", "s_axis_tdata", "s_axis_tvalid", "s_axis_tlast", "free", "reported"];
        let inputs = |(number, bank): (usize, &Receive)| {
            let forward = |port: &&str| format!("  banks${number}${port} = {port};\n");
            let cut = |port: &str, from: &Wire<In>, to: &Wire<In>| match from.width() == to.width() {
                true => format!("  banks${number}${port} = {port};\n"),
                false => format!("  banks${number}${port} = {port}[{}:0];\n", to.width() - 1),
            };
            same.iter().map(forward).collect::<String>()
                + &cut("quad_address", &self.quad_address, &bank.quad_address)
                + &cut("part", &self.part, &bank.part)
        };
        let inputs: String = self.banks.iter().enumerate().map(inputs).collect();
        let count = self.banks.len();
        let chosen = |port: &str| {
            let each: Vec<String> = (0..count).map(|number| format!("banks${number}${port}")).collect();
            format!("  {port} = {};\n", by_case(&each))
        };
        let outputs: String = ["quad", "magnitude", "positive", "negative"].iter().map(|port| chosen(port)).collect();
        // All buffers fill and become free together: the handshake outputs of the first are those of all.
        let unused: Vec<String> = ["s_axis_tready", "accept", "taken_word", "framing"]
            .iter()
            .flat_map(|port| (1..count).map(move |number| format!("banks${number}${port}")))
            .chain((0..count).flat_map(|number| ["full", "which"].map(|port| format!("banks${number}${port}"))))
            .collect();
        Verilog::Custom(format!(
            "\
wire unused = &{{1'b0, {unused}}};
always @(*) begin
{inputs}  choose$clk = clk;
  choose$rst = rst;
  choose$code = s_axis_tdata;
  choose$accept = banks$0$accept;
  choose$tlast = s_axis_tlast;
  choose$free = free;
  s_axis_tready = banks$0$s_axis_tready;
  accept = banks$0$accept;
  taken_word = banks$0$taken_word;
  framing = banks$0$framing;
  which = choose$which;
  full = choose$settled;
end
always @(*) begin
{outputs}end",
            unused = unused.join(", "),
        ))
    }
}

/// The low `bits` bits of `wire`.
fn cut(wire: &Wire<In>, bits: usize) -> Word {
    Word::from(wire.val().field(0, bits))
}
