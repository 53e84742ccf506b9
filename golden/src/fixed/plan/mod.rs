//! The plan of a scene's hardware: what is known from scene and board, before a frame arrives.
//!
//! ```text
//! scene ── matrices ── widths ── fit ── storage, resources ── contents ── cycles
//! board ───────────────┴─────────┘                    cases: which, and again for each set tried
//! ```
//!
//! | module | content |
//! |---|---|
//! | [`widths`] | widths and scales from the norms of the matrices |
//! | [`specimens`] | the specimens for which widths and scales are made, where coefficients are written |
//! | [`storage`] | the coefficient memory: which columns are kept, in which order |
//! | [`resources`] | memories and multipliers, as the synthesiser counts them |
//! | [`serial`] | what the serial engine has in place of lanes: memories, words, cycles |
//! | [`fit`] | number of lanes, and the memories with it |
//! | [`contents`] | the plan itself, and what it has for each case |
//! | [`cases`] | which partition cases share the hardware |
//! | [`cycles`] | duration of a frame |
//! | [`timeline`] | when the products are issued, and when their rows leave |
//! | [`contact_cycles`] | the part of it that depends on the contacts |
//! | [`interval`] | cycles from one frame to the next |
//! | [`program`] | the instructions of the passes |
//! | [`check`] | the signature of the coefficient memory |
//! | [`feature_costs`] | the plan with each optional feature added, or without it |
//! | [`fit_suggestions`] | changes that make a scene fit its board |

pub mod cases;
pub mod check;
pub mod contact_cycles;
pub mod contents;
pub mod cycles;
pub mod feature_costs;
pub mod fit;
pub mod fit_suggestions;
pub mod interval;
pub mod program;
pub mod resources;
pub mod serial;
pub mod specimens;
pub mod storage;
pub mod timeline;
pub mod widths;
