//! The stages, plain functions of words: one file each, named as in the hardware description.

pub mod choose;
pub mod estimate;
pub mod fold;
pub mod forces;
pub mod load;
pub mod normalise;
pub mod pass;
pub mod prepare;
pub mod receive;
pub mod relax;
pub mod rescale;
pub mod resultants;
pub mod scan;
pub mod search;
pub mod segment;
pub mod send;
pub mod shear;
pub mod unfold;
pub mod window;
