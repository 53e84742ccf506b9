//! Bits of a word of a status.

use dermis_golden::result::flags::StatusField;

use crate::language::{Builder, Expr};

/// The lowest `count` bits of a word, the highest first: each of `fields`, which have one bit, at its place, 0
/// elsewhere.
pub(crate) fn status_bits<'k>(k: &'k Builder, fields: &[(StatusField, Expr<'k>)], count: u32) -> Vec<Expr<'k>> {
    let at = |bit: u32| fields.iter().find(|(field, _)| field.low == bit).map_or(k.constant(1, 0), |(_, value)| *value);
    (0..count).rev().map(at).collect()
}
