//! Layout of polynomials in a word: coefficient by coefficient, each for all lanes.

use dermis_golden::fixed::stages::search::Polynomial;

use crate::language::{concat, Expr};
use crate::wire::Word;

/// Layout of `lanes` polynomials in one word: coefficient k of lane l is `widths[k]` bits at `offset(k) + l·widths[k]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PolynomialWord {
    /// Number of polynomials in the word.
    pub lanes: usize,
    /// Width of each coefficient in bits, signed.
    pub widths: Vec<usize>,
}

impl PolynomialWord {
    /// Layout of `lanes` polynomials with coefficients of `widths` bits.
    pub fn new(lanes: usize, widths: &[u32]) -> Self {
        PolynomialWord { lanes, widths: widths.iter().map(|&w| w as usize).collect() }
    }

    /// Bit offset of coefficient `k` of lane 0.
    pub fn offset(&self, k: usize) -> usize {
        self.widths[..k].iter().sum::<usize>() * self.lanes
    }

    /// Width of the whole word.
    pub fn bits(&self) -> usize {
        self.offset(self.widths.len())
    }

    /// The polynomial of `lane` in `word`; coefficients beyond the degree are 0.
    pub fn get(&self, word: &Word, lane: usize) -> Polynomial {
        std::array::from_fn(|k| match self.widths.get(k) {
            Some(&bits) => {
                let raw = word.field(self.offset(k) + lane * bits, bits);
                (raw << (64 - bits)) as i64 >> (64 - bits)
            }
            None => 0,
        })
    }

    /// Writes the polynomial of `lane` into `word`.
    pub fn put(&self, word: &mut Word, lane: usize, polynomial: &Polynomial) {
        for (k, &bits) in self.widths.iter().enumerate() {
            word.set(self.offset(k) + lane * bits, bits, polynomial[k] as u64);
        }
    }

    /// Coefficient `k` of `lane` in `word`, signed.
    pub fn coefficient<'k>(&self, word: Expr<'k>, k: usize, lane: usize) -> Expr<'k> {
        word.slice(self.offset(k) + lane * self.widths[k], self.widths[k]).signed()
    }

    /// The word of `polynomials`, one list of coefficients per lane.
    pub fn join<'k>(&self, polynomials: &[Vec<Expr<'k>>]) -> Expr<'k> {
        let each = (0..self.widths.len()).flat_map(|k| polynomials.iter().map(move |polynomial| polynomial[k]));
        concat(&each.rev().collect::<Vec<_>>())
    }

    /// Verilog part select of coefficient `k` of lane `lane` (an expression) in `word`.
    pub fn select(&self, word: &str, k: usize, lane: &str) -> String {
        format!("{word}[{} + {lane} * {} +: {}]", self.offset(k), self.widths[k], self.widths[k])
    }
}
