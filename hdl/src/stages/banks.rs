//! Replacement for stage `receive` where the case is chosen per frame: a frame buffer per case, and the choice of the
//! case.
//!
//! Every buffer receives every code, each in the layout of its own subarrays; reads come from the buffer of the chosen
//! case. All buffers fill and become free together.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::{Choose, Receive, ReceivePorts};
use crate::ports::has_ports;
use crate::primitives::by_case;
use crate::wire::{Wire, Word};

/// `full` is high once the case has been chosen too.
#[derive(LogicBlock)]
pub struct Banks {
    ports: ReceivePorts,
    banks: Vec<Receive>,
    choose: Choose,
}

has_ports!(Banks: ReceivePorts);

impl Banks {
    /// A frame buffer for each case of `model`.
    pub fn new(model: &Model) -> Self {
        let cases = model.cases();
        Banks {
            ports: ReceivePorts::new(cases),
            banks: cases.iter().map(Receive::new).collect(),
            choose: Choose::new(model),
        }
    }
}

impl Logic for Banks {
    fn update(&mut self) {
        let Banks { ports, banks, choose } = self;
        let which = (choose.which.val().number() as usize).min(banks.len() - 1);
        for bank in banks.iter_mut() {
            bank.clk.next = ports.clk.val();
            bank.rst.next = ports.rst.val();
            bank.s_axis_tdata.next = ports.s_axis_tdata.val();
            bank.s_axis_tvalid.next = ports.s_axis_tvalid.val();
            bank.s_axis_tlast.next = ports.s_axis_tlast.val();
            bank.free.next = ports.free.val();
            bank.reported.next = ports.reported.val();
            // An address beyond a smaller buffer is meant for another one; its data are not used.
            bank.quad_address.next = cut(&ports.quad_address, bank.quad_address.width());
            bank.part.next = cut(&ports.part, bank.part.width());
        }
        let (first, bank) = (&banks[0], &banks[which]);
        ports.s_axis_tready.next = first.s_axis_tready.val();
        ports.accept.next = first.accept.val();
        ports.taken_word.next = first.taken_word.val();
        ports.framing.next = first.framing.val();
        ports.quad.next = bank.quad.val();
        ports.magnitude.next = bank.magnitude.val();
        ports.positive.next = bank.positive.val();
        ports.negative.next = bank.negative.val();
        choose.clk.next = ports.clk.val();
        choose.rst.next = ports.rst.val();
        choose.code.next = ports.s_axis_tdata.val();
        choose.accept.next = first.accept.val();
        choose.tlast.next = ports.s_axis_tlast.val();
        choose.free.next = ports.free.val();
        ports.which.next = choose.which.val();
        ports.full.next = choose.settled.val();
    }

    fn connect(&mut self) {
        let Banks { ports, banks, choose } = self;
        for bank in banks.iter_mut() {
            let bank: &mut ReceivePorts = bank;
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
        choose.clk.connect();
        choose.code.connect();
        for bit in [&mut choose.rst, &mut choose.accept, &mut choose.tlast, &mut choose.free] {
            bit.connect();
        }
        for bit in
            [&mut ports.s_axis_tready, &mut ports.accept, &mut ports.full, &mut ports.positive, &mut ports.negative]
        {
            bit.connect();
        }
        ports.framing.connect();
        for wire in [&mut ports.taken_word, &mut ports.which, &mut ports.quad, &mut ports.magnitude] {
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
