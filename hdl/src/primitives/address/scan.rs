//! Counter over the taxels of the array, row by row, with quad address and lane of each.

use dermis_golden::fixed::CasePlan;
use rust_hdl::prelude::*;

use crate::language::RustHdl;
use crate::primitives::address::counter::count_bits;
use crate::primitives::{CaseCounter, QuadAddress};
use crate::wire::Wire;

/// Visits the taxels of the whole array row-major, across all subarrays, one per `enable`. The outputs are
/// combinational from the count.
#[derive(dermis_hdl_derive::Block)]
pub struct Scan {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Index of the case; constant from the first taxel to the last.
    pub which: Wire<In>,
    /// Back to the first taxel, with priority over `enable`.
    pub clear: Signal<In, Bit>,
    /// Advances to the next taxel at the clock edge; after the last to the first.
    pub enable: Signal<In, Bit>,
    /// The current taxel is the array's last.
    pub last: Signal<Out, Bit>,
    /// `enable`, and the current taxel is the last of a row of subarrays.
    pub row_end: Signal<Out, Bit>,
    /// Address of the current taxel's word, over all subarrays; combinational from the count, valid from the first
    /// `clear` on.
    pub address: Wire<Out>,
    /// Index of the current taxel's subarray; valid with `address`.
    pub part: Wire<Out>,
    /// Lane of the word the current taxel is read from, 2 bits; valid with `address`.
    pub lane: Wire<Out>,
    /// Lanes the current taxel is written to, one bit each; valid with `address`.
    pub mask: Wire<Out>,
    col: RustHdl<CaseCounter>,
    part_col: RustHdl<CaseCounter>,
    row: RustHdl<CaseCounter>,
    part_row: RustHdl<CaseCounter>,
    quad_address: QuadAddress,
    line_end: Signal<Local, Bit>,
}

impl Scan {
    /// For the subarrays of each of `cases`, with `lanes` lanes in a memory word.
    pub fn new(cases: &[CasePlan], lanes: usize) -> Self {
        let each = |of: &dyn Fn(&CasePlan) -> usize| CaseCounter::new(&cases.iter().map(of).collect::<Vec<_>>());
        let quad_address = QuadAddress::new(cases, lanes);
        Scan {
            clk: Default::default(),
            which: Wire::new(count_bits(cases.len())),
            clear: Default::default(),
            enable: Default::default(),
            last: Default::default(),
            row_end: Default::default(),
            address: Wire::new(quad_address.address.width()),
            part: Wire::new(quad_address.part.width()),
            lane: Wire::new(2),
            mask: Wire::new(4),
            col: RustHdl::new(each(&|case| case.layout().cols)),
            part_col: RustHdl::new(each(&|case| case.grid().cols)),
            row: RustHdl::new(each(&|case| case.layout().rows)),
            part_row: RustHdl::new(each(&|case| case.grid().rows)),
            quad_address,
            line_end: Default::default(),
        }
    }
}

impl Logic for Scan {
    #[hdl_gen]
    fn update(&mut self) {
        self.col.clk.next = self.clk.val();
        self.part_col.clk.next = self.clk.val();
        self.row.clk.next = self.clk.val();
        self.part_row.clk.next = self.clk.val();
        self.col.clear.next = self.clear.val();
        self.part_col.clear.next = self.clear.val();
        self.row.clear.next = self.clear.val();
        self.part_row.clear.next = self.clear.val();

        self.col.which.next = self.which.val();
        self.part_col.which.next = self.which.val();
        self.row.which.next = self.which.val();
        self.part_row.which.next = self.which.val();
        self.quad_address.which.next = self.which.val();
        self.line_end.next = self.enable.val() & self.col.last.val() & self.part_col.last.val();
        self.row_end.next = self.line_end.val() & self.row.last.val();
        self.col.enable.next = self.enable.val();
        self.part_col.enable.next = self.enable.val() & self.col.last.val();
        self.row.enable.next = self.line_end.val();
        self.part_row.enable.next = self.row_end.val();
        self.last.next =
            self.col.last.val() & self.part_col.last.val() & self.row.last.val() & self.part_row.last.val();

        self.quad_address.row.next = self.row.value.val();
        self.quad_address.col.next = self.col.value.val();
        self.quad_address.part_row.next = self.part_row.value.val();
        self.quad_address.part_col.next = self.part_col.value.val();
        self.address.next = self.quad_address.address.val();
        self.part.next = self.quad_address.part.val();
        self.lane.next = self.quad_address.lane.val();
        self.mask.next = self.quad_address.mask.val();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{block_subject, check_with_defects, Reference};
    use crate::language::Change;
    use crate::scenes::{model, Place};
    use crate::wire::Word;

    fn taxels(case: &CasePlan) -> usize {
        case.parts.len() * case.layout().rows * case.layout().cols
    }

    /// The number of taxels passed; undefined before the first `clear`. Inputs: the case, clear, enable.
    struct Taxels<'a> {
        cases: &'a [CasePlan],
        lanes: usize,
        passed: Option<usize>,
    }

    impl Reference for Taxels<'_> {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let Some(taxel) = self.passed else { return vec![None; 6] };
            let case = &self.cases[inputs[0].number() as usize];
            let place = Place::of(case, taxel);
            let (address, lane) = place.word(self.lanes);
            let last = usize::from(taxel + 1 == taxels(case));
            let row = case.layout().rows * case.layout().cols * case.grid().cols;
            let row_end = usize::from(inputs[2].number() == 1 && (taxel + 1) % row == 0);
            let values = [last, row_end, address, place.part, lane, usize::from(place.mask)];
            values.map(|value| Some(Word::from(value as u64))).into()
        }

        fn clock(&mut self, inputs: &[Word]) {
            let [which, clear, enable] = [0, 1, 2].map(|input| inputs[input].number() as usize);
            let count = taxels(&self.cases[which]);
            self.passed = if clear == 1 { Some(0) } else { self.passed.map(|taxel| (taxel + enable) % count) };
        }
    }

    #[test]
    fn taxels_come_row_major_with_the_places_of_their_subarray() {
        let model = model(10, 14, "[partition]\ncases = [0, 1, 2, 3]\n");
        for lanes in [4, 1] {
            let mut random = fastrand::Rng::with_seed(lanes as u64);
            let (mut which, mut left) = (0, 1);
            let mut cycle = || {
                left -= 1;
                // Another case after a `clear`; every second time after the array was passed more than once.
                let inputs = [which, u64::from(left == 0), u64::from(random.u8(..8) > 0)];
                if left == 0 {
                    (which, left) = (random.u64(..model.cases().len() as u64), random.usize(1..400));
                }
                inputs.map(Word::from).into()
            };
            let stimulus: Vec<Vec<Word>> = (0..4000).map(|_| cycle()).collect();
            let subject = |changes: &[Change]| {
                block_subject!(
                    Scan::new(model.cases(), lanes),
                    changes,
                    inputs [which, clear, enable],
                    outputs [last, row_end, address, part, lane, mask],
                )
            };
            let defects = [
                Change::value("", "row__enable", |k| k.named("enable") & k.named("col__last")),
                Change::value("", "last", |k| k.named("line_end")),
            ];
            let reference = || Taxels { cases: model.cases(), lanes, passed: None };
            check_with_defects(subject, &stimulus, reference, &defects);
        }
    }
}
