//! Counter over the taxels of the array, row by row, with quad address and lane of each.

use dermis_golden::fixed::CasePlan;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::address::counter::count_bits;
use crate::primitives::address::quad_address::Places;
use crate::primitives::{CaseCounter, QuadAddress};

block! {
    /// Visits the taxels of the whole array row-major, across all subarrays, one per `enable`. The outputs are
    /// combinational from the count.
    pub struct Scan {
        places: Places,
    }
    ports ScanPorts {
        clock;
        /// Index of the case; constant from the first taxel to the last.
        in case_index: count_bits(places.cases.len());
        /// Back to the first taxel, with priority over `enable`.
        in clear;
        /// Advances to the next taxel at the clock edge; after the last to the first.
        in enable;
        /// The current taxel is the array's last.
        out last;
        /// `enable`, and the current taxel is the last of a row of subarrays.
        out row_end;
        /// Address of the current taxel's word, over all subarrays; combinational from the count, valid from the first
        /// `clear` on.
        out address: places.address_bits();
        /// Index of the current taxel's subarray; valid with `address`.
        out part: places.part_bits();
        /// Lane of the word the current taxel is read from, 2 bits; valid with `address`.
        out lane: 2;
        /// Lanes the current taxel is written to, one bit each; valid with `address`.
        out mask: 4;
    }
}

impl Scan {
    /// For the subarrays of each of `cases`, with `lanes` lanes in a memory word.
    pub fn new(cases: &[CasePlan], lanes: usize) -> Self {
        Scan { places: Places::new(cases, lanes) }
    }

    /// Width of the address of a word.
    pub fn address_bits(&self) -> usize {
        self.places.address_bits()
    }
}

impl Block for Scan {
    fn build<'k>(&self, k: &'k Builder, io: ScanPorts<Inside<'k>>) {
        let [cols, part_cols, rows, part_rows] = self.places.counts();
        let col = k.instance("col", CaseCounter::new(&cols));
        let part_col = k.instance("part_col", CaseCounter::new(&part_cols));
        let row = k.instance("row", CaseCounter::new(&rows));
        let part_row = k.instance("part_row", CaseCounter::new(&part_rows));
        let quad_address = k.instance("quad_address", QuadAddress::from(self.places.clone()));

        for counter in [&col, &part_col, &row, &part_row] {
            counter.clear.set(io.clear);
            counter.case_index.set(io.case_index);
        }
        quad_address.case_index.set(io.case_index);
        let line_end = k.wire("line_end", io.enable & col.last & part_col.last);
        let row_end = io.row_end.set(line_end & row.last);
        col.enable.set(io.enable);
        part_col.enable.set(io.enable & col.last);
        row.enable.set(line_end);
        part_row.enable.set(row_end);
        io.last.set(col.last & part_col.last & row.last & part_row.last);

        quad_address.row.set(row.value);
        quad_address.col.set(col.value);
        quad_address.part_row.set(part_row.value);
        quad_address.part_col.set(part_col.value);
        io.address.set(quad_address.address);
        io.part.set(quad_address.part);
        io.lane.set(quad_address.lane);
        io.mask.set(quad_address.mask);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check_with_defects, subject_of, Reference};
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
            let [case_index, clear, enable] = [0, 1, 2].map(|input| inputs[input].number() as usize);
            let count = taxels(&self.cases[case_index]);
            self.passed = if clear == 1 { Some(0) } else { self.passed.map(|taxel| (taxel + enable) % count) };
        }
    }

    #[test]
    fn taxels_come_row_major_with_the_places_of_their_subarray() {
        let model = model(10, 14, "[partition]\ncases = [0, 1, 2, 3]\n");
        for lanes in [4, 1] {
            let mut random = fastrand::Rng::with_seed(lanes as u64);
            let (mut case_index, mut left) = (0, 1);
            let mut cycle = || {
                left -= 1;
                // Another case after a `clear`; every second time after the array was passed more than once.
                let inputs = [case_index, u64::from(left == 0), u64::from(random.u8(..8) > 0)];
                if left == 0 {
                    (case_index, left) = (random.u64(..model.cases().len() as u64), random.usize(1..400));
                }
                inputs.map(Word::from).into()
            };
            let stimulus: Vec<Vec<Word>> = (0..4000).map(|_| cycle()).collect();
            let subject = |changes: &[Change]| {
                subject_of!(
                    Scan::new(model.cases(), lanes),
                    changes,
                    inputs [case_index, clear, enable],
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
