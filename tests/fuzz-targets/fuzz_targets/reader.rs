//! The reader of `DERMIS_READER`, a name of `dermis_tests::readers::TARGETS`, for libFuzzer.
#![no_main]

use std::sync::LazyLock;

use dermis_tests::readers::{named, Target};
use libfuzzer_sys::fuzz_target;

static READER: LazyLock<Target> =
    LazyLock::new(|| named(&std::env::var("DERMIS_READER").expect("DERMIS_READER is a folder of tests/corpus")));

fuzz_target!(|bytes: &[u8]| {
    READER(bytes);
});
