//! Dermis command line.
fn main() {}
