//! Wishbone in front of the registers.

use super::bundles::{Accesses, WishbonePins};
use crate::block;
use crate::language::{concat, Block, Builder, Inside, Type};

block! {
    /// Classic single accesses of Wishbone B4 with addresses of words; the answer comes one cycle later, `wb_err` in
    /// the place of `wb_ack` where the access is refused.
    #[derive(Default)]
    pub struct Wishbone {}
    ports WishbonePorts {
        clock;
        reset;
        /// The bus.
        sink<WishbonePins> wb: WishbonePins { there: true };
        /// Accesses that it makes.
        source<Accesses> access: Accesses {};
    }
}

impl Block for Wishbone {
    fn build<'k>(&self, k: &'k Builder, io: WishbonePorts<Inside<'k>>) {
        let asked = k.state("asked", Type::unsigned(1), io.rst, 0).comment("An access was made in the last cycle.");
        let wanted = k.wire("wanted", io.wb.cyc & io.wb.stb);
        let select = io.access.select.set(wanted & !*asked);
        asked.set(select);
        io.access.write.set(io.wb.we);
        io.access.address.set(concat(&[io.wb.adr, k.constant(2, 0)]));
        io.access.data.set(io.wb.dat_w);
        io.access.strobe.set(io.wb.sel);
        io.wb.dat_r.set(io.access.content);
        // A master that gives up is not answered.
        io.wb.ack.set(*asked & wanted & !io.access.refused);
        io.wb.err.set(*asked & wanted & io.access.refused);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;
    use dermis_golden::wire::registers::{ADDRESS_BITS, REGISTER_BITS};

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
        check(&kernel_of(&Wishbone::default()), &stimulus, &mut Answering(None));
    }
}
