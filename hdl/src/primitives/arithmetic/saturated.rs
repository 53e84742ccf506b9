//! Saturation of a signed word.

use crate::language::{Builder, Expr};

/// A signed number saturated to `bits` bits, unsigned, and whether that changed it.
pub fn saturated<'k>(k: &'k Builder, value: Expr<'k>, bits: usize) -> (Expr<'k>, Expr<'k>) {
    if value.bits() <= bits {
        return (value.signed().extend(bits).unsigned(), k.constant(1, 0));
    }
    let above = value.slice(bits - 1, value.bits() - bits + 1);
    let clips = above.any() & !above.all();
    let sign = value.top();
    (clips.mux(sign.concat((!sign).repeat(bits - 1)), value.low(bits).unsigned()), clips)
}
