//! The committed header is the one that cbindgen writes; C and C++ take it, beside the header of the packets.

use std::fs;
use std::path::Path;
use std::process::Command;

use cbindgen::{Builder, Config};

/// The folder of the crate.
pub fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The header of the sources, each changed by `change`.
fn header(change: impl Fn(String) -> String) -> String {
    let mut config = Config::from_file(folder().join("cbindgen.toml")).unwrap();
    config.after_includes = Some(format!("\n{}", dermis_golden::result::flags::c_enum()));
    let changed = tempfile::tempdir().unwrap();
    let mut builder = Builder::new().with_config(config);
    // In the order of use.
    for name in ["guard", "scene", "result", "batch", "stress", "stream", "board", "link"] {
        let text = fs::read_to_string(folder().join(format!("src/{name}.rs"))).unwrap();
        let path = changed.path().join(format!("{name}.rs"));
        fs::write(&path, change(text)).unwrap();
        builder = builder.with_src(path);
    }
    let mut bytes = Vec::new();
    builder.generate().unwrap().write(&mut bytes);
    String::from_utf8(bytes).unwrap()
}

#[test]
fn the_committed_header_is_the_generated_one() {
    let (path, fresh) = (folder().join("dermis.h"), header(|text| text));
    if std::env::var_os("DERMIS_ACCEPT").is_some() {
        fs::write(&path, &fresh).unwrap();
    }
    let committed = fs::read_to_string(path).unwrap();
    assert!(committed == fresh, "DERMIS_ACCEPT=1 writes it anew");
    // Another argument is another header.
    assert_ne!(committed, header(|text| text.replace("count: usize", "count: u32")));
}

#[test]
fn c_and_cpp_take_it_beside_the_header_of_the_packets() {
    let own = tempfile::tempdir().unwrap();
    fs::write(own.path().join("dermis_link.h"), dermis_golden::wire::link::c_header()).unwrap();
    let both = own.path().join("both");
    fs::write(&both, "#include \"dermis.h\"\n#include \"dermis_link.h\"\n").unwrap();
    for (compiler, language, standard) in [("cc", "c", "-std=c11"), ("c++", "c++", "-std=c++11")] {
        let mut command = Command::new(compiler);
        command
            .args([standard, "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only", "-x", language])
            .arg(&both);
        command.arg("-I").arg(own.path()).arg("-I").arg(folder());
        let output = command.output().expect("the compiler is installed (make setup)");
        assert!(output.status.success(), "{compiler}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
