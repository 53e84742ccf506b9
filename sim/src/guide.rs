//! Guide: pages for people who use Dermis or extend it.
//!
//! | page | for |
//! |---|---|
//! | [`method`] | what is computed, and why it is the paper's Eq. 1 |
//! | [`formats`] | widths and scales of the hardware's words |
//! | [`architecture`] | stages, data flow, where a stage's three forms live |
//! | [`sensor`] | adding a sensor |
//! | [`board`] | adding a board |
//! | [`design`] | using the generated engine in one's own design |
//! | [`limits`] | what noise does to shear, and why |

#[doc = include_str!("../guide/method.md")]
pub mod method {}
#[doc = include_str!("../guide/formats.md")]
pub mod formats {}
#[doc = include_str!("../guide/architecture.md")]
pub mod architecture {}
#[doc = include_str!("../guide/sensor.md")]
pub mod sensor {}
#[doc = include_str!("../guide/board.md")]
pub mod board {}
#[doc = include_str!("../guide/design.md")]
pub mod design {}
#[doc = include_str!("../guide/limits.md")]
pub mod limits {}
