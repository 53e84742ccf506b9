//! Compiles what Verilator has written. All models share its runtime and a precompiled `verilated.h`, which take as long
//! to compile as a small model.
//!
//! Both stand in a cache folder, under a checksum of the compiler's version, its arguments and every file of the
//! runtime, so that another Verilator or compiler makes others. A lock lets one process at a time build them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Arguments of the compiler for every model: none has traces or coverage.
const ARGUMENTS: [&str; 8] = [
    "-std=gnu++17",
    "-DVERILATOR=1",
    "-DVM_COVERAGE=0",
    "-DVM_SC=0",
    "-DVM_TRACE=0",
    "-DVM_TRACE_FST=0",
    "-DVM_TRACE_VCD=0",
    "-pthread",
];
/// Sources of the runtime that a model without traces, coverage and DPI needs.
const SOURCES: [&str; 2] = ["verilated", "verilated_threads"];
/// The header that every generated file includes.
const HEADER: &str = "verilated.h";
/// Folder in which Verilator writes, beside its sources.
pub const OBJECTS: &str = "obj_dir";

/// Verilator's runtime, compiled.
#[derive(Clone, Debug)]
pub struct Runtime {
    arguments: Vec<String>,
    /// Folder with Verilator's headers and sources.
    include: PathBuf,
    /// Folder with the objects and the precompiled header.
    folder: PathBuf,
}

impl Runtime {
    /// The runtime for `arguments` of the compiler besides those of every model, from `cache` or built there.
    ///
    /// # Errors
    /// Verilator or g++ cannot be started or fails, with its output; the cache cannot be written.
    pub fn new(arguments: &[&str], cache: &Path) -> io::Result<Runtime> {
        let root = succeed(Command::new("verilator").args(["--getenv", "VERILATOR_ROOT"]))?;
        let include = Path::new(root.trim()).join("include");
        fs::create_dir_all(cache)?;
        let cache = cache.canonicalize()?;
        let arguments: Vec<String> = ARGUMENTS.iter().chain(arguments).map(|text| (*text).to_owned()).collect();
        let folder = cache.join(format!("runtime-{:08x}", fingerprint(&arguments, &include)?));
        let runtime = Runtime { arguments, include, folder };
        let lock = File::create(cache.join("runtime.lock"))?;
        lock.lock()?;
        if !runtime.folder.exists() {
            // A folder of this name is complete: an interrupted build leaves another one.
            let staging = tempfile::tempdir_in(&cache)?;
            runtime.build(staging.path())?;
            fs::rename(staging.keep(), &runtime.folder)?;
        }
        Ok(runtime)
    }

    /// A command that compiles the C++ files that Verilator has written in `work`, and `more` files of that folder, as one
    /// unit, so that headers are read once, and links them with the runtime to `product`.
    ///
    /// # Errors
    /// The files cannot be listed, the unit cannot be written.
    pub fn compile(&self, work: &Path, more: &[&str], product: &str) -> io::Result<Command> {
        let objects = work.join(OBJECTS);
        let names = fs::read_dir(&objects)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
        let mut names = names.collect::<io::Result<Vec<String>>>()?;
        names.retain(|name| name.ends_with(".cpp"));
        names.sort();
        let all = names.iter().map(String::as_str).chain(more.iter().copied());
        let unit: String = all.map(|name| format!("#include \"{name}\"\n")).collect();
        fs::write(objects.join("unit.cpp"), unit)?;
        let mut compiler = self.compiler();
        compiler.current_dir(work).arg("-include").arg(self.folder.join(HEADER));
        compiler.args(["-I.", "-I", OBJECTS, "-o", product]).arg(Path::new(OBJECTS).join("unit.cpp"));
        compiler.args(SOURCES.map(|name| object(&self.folder, name)));
        Ok(compiler)
    }

    fn compiler(&self) -> Command {
        let mut compiler = Command::new("g++");
        compiler.args(&self.arguments).arg("-I").arg(&self.include).arg("-I").arg(self.include.join("vltstd"));
        compiler
    }

    /// Compiles header and sources into `folder`, at the same time.
    fn build(&self, folder: &Path) -> io::Result<()> {
        let header = folder.join(HEADER);
        fs::copy(self.include.join(HEADER), &header)?;
        let mut commands = vec![self.compiler()];
        commands[0].args(["-x", "c++-header"]).arg(&header).arg("-o").arg(folder.join(format!("{HEADER}.gch")));
        commands.extend(SOURCES.map(|name| {
            let mut compiler = self.compiler();
            compiler.arg("-c").arg(self.include.join(format!("{name}.cpp"))).arg("-o").arg(object(folder, name));
            compiler
        }));
        let start = |command: &mut Command| command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let running = commands.iter_mut().map(start).collect::<io::Result<Vec<_>>>()?;
        for (command, run) in commands.iter().zip(running) {
            checked(command, run.wait_with_output()?)?;
        }
        Ok(())
    }
}

/// The object of a source of the runtime.
fn object(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.o"))
}

/// Runs a program to its end and returns what it wrote.
fn succeed(command: &mut Command) -> io::Result<String> {
    let output = command.output()?;
    checked(command, output)
}

/// What a program wrote; an error with that if it failed.
fn checked(command: &Command, output: std::process::Output) -> io::Result<String> {
    let log = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    match output.status.success() {
        true => Ok(log),
        false => Err(io::Error::other(format!("{command:?}: {log}"))),
    }
}

/// CRC-32 of the compiler's version and arguments and of all files of the runtime.
fn fingerprint(arguments: &[String], include: &Path) -> io::Result<u32> {
    let mut hash = crc32fast::Hasher::new();
    hash.update(succeed(Command::new("g++").arg("--version"))?.as_bytes());
    hash.update(format!("{arguments:?}{}", include.display()).as_bytes());
    let files = fs::read_dir(include)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<PathBuf>>>()?;
    let mut files: Vec<PathBuf> = files.into_iter().filter(|path| path.is_file()).collect();
    files.sort();
    for file in files {
        hash.update(file.file_name().unwrap_or_default().as_encoded_bytes());
        hash.update(&fs::read(file)?);
    }
    Ok(hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_runtime_and_other_arguments_have_another_fingerprint() {
        let folder = tempfile::tempdir().unwrap();
        let mut seen = std::collections::BTreeSet::new();
        for (text, argument) in [("5.006", "-O0"), ("5.007", "-O0"), ("5.006", "-O1")] {
            fs::write(folder.path().join("verilated.cpp"), text).unwrap();
            seen.insert(fingerprint(&[argument.to_owned()], folder.path()).unwrap());
        }
        assert_eq!(seen.len(), 3);
    }
}
