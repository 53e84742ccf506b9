//! The search against the bit-true model's, sweep by sweep, with waits and resets.

use std::collections::BTreeMap;

use dermis_golden::fixed::plan::cycles::split_latency;
use dermis_golden::fixed::stages::search::{search, Best, Block, Polynomial, SearchResult, COARSE_CENTRES};
use dermis_golden::fixed::words::formats::HALVINGS;

use super::*;
use crate::language::testbench::{check_with_defects, subject_of, Reference};
use crate::language::Change;
use crate::scenes::model;
use crate::wire::Word;

/// Cycles from the set-up of a sweep to its comparison, beyond its steps: memory 3, Taylor shift 4, candidates 2, score
/// 7, comparison 6.
const COMPARED: usize = 22;
/// Cycles from the set-up of the last sweep to its first values.
const VALUES: usize = 8;

/// The last sweep of a search.
#[derive(Clone, Copy, Debug)]
enum Last {
    /// It is set up after the first cycle from this one on in which values may be output.
    Due(usize),
    /// It was set up in this cycle.
    SetUp(usize),
}

/// Inputs: reset, case, case that is written, a coefficient of four taxels, whether there is one, its index, its quad,
/// start, whether the subarray is searched, whether values may be output.
struct Searching<'a> {
    model: &'a Model,
    cycle: usize,
    reset: bool,
    case: usize,
    polynomials: Vec<[Polynomial; 4]>,
    result: Option<SearchResult>,
    last: Option<Last>,
    /// The best candidate after a sweep, by the cycle in which it has been compared.
    compared: BTreeMap<usize, Best>,
}

impl<'a> Searching<'a> {
    fn new(model: &'a Model) -> Self {
        Searching {
            model,
            cycle: 0,
            reset: false,
            case: 0,
            polynomials: vec![[[0; 10]; 4]; model.formats().quads],
            result: None,
            last: None,
            compared: BTreeMap::new(),
        }
    }

    /// Steps of a sweep.
    fn steps(&self) -> usize {
        self.model.formats().sweep_steps(self.model.cases()[self.case].formats.quads)
    }

    /// Starts a search in the present cycle.
    fn start(&mut self, enabled: bool) {
        let (formats, layout) = (self.model.formats(), self.model.cases()[self.case].layout());
        let start = Block::new(layout, self.polynomials[..layout.len()].to_vec());
        let result = search(layout, start, enabled);
        let mut set_up = self.cycle + SET_UP as usize;
        let duration = self.steps().max(SHORTEST_SWEEP as usize) + COMPARED + split_latency(formats) as usize;
        for (sweep, best) in result.sweeps.iter().enumerate() {
            self.compared.insert(set_up + duration, *best);
            set_up += match sweep + 1 < COARSE_CENTRES.len() {
                true => coarse_period(formats, layout.len()) as usize,
                false => duration + SET_UP as usize,
            };
        }
        assert_eq!(result.sweeps.len(), if enabled { COARSE_CENTRES.len() + HALVINGS as usize } else { 0 });
        (self.result, self.last) = (Some(result), Some(Last::Due(set_up - 1)));
    }

    /// The last sweep could be set up in this cycle.
    fn waits(&self) -> bool {
        matches!(self.last, Some(Last::Due(due)) if due <= self.cycle)
    }

    /// Cycles since the set-up of the last sweep.
    fn since_last(&self) -> Option<usize> {
        match self.last? {
            Last::Due(_) => None,
            Last::SetUp(cycle) => Some(self.cycle - cycle),
        }
    }
}

impl Reference for Searching<'_> {
    fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
        let formats = self.model.formats();
        let (first, steps) = (VALUES + split_latency(formats) as usize, self.steps());
        let bit = |bit: bool| self.reset.then(|| Word::from(bit));
        let at = |cycles: usize| self.since_last() == Some(cycles);
        let step = self.since_last().and_then(|cycles| cycles.checked_sub(first)).filter(|&step| step < steps);
        let values = step.zip(self.result.as_ref()).map(|(step, result)| {
            let (width, all) = (formats.search_width, result.values.concat());
            Word::of_fields(&all[step * width..][..width], formats.search_bits[0] as usize)
        });
        let result = self.result.as_ref().filter(|_| at(1));
        let compared = self.compared.get(&self.cycle);
        let position = result.map(|result| result.position).or(compared.map(|best| best.position));
        let score = match result {
            Some(result) => result.score,
            None => compared.filter(|best| best.taken).map(|best| best.score),
        };
        let coordinate = |axis: usize| position.map(|at| Word::of_fields(&[at[axis].into()], position_bits()));
        vec![
            bit(self.waits() && inputs[9].number() == 0),
            values,
            bit(values.is_some()),
            bit(at(1)),
            bit(at(first + values_delay(self.model.first()))),
            bit(at(first + steps)),
            coordinate(0),
            coordinate(1),
            score.map(|score| Word::of_fields(&[score], formats.score_bits as usize)),
            result.map(|result| result.score.is_some().into()),
            bit(compared.is_some()),
            compared.map(|best| best.taken.into()),
        ]
    }

    fn clock(&mut self, inputs: &[Word]) {
        let [rst, case_index, _, _, fill, index, address, start, enabled, ready] =
            [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|input| inputs[input].number() as usize);
        if fill == 1 {
            let bits = self.model.formats().vector_bits as usize + 2;
            let quad = &mut self.polynomials[address];
            quad.iter_mut().enumerate().for_each(|(lane, taxel)| taxel[index] = inputs[3].signed(lane, bits));
        }
        if start == 1 {
            self.case = case_index;
            self.start(enabled == 1);
        } else if self.waits() && ready == 1 {
            self.last = Some(Last::SetUp(self.cycle + 1));
        }
        self.cycle += 1;
        if rst == 1 {
            (self.reset, self.result, self.last) = (true, None, None);
            self.compared.clear();
        }
    }
}

/// Subarrays: their polynomials are written, then searched; some are cut by a reset.
fn stimulus(model: &Model, subarrays: usize) -> Vec<Vec<Word>> {
    let formats = model.formats();
    let mut random = fastrand::Rng::with_seed(17);
    let mut searching = Searching::new(model);
    let mut all: Vec<Vec<Word>> = Vec::new();
    for subarray in 0..subarrays {
        let case = random.usize(..model.cases().len());
        let quads = model.cases()[case].formats.quads;
        let words = [(); 2].map(|()| Word::from(case as u64));
        // Reset, coefficient with index and address, start, searched.
        let mut cycle = |rst: bool, coefficient: Option<(Word, usize, usize)>, start: bool, searched: bool| {
            let (quad, index, address) = coefficient.unwrap_or_default();
            let number = |number: usize| Word::from(number as u64);
            let fill = [quad, coefficient.is_some().into(), number(index), number(address)];
            let flags = [start, searched, random.u8(..6) == 0].map(Word::from);
            let inputs = [&[rst.into()], &words[..], &fill, &flags].concat();
            searching.clock(&inputs);
            all.push(inputs);
            searching.since_last()
        };
        if subarray == 0 || subarray % 5 == 4 {
            cycle(true, None, false, false);
        }
        let mut values = fastrand::Rng::with_seed(subarray as u64);
        for index in 0..formats.vectors() {
            // A quarter of the range, so that no coefficient overflows wherever the centre is moved.
            let most = 1 << (formats.search_bits[index] - 3);
            for address in 0..quads {
                let taxels = [(); 4].map(|()| values.i64(-most..most));
                let taxels = Word::of_fields(&taxels, formats.vector_bits as usize + 2);
                cycle(false, Some((taxels, index, address)), false, false);
            }
            for _ in 0..values.usize(..9) {
                cycle(false, None, false, false);
            }
        }
        for _ in 0..8 {
            cycle(false, None, false, false);
        }
        cycle(false, None, true, subarray % 4 != 2);
        let end = if subarray % 5 == 3 { values.usize(..500) } else { usize::MAX };
        let steps = formats.sweep_steps(quads);
        let mut cycles = 0;
        while cycles < end && cycle(false, None, false, false).is_none_or(|since| since < steps + 2 * VALUES) {
            cycles += 1;
        }
    }
    all
}

#[test]
fn sweeps_and_values_are_those_of_the_model() {
    let several = model(6, 6, "[search]\nmu_max = 0.1\ndegree = 1\n[partition]\ncases = [0, 1]\n");
    let narrow = model(4, 6, "[search]\nmu_max = 0.1\ndegree = 2\n[hardware]\nsearch_width = 1\n");
    assert_eq!([&several, &narrow].map(|model| model.formats().search_width), [4, 1]);
    for model in [several, narrow] {
        let subject = |changes: &[Change]| {
            subject_of!(
                Search::of_model(&model).unwrap(),
                changes,
                inputs [rst, case_index, fill_case, fill_quad, fill, fill_index, fill_address, start, enabled, ready],
                outputs [
                    stalled, values, values_valid, settled, values_begin, done, best_x, best_y, score, found, compared,
                    taken,
                ],
            )
        };
        let defects = [
            Change::value("", "scores__mask", |k| k.named("fill_mask__mask")),
            Change::value("", "stall", |k| k.constant(1, 0)),
        ];
        let defects = if model.cases().len() == 2 { &defects[..] } else { &[] };
        check_with_defects(subject, &stimulus(&model, 12), || Searching::new(&model), defects);
    }
}
