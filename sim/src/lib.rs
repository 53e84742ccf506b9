//! Dermis.
#![deny(missing_docs)]
