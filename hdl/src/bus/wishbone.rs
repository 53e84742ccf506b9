//! Wishbone in front of the registers.

use dermis_golden::wire::registers::{ADDRESS_BITS, REGISTER_BITS};
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{concat, Body, Builder, Kernel, Type};
use crate::wire::Wire;

/// Classic single accesses of Wishbone B4 with addresses of words; the answer comes one cycle later, `wb_err` in the place of
/// `wb_ack` where the access is refused.
#[derive(dermis_hdl_derive::Block)]
pub struct Wishbone {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A cycle of the bus.
    pub wb_cyc: Signal<In, Bit>,
    /// An access, held with all that belongs to it until the answer; valid with `wb_cyc`.
    pub wb_stb: Signal<In, Bit>,
    /// The access is a write; valid with `wb_stb`.
    pub wb_we: Signal<In, Bit>,
    /// Number of the register; valid with `wb_stb`.
    pub wb_adr: Wire<In>,
    /// Data of a write; valid with `wb_stb` and `wb_we`.
    pub wb_dat_w: Wire<In>,
    /// Bytes of a write that count; valid with `wb_stb` and `wb_we`.
    pub wb_sel: Wire<In>,
    /// Content of the register; valid with `wb_ack`.
    pub wb_dat_r: Wire<Out>,
    /// The access is done.
    pub wb_ack: Signal<Out, Bit>,
    /// The access is refused.
    pub wb_err: Signal<Out, Bit>,
    /// An access in this cycle.
    pub select: Signal<Out, Bit>,
    /// The access is a write; valid with `select`.
    pub write: Signal<Out, Bit>,
    /// Address in bytes; valid with `select`.
    pub address: Wire<Out>,
    /// Data of a write; valid with `select` and `write`.
    pub data: Wire<Out>,
    /// Bytes of a write that count; valid with `select` and `write`.
    pub strobe: Wire<Out>,
    /// Content of the register; valid in the cycle after `select`.
    pub content: Wire<In>,
    /// The access is an error; valid in the cycle after `select`.
    pub refused: Signal<In, Bit>,
    kernel: Body,
}

kernel_block!(
    Wishbone,
    clock clk,
    inputs [rst, wb_cyc, wb_stb, wb_we, wb_adr, wb_dat_w, wb_sel, content, refused],
    outputs [wb_dat_r, wb_ack, wb_err, select, write, address, data, strobe]
);

impl Default for Wishbone {
    fn default() -> Self {
        let block = Wishbone {
            clk: Default::default(),
            rst: Default::default(),
            wb_cyc: Default::default(),
            wb_stb: Default::default(),
            wb_we: Default::default(),
            wb_adr: Wire::new(ADDRESS_BITS - 2),
            wb_dat_w: Wire::new(REGISTER_BITS),
            wb_sel: Wire::new(REGISTER_BITS / 8),
            wb_dat_r: Wire::new(REGISTER_BITS),
            wb_ack: Default::default(),
            wb_err: Default::default(),
            select: Default::default(),
            write: Default::default(),
            address: Wire::new(ADDRESS_BITS),
            data: Wire::new(REGISTER_BITS),
            strobe: Wire::new(REGISTER_BITS / 8),
            content: Wire::new(REGISTER_BITS),
            refused: Default::default(),
            kernel: Body::default(),
        };
        block.bind(kernel())
    }
}

fn kernel() -> Kernel {
    let k = Builder::new("wishbone");
    let rst = k.input("rst", 1);
    let (cyc, stb, we) = (k.input("wb_cyc", 1), k.input("wb_stb", 1), k.input("wb_we", 1));
    let adr = k.input("wb_adr", ADDRESS_BITS - 2);
    let (dat_w, sel) = (k.input("wb_dat_w", REGISTER_BITS), k.input("wb_sel", REGISTER_BITS / 8));
    let (content, refused) = (k.input("content", REGISTER_BITS), k.input("refused", 1));
    let asked = k.state("asked", Type::unsigned(1), rst, 0).comment("An access was made in the last cycle.");
    let wanted = k.wire("wanted", cyc & stb);
    let select = k.wire("select", wanted & !*asked);
    asked.set(select);
    k.wire("write", we);
    k.wire("address", concat(&[adr, k.constant(2, 0)]));
    k.wire("data", dat_w);
    k.wire("strobe", sel);
    k.wire("wb_dat_r", content);
    // A master that gives up is not answered.
    k.wire("wb_ack", *asked & wanted & !refused);
    k.wire("wb_err", *asked & wanted & refused);
    k.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    /// Whether an access was made in the last cycle; undefined before the reset.
    struct Answering(Option<bool>);

    impl Reference for Answering {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let [cyc, stb, we, refused] = [1, 2, 3, 8].map(|k| inputs[k].number() == 1);
            let wanted = cyc && stb;
            let bit = |bit: fn(bool, bool, bool) -> bool| self.0.map(|asked| Word::from(bit(asked, wanted, refused)));
            vec![
                bit(|asked, wanted, _| wanted && !asked),
                Some(Word::from(we)),
                Some(Word::from(4 * inputs[4].number())),
                Some(inputs[5]),
                Some(inputs[6]),
                Some(inputs[7]),
                bit(|asked, wanted, refused| asked && wanted && !refused),
                bit(|asked, wanted, refused| asked && wanted && refused),
            ]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [rst, cyc, stb] = [0, 1, 2].map(|k| inputs[k].number() == 1);
            self.0 = if rst { Some(false) } else { self.0.map(|asked| cyc && stb && !asked) };
        }
    }

    #[test]
    fn an_access_is_answered_one_cycle_later() {
        let mut stimulus = random_words(5000, &[1, 1, 1, 1, ADDRESS_BITS - 2, REGISTER_BITS, 4, REGISTER_BITS, 1]);
        stimulus.iter_mut().enumerate().for_each(|(cycle, inputs)| inputs[0] = (cycle % 97 == 0).into());
        check(Wishbone::default().kernel.kernel(), &stimulus, &mut Answering(None));
    }
}
