//! What a test leaves out unless `make nightly` runs it; the tests of `hdl` have this file, too.

/// Whether `make nightly`, which sets `DERMIS_NIGHTLY`, runs the test.
pub fn nightly() -> bool {
    std::env::var_os("DERMIS_NIGHTLY").is_some()
}

/// The variants that a test takes: all of them in `make nightly`, else the first `few`.
pub fn variants<T>(all: &[T], few: usize) -> &[T] {
    match nightly() {
        true => all,
        false => &all[..few.min(all.len())],
    }
}
