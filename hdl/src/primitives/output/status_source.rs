//! What `forces` stores of a subarray or a contact, from the stage that found its μ.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::primitives::address::case_counter::largest;
use crate::primitives::address::counter::count_bits;
use crate::primitives::search::sweep::position_bits;
use crate::wire::Wire;

/// From the search, from the network, or from `contacts`; combinational.
#[derive(dermis_hdl_derive::Block)]
pub struct StatusSource {
    /// The result of a subarray is there.
    pub settled: Signal<In, Bit>,
    /// Index of the subarray; valid with `settled`, as what follows.
    pub subarray: Wire<In>,
    /// The subarray meets the scene's condition.
    pub searched: Signal<In, Bit>,
    /// Position of μ1 that the search found, signed.
    pub best_x: Wire<In>,
    /// Position of μ2 that the search found, signed.
    pub best_y: Wire<In>,
    /// Score of the search.
    pub best_score: Wire<In>,
    /// The search found a candidate.
    pub candidate: Signal<In, Bit>,
    /// Position of μ1 that the network gives, signed.
    pub mu_x: Wire<In>,
    /// Position of μ2 that the network gives, signed.
    pub mu_y: Wire<In>,
    /// Word of both ln σ.
    pub ln_sigma: Wire<In>,
    /// `contacts` tells the status of a label.
    pub told: Signal<In, Bit>,
    /// The label; valid with `told`, as what follows.
    pub told_label: Wire<In>,
    /// Position of its μ1, signed.
    pub told_x: Wire<In>,
    /// Position of its μ2, signed.
    pub told_y: Wire<In>,
    /// Its word of both ln σ.
    pub told_ln_sigma: Wire<In>,
    /// It meets the scene's condition.
    pub told_condition: Signal<In, Bit>,
    /// What follows is to be stored.
    pub start: Signal<Out, Bit>,
    /// Index of the subarray, or the label.
    pub part: Wire<Out>,
    /// Position of μ1, signed.
    pub position_x: Wire<Out>,
    /// Position of μ2, signed.
    pub position_y: Wire<Out>,
    /// Score, or word of both ln σ.
    pub score: Wire<Out>,
    /// There is a μ.
    pub found: Signal<Out, Bit>,
    /// The scene's condition is met.
    pub condition: Signal<Out, Bit>,
    kernel: Body,
}

kernel_block!(
    StatusSource,
    inputs [
        settled, subarray, searched, best_x, best_y, best_score, candidate, mu_x, mu_y, ln_sigma, told, told_label, told_x,
        told_y, told_ln_sigma, told_condition
    ],
    outputs [start, part, position_x, position_y, score, found, condition]
);

/// What gives μ.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gives {
    Search,
    Network,
    Contacts,
}

#[derive(Clone, Copy, Debug)]
struct Shape {
    gives: Gives,
    subarrays: usize,
    contacts: usize,
    score_bits: usize,
}

impl StatusSource {
    /// For what gives μ in `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let counts: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        StatusSource::of(Shape {
            gives: match (formats.has_network(), formats.by_contact()) {
                (_, true) => Gives::Contacts,
                (true, false) => Gives::Network,
                (false, false) => Gives::Search,
            },
            subarrays: largest(&counts),
            contacts: model.contacts(),
            score_bits: formats.score_bits as usize,
        })
    }

    fn of(shape: Shape) -> Self {
        let position = || Wire::new(position_bits());
        let block = StatusSource {
            settled: Default::default(),
            subarray: Wire::new(count_bits(shape.subarrays)),
            searched: Default::default(),
            best_x: Wire::new(position_bits()),
            best_y: Wire::new(position_bits()),
            best_score: Wire::new(shape.score_bits),
            candidate: Default::default(),
            mu_x: Wire::new(position_bits()),
            mu_y: Wire::new(position_bits()),
            ln_sigma: Wire::new(shape.score_bits),
            told: Default::default(),
            told_label: Wire::new(count_bits(shape.contacts + 1)),
            told_x: Wire::new(position_bits()),
            told_y: Wire::new(position_bits()),
            told_ln_sigma: Wire::new(shape.score_bits),
            told_condition: Default::default(),
            start: Default::default(),
            part: Wire::new(shape.part_bits()),
            position_x: position(),
            position_y: position(),
            score: Wire::new(shape.score_bits),
            found: Default::default(),
            condition: Default::default(),
            kernel: Body::default(),
        };
        block.bind(shape.kernel())
    }
}

impl Shape {
    fn part_bits(self) -> usize {
        match self.gives {
            Gives::Contacts => count_bits(self.contacts + 1),
            Gives::Search | Gives::Network => count_bits(self.subarrays),
        }
    }

    fn kernel(self) -> Kernel {
        let k = Builder::combinational("status_source");
        let (settled, subarray) = (k.input("settled", 1), k.input("subarray", count_bits(self.subarrays)));
        let searched = k.input("searched", 1);
        let pair = |names: [&str; 2]| names.map(|name| k.input(name, position_bits()));
        let (best, score) = (pair(["best_x", "best_y"]), k.input("best_score", self.score_bits));
        let candidate = k.input("candidate", 1);
        let (mu, ln_sigma) = (pair(["mu_x", "mu_y"]), k.input("ln_sigma", self.score_bits));
        let (told, label) = (k.input("told", 1), k.input("told_label", count_bits(self.contacts + 1)));
        let (told_mu, told_ln_sigma) = (pair(["told_x", "told_y"]), k.input("told_ln_sigma", self.score_bits));
        let told_condition = k.input("told_condition", 1);
        let (start, part, [x, y], score, found, condition) = match self.gives {
            Gives::Search => (settled, subarray, best, score, candidate, searched),
            Gives::Network => (settled, subarray, mu, ln_sigma, searched, searched),
            Gives::Contacts => (told, label, told_mu, told_ln_sigma, told_condition, told_condition),
        };
        for (name, value) in [
            ("start", start),
            ("part", part),
            ("position_x", x),
            ("position_y", y),
            ("score", score),
            ("found", found),
            ("condition", condition),
        ] {
            k.wire(name, value);
        }
        k.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::testbench::{check, random_words, Pipeline};
    use crate::wire::Word;

    #[test]
    fn what_gives_mu_is_passed_on() {
        for (gives, taken) in [
            (Gives::Search, [0, 1, 3, 4, 5, 6, 2]),
            (Gives::Network, [0, 1, 7, 8, 9, 2, 2]),
            (Gives::Contacts, [10, 11, 12, 13, 14, 15, 15]),
        ] {
            let contacts = if gives == Gives::Contacts { 5 } else { 0 };
            let block = StatusSource::of(Shape { gives, subarrays: 9, contacts, score_bits: 32 });
            let of = move |inputs: &[Word]| taken.map(|input: usize| Some(inputs[input])).into();
            let p = position_bits();
            let widths = [1, 4, 1, p, p, 32, 1, p, p, 32, 1, count_bits(contacts + 1), p, p, 32, 1];
            check(block.kernel.kernel(), &random_words(400, &widths), &mut Pipeline::new(0, 7, of));
        }
    }
}
