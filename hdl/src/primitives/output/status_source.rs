//! What `forces` stores of a subarray or a contact, from the stage that found its μ.

use dermis_golden::fixed::Model;

use crate::block;
use crate::language::{Block, Builder, Inside};
use crate::primitives::address::case_counter::largest;
use crate::primitives::address::counter::count_bits;
use crate::primitives::search::sweep::position_bits;

block! {
    /// From the search, from the network, or from `contacts`; combinational.
    pub struct StatusSource {
        gives: Gives,
        subarrays: usize,
        contacts: usize,
        score_bits: usize,
    }
    ports StatusSourcePorts {
        /// The result of a subarray is there.
        in settled;
        /// Index of the subarray; valid with `settled`, as what follows.
        in subarray: count_bits(*subarrays);
        /// The subarray meets the scene's condition.
        in searched;
        /// Position of μ1 that the search found, signed.
        in best_x: position_bits();
        /// Position of μ2 that the search found, signed.
        in best_y: position_bits();
        /// Score of the search.
        in best_score: score_bits;
        /// The search found a candidate.
        in candidate;
        /// Position of μ1 that the network gives, signed.
        in mu_x: position_bits();
        /// Position of μ2 that the network gives, signed.
        in mu_y: position_bits();
        /// Word of both ln σ.
        in ln_sigma: score_bits;
        /// `contacts` tells the status of a label.
        in told;
        /// The label; valid with `told`, as what follows.
        in told_label: count_bits(contacts + 1);
        /// Position of its μ1, signed.
        in told_x: position_bits();
        /// Position of its μ2, signed.
        in told_y: position_bits();
        /// Its word of both ln σ.
        in told_ln_sigma: score_bits;
        /// It meets the scene's condition.
        in told_condition;
        /// What follows is to be stored.
        out start;
        /// Index of the subarray, or the label.
        out part: match gives {
            Gives::Contacts => count_bits(contacts + 1),
            Gives::Search | Gives::Network => count_bits(*subarrays),
        };
        /// Position of μ1, signed.
        out position_x: position_bits();
        /// Position of μ2, signed.
        out position_y: position_bits();
        /// Score, or word of both ln σ.
        out score: score_bits;
        /// There is a μ.
        out found;
        /// The scene's condition is met.
        out condition;
    }
}

/// What gives μ.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gives {
    Search,
    Network,
    Contacts,
}

impl StatusSource {
    /// For what gives μ in `model`.
    pub fn new(model: &Model) -> Self {
        let formats = model.formats();
        let counts: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        StatusSource {
            gives: match (formats.has_network(), formats.by_contact()) {
                (_, true) => Gives::Contacts,
                (true, false) => Gives::Network,
                (false, false) => Gives::Search,
            },
            subarrays: largest(&counts),
            contacts: model.contacts(),
            score_bits: formats.score_bits as usize,
        }
    }
}

impl Block for StatusSource {
    fn build<'k>(&self, _: &'k Builder, io: StatusSourcePorts<Inside<'k>>) {
        let (start, part, [x, y], score, found, condition) = match self.gives {
            Gives::Search => {
                (io.settled, io.subarray, [io.best_x, io.best_y], io.best_score, io.candidate, io.searched)
            }
            Gives::Network => (io.settled, io.subarray, [io.mu_x, io.mu_y], io.ln_sigma, io.searched, io.searched),
            Gives::Contacts => {
                let position = [io.told_x, io.told_y];
                (io.told, io.told_label, position, io.told_ln_sigma, io.told_condition, io.told_condition)
            }
        };
        io.start.set(start);
        io.part.set(part);
        io.position_x.set(x);
        io.position_y.set(y);
        io.score.set(score);
        io.found.set(found);
        io.condition.set(condition);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
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
            let block = StatusSource { gives, subarrays: 9, contacts, score_bits: 32 };
            let of = move |inputs: &[Word]| taken.map(|input: usize| Some(inputs[input])).into();
            let p = position_bits();
            let widths = [1, 4, 1, p, p, 32, 1, p, p, 32, 1, count_bits(contacts + 1), p, p, 32, 1];
            check(&kernel_of(&block), &random_words(400, &widths), &mut Pipeline::new(0, 7, of));
        }
    }
}
