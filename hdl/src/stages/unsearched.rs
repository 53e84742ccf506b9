//! Stage `search` in a scene without a search: μ is 0 or that of a network, and the values are p.
//!
//! What `unfold` delivers is p itself, with a network after each step of `relax`; the last passes on directly as values;
//! `start` says that all have arrived. Since the force memory is written while the passes run, a frame is not computed
//! before the previous one has been sent.

use super::search::SearchPorts;
use crate::language::{Builder, Inside};

impl<'k> SearchPorts<Inside<'k>> {
    /// The `fill_quad`s of the last of `vectors` vectors leave as `values` in the same cycle; `settled`, `values_begin` and `done`
    /// are `start` one cycle later. The inputs that only a search needs are unused; the outputs that describe its result are
    /// constant 0.
    pub(super) fn unsearched(self, k: &'k Builder, vectors: usize) {
        let io = self;
        io.values.set(io.fill_quad);
        io.values_valid.set(if vectors > 1 { io.fill & io.fill_index.is(vectors as u64 - 1) } else { io.fill });
        let began = k.delay("began", io.start & !io.rst);
        for output in [io.settled, io.values_begin, io.done] {
            output.set(began);
        }
        let words = [io.best_x, io.best_y, io.score];
        for output in words.into_iter().chain([io.found, io.compared, io.taken, io.stalled]) {
            output.set(k.constant(output.bits(), 0));
        }
    }
}

#[cfg(test)]
mod tests {
    use dermis_golden::fixed::Model;
    use dermis_golden::spec::scene::Scene;

    use super::super::Search;
    use crate::language::testbench::{check, random_words, subject_of, Reference};
    use crate::wire::Word;

    /// `start` of the cycle before, outside a reset; undefined before the first edge.
    struct Passed {
        began: Option<bool>,
    }

    impl Reference for Passed {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let began = self.began.map(Word::from);
            let result = [Some(Word::default()); 7];
            [&[Some(inputs[2]), Some(inputs[3]), began, began, began][..], &result].concat()
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.began = Some(inputs[1].number() == 1 && inputs[0].number() == 0);
        }
    }

    #[test]
    fn coefficients_pass_on_as_values() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        scene.search.mu_max = 0.0;
        let model = Model::new(&scene).unwrap();
        let subject = subject_of!(
            Search::new(&model),
            &[],
            inputs [rst, start, fill_quad, fill, which, fill_which, fill_index, fill_address, enabled, ready],
            outputs [
                values, values_valid, settled, values_begin, done, best_x, best_y, score, found, compared, taken,
                stalled
            ],
        );
        let widths: Vec<usize> = subject.inputs.iter().map(|(_, bits)| *bits).collect();
        check(subject, &random_words(1000, &widths), &mut Passed { began: None });
    }
}
