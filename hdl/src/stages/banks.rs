//! Replacement for stage `receive` where the case is chosen per frame: a frame buffer per case, and the choice of the
//! case.
//!
//! Every buffer receives every code, each in the layout of its own subarrays; reads come from the buffer of the chosen
//! case. All buffers fill and become free together.

use std::collections::BTreeMap;

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::{Choose, Receive, ReceivePorts};
use crate::language::RustHdl;
use crate::language::{Body, Builder, Expr, Kernel, Port, SEPARATOR};
use crate::ports::has_ports;
use crate::primitives::expression_by_case;

/// `full` is high once the case has been chosen too.
///
/// The scene decides how many buffers there are. `kernel_block!` binds the fields that it names, and a loop in `#[hdl_gen]`
/// has a constant number of turns over an array of constant length: neither reaches the ports of a `Vec` of blocks. So
/// `pins` lists them, and `update` and `connect` here do over that list what the macro writes over names.
#[derive(dermis_hdl_derive::Block)]
pub struct Banks {
    ports: ReceivePorts,
    banks: Vec<Receive>,
    choose: RustHdl<Choose>,
    kernel: Body,
}

has_ports!(Banks: ReceivePorts);

/// The block that has a port: this one, a frame buffer, or the choice.
#[derive(Clone, Copy)]
enum Of {
    Own,
    Bank(usize),
    Choose,
}

impl Of {
    /// Name of a port in the kernel.
    fn port(self, port: &str) -> String {
        match self {
            Of::Own => port.to_owned(),
            Of::Bank(number) => ["banks", &number.to_string(), port].join(SEPARATOR),
            Of::Choose => ["choose", port].join(SEPARATOR),
        }
    }
}

/// What the kernel reads.
type Reads<'a> = Vec<(Of, &'static str, &'a dyn Port)>;
/// What the kernel drives.
type Drives<'a> = Vec<(Of, &'static str, &'a mut dyn Port)>;

/// Adds the ports of `$ports` to two lists.
macro_rules! divide {
    ($of:expr, $type:ident, $ports:expr, $reads:ident [$($read:ident),+], $drives:ident [$($drive:ident),+]) => {
        let $type { $($read,)+ $($drive,)+ .. } = $ports;
        $($reads.push(($of, stringify!($read), $read));)+
        $($drives.push(($of, stringify!($drive), $drive));)+
    };
}

impl Banks {
    /// A frame buffer for each case of `model`.
    pub fn new(model: &Model) -> Self {
        let cases = model.cases();
        let mut block = Banks {
            ports: ReceivePorts::new(cases, model.floor_bits()),
            banks: (0..cases.len()).map(|case| Receive::new(model, case)).collect(),
            choose: RustHdl::new(Choose::new(model)),
            kernel: Body::default(),
        };
        let (_, reads, drives) = block.pins();
        let reads: Vec<(String, usize)> =
            reads.iter().map(|(of, name, port)| (of.port(name), port.port_bits())).collect();
        let drives: Vec<(Of, &str, usize)> =
            drives.iter().map(|(of, name, port)| (*of, *name, port.port_bits())).collect();
        let inputs: Vec<(&str, usize)> = reads.iter().map(|(name, bits)| (name.as_str(), *bits)).collect();
        let names: Vec<String> = drives.iter().map(|(of, name, _)| of.port(name)).collect();
        let outputs: Vec<(&str, usize)> =
            names.iter().zip(&drives).map(|(name, (.., bits))| (name.as_str(), *bits)).collect();
        block.kernel = Body::new(kernel(&inputs, &drives, cases.len()), &inputs, &outputs);
        block
    }

    /// The kernel and its pins: the ports of this block, and those of the blocks inside.
    fn pins(&mut self) -> (&mut Body, Reads<'_>, Drives<'_>) {
        let Banks { ports, banks, choose, kernel } = self;
        let (mut reads, mut drives) = (Reads::new(), Drives::new());
        divide!(
            Of::Own, ReceivePorts, ports,
            reads [clk, rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, free, quad_address, part, reported, floor],
            drives [s_axis_tready, accept, taken_word, row_end, dropped, full, which, quad, magnitude, positive, negative, framing]
        );
        for (number, bank) in banks.iter_mut().enumerate() {
            divide!(
                Of::Bank(number), ReceivePorts, &mut **bank,
                reads [s_axis_tready, accept, taken_word, row_end, dropped, full, which, quad, magnitude, positive, negative, framing],
                drives [clk, rst, s_axis_tdata, s_axis_tvalid, s_axis_tlast, free, quad_address, part, reported, floor]
            );
        }
        divide!(
            Of::Choose, Choose, choose, reads [which, settled], drives [clk, rst, code, accept, tlast, free]
        );
        (kernel, reads, drives)
    }
}

impl Logic for Banks {
    fn update(&mut self) {
        let (kernel, reads, mut drives) = self.pins();
        let changed = reads.iter().any(|(.., port)| port.has_new_value());
        kernel.update(
            false,
            changed,
            |set| reads.iter().enumerate().for_each(|(index, (.., port))| set(index, *port)),
            |take| drives.iter_mut().enumerate().for_each(|(index, (.., port))| take(index, *port)),
        );
    }

    fn connect(&mut self) {
        self.pins().2.into_iter().for_each(|(.., port)| port.drive());
    }
}

/// All buffers get what this block gets; its outputs are those of the chosen one.
fn kernel(inputs: &[(&str, usize)], outputs: &[(Of, &str, usize)], cases: usize) -> Kernel {
    let k = Builder::combinational("banks");
    let read: BTreeMap<&str, Expr> = inputs.iter().map(|&(name, bits)| (name, k.input(name, bits))).collect();
    let port = |of: Of, name: &str| read[of.port(name).as_str()];
    for &(of, name, bits) in outputs {
        let value = match (of, name) {
            (Of::Own, "which") => port(Of::Choose, "which"),
            (Of::Own, "full") => port(Of::Choose, "settled"),
            (Of::Own, "quad" | "magnitude" | "positive" | "negative") => {
                let each: Vec<Expr> = (0..cases).map(|number| port(Of::Bank(number), name)).collect();
                expression_by_case(port(Of::Choose, "which"), &each).unwrap_or(each[0])
            }
            // All buffers fill and become free together: the handshake of the first is that of all.
            (Of::Own, _) => port(Of::Bank(0), name),
            (Of::Choose, "code") => port(Of::Own, "s_axis_tdata"),
            (Of::Choose, "tlast") => port(Of::Own, "s_axis_tlast"),
            (Of::Choose, "accept") => port(Of::Bank(0), "accept"),
            // An address beyond a smaller buffer is meant for another one; its data are not used.
            (Of::Bank(_) | Of::Choose, _) => port(Of::Own, name).low(bits),
        };
        k.wire(&of.port(name), value);
    }
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn outputs_are_those_of_the_chosen_bank() {
        let text = "name = \"banks\"\n[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 2.0\npitch_y_mm = 2.0\n\
                    thickness_mm = 2.0\n[partition]\ncases = [0, 1]\n";
        let mut banks = Banks::new(&Model::new(&Scene::parse(text, "banks.toml").unwrap()).unwrap());
        let (_, reads, drives) = banks.pins();
        let widths: Vec<usize> = reads.iter().map(|(.., port)| port.port_bits()).collect();
        let inputs: Vec<String> = reads.iter().map(|(of, name, _)| of.port(name)).collect();
        let outputs: Vec<(String, usize)> =
            drives.iter().map(|(of, name, port)| (of.port(name), port.port_bits())).collect();
        let of = |words: &[Word]| {
            let read = |name: &str| words[inputs.iter().position(|input| input == name).expect(name)];
            let which = read("choose__which").number();
            let source = |output: &str| match output {
                "which" => "choose__which".to_owned(),
                "full" => "choose__settled".to_owned(),
                "quad" | "magnitude" | "positive" | "negative" => format!("banks__{which}__{output}"),
                "choose__code" => "s_axis_tdata".to_owned(),
                "choose__tlast" => "s_axis_tlast".to_owned(),
                "choose__accept" => "banks__0__accept".to_owned(),
                inner if inner.contains("__") => inner.rsplit("__").next().unwrap().to_owned(),
                own => format!("banks__0__{own}"),
            };
            // Only addresses are cut, and they are short.
            let cut = |word: Word, bits: usize| if bits < 64 { Word::from(word.field(0, bits)) } else { word };
            outputs.iter().map(|(output, bits)| Some(cut(read(&source(output)), *bits))).collect()
        };
        check(banks.kernel.kernel(), &random_words(2000, &widths), &mut Pipeline::new(0, outputs.len(), of));
    }
}
