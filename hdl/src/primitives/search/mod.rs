//! The search of μ1, μ2: polynomials in memory, candidates, scores, the best of them.

pub(crate) mod best_candidate;
pub(crate) mod candidates;
pub(crate) mod polynomial_word;
pub(crate) mod score;
pub(crate) mod score_bias;
pub(crate) mod search_sequencer;
pub(crate) mod store;
pub(crate) mod sum;
pub(crate) mod sweep;
pub(crate) mod taylor;
