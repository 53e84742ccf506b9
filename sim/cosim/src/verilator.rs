//! A design under Verilator as a [`Device`].
//!
//! ```text
//! Verilog + bench.v + shim.cpp --verilator--> build/verilator/<fingerprint>/libbench.so --> Device
//! memory files ----------------------------------------- read when the device starts ----^
//! ```
//!
//! The cache key is a fingerprint of all Verilog, waiver and shim texts, of Verilator's version and of how much the
//! compiler optimises; memory files are read at start and need no rebuild. Libraries are built in a staging folder and
//! renamed when complete (`artifact_cache`).
#![allow(unsafe_code, reason = "calls the functions of a shared library that Verilator's C++ was compiled into")]

use std::ffi::{c_char, c_void, CString};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use dermis_golden::write::{write, FileError};
use dermis_hdl::device::{Device, Inputs, Outputs, Tap};
use dermis_hdl::verilator::{Runtime, OBJECTS};
use dermis_hdl::Generated;
use libloading::Library;
use thiserror::Error;

use super::bench::{Layout, INSTANCE};
use dermis_flow::artifact_cache::{self, fingerprint};
use dermis_flow::progress::Progress;

/// The product of a built folder.
const LIBRARY: &str = "libbench.so";
/// The C++ side, compiled into every library.
const SHIM: &str = include_str!("../shim/shim.cpp");
/// Its file name.
const SHIM_FILE: &str = "shim.cpp";
/// Addition to [`SHIM`] for libraries whose registers and memories are read or changed.
const STATE: &str = include_str!("../shim/state.cpp");
/// Seed of the random start values of registers without an initial value; these show a missing reset.
const RESET_SEED: i32 = 20_240_501;
/// Argument of the compiler for a shared library.
const SHARED: &str = "-fPIC";
/// Arguments of the linker.
const LINK: [&str; 2] = ["-shared", "-Wl,--wrap=fopen"];
/// Lines of a failed tool's output that an error repeats.
const LOG_LINES: usize = 20;

/// Why a design could not be simulated.
#[derive(Debug, Error)]
pub enum VerilatorError {
    /// Verilator is not installed.
    #[error("verilator is not installed; on Debian: sudo apt-get install verilator g++")]
    Missing,
    /// The compiler of what Verilator writes is not installed.
    #[error("verilator needs g++, which is not installed; on Debian: sudo apt-get install g++")]
    MissingCompiler,
    /// Verilator or the compiler failed.
    #[error("verilator refused {design} (folder {folder}):\n{log}")]
    Build {
        /// Name of the top module.
        design: String,
        /// Folder with the sources.
        folder: PathBuf,
        /// First lines of its output.
        log: String,
    },
    /// A file or folder could not be used.
    #[error(transparent)]
    File(#[from] FileError),
    /// The built library cannot be loaded or does not match its bench.
    #[error("{path}: {reason}")]
    Library {
        /// The library.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

/// A design to compile.
#[derive(Clone, Debug)]
pub struct Design<'a> {
    /// Name of the top module.
    pub top: &'a str,
    /// File names without folder, and their texts: Verilog (`.v`), waivers (`.vlt`), memory files (all others).
    pub files: Vec<(&'a str, &'a str)>,
    /// Taps to observe.
    pub taps: &'a [Tap],
    /// Width of `s_axis_tdata`, 1..=32.
    pub input_bits: u32,
    /// Width of `s_axis_tid` and `m_axis_tid`; 0 of one array, which has neither.
    pub array_bits: usize,
    /// Whether registers and memories can be read and changed; the simulation is slower then.
    pub open_state: bool,
    /// How much the compiler optimises.
    pub optimisation: Optimisation,
}

impl<'a> Design<'a> {
    /// A design without taps, whose pins a bench of its own packs.
    pub fn of_pins(generated: &'a Generated) -> Self {
        Design {
            top: &generated.top,
            files: generated.files.iter().map(|file| (file.name.as_str(), file.text.as_str())).collect(),
            taps: &[],
            input_bits: 1,
            array_bits: 0,
            open_state: false,
            optimisation: Optimisation::On,
        }
    }
}

/// How much the compiler optimises a simulation. For the engine of an 8×8 array, [`Optimisation::Off`] takes half the
/// time to compile, 3 s instead of 7 s, and some 9 µs more for each cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optimisation {
    /// For a simulation of few cycles; a library with [`Optimisation::On`] is taken if the cache has one.
    Off,
    /// For a simulation of many cycles.
    On,
}

impl Optimisation {
    /// Number of cycles from which the time that optimised code saves is longer than its compilation.
    const CYCLES: u64 = 400_000;

    /// What suits a simulation of so many cycles.
    pub fn of_cycles(cycles: u64) -> Optimisation {
        if cycles < Optimisation::CYCLES {
            Optimisation::Off
        } else {
            Optimisation::On
        }
    }

    /// Argument of the compiler.
    fn argument(self) -> &'static str {
        match self {
            Optimisation::Off => "-O0",
            Optimisation::On => "-O1",
        }
    }
}

/// `dermis_words` of the shim: model, scope, signal, bytes of a word, bytes of all words; null if there is no such signal.
type FindWords = unsafe extern "C" fn(*mut c_void, *const c_char, *const c_char, *mut u64, *mut u64) -> *mut u8;

/// Where the words of a register or memory lie in a running model.
#[derive(Clone, Copy)]
struct Words {
    first: *mut u8,
    word_bytes: usize,
    bytes: usize,
}

/// A register or memory that [`Verilated::find`] found.
#[derive(Clone, Copy, Debug)]
pub struct Found(usize);

/// A running verilated design, with its pins packed into two vectors.
pub(crate) struct VerilatedBench {
    handle: *mut c_void,
    cycle: unsafe extern "C" fn(*mut c_void, u64, *mut u32),
    free: unsafe extern "C" fn(*mut c_void),
    find_words: Option<FindWords>,
    found: Vec<Words>,
    words: Vec<u32>,
    /// Keeps the code of the function pointers loaded; dropped after `drop` has freed the model.
    _library: Library,
}

// SAFETY: nothing else has the handle, and the library keeps no state of a running model outside it.
unsafe impl Send for VerilatedBench {}

impl VerilatedBench {
    /// Builds the design with its `bench` (Verilog text), or takes it from `cache`, and starts it. `words` is the
    /// length of the bench's vector `out` in 32-bit words.
    pub(crate) fn new(design: &Design, bench: &str, words: usize, cache: &Path) -> Result<Self, VerilatorError> {
        let path = library(design, bench, cache)?;
        let fail = |reason: String| VerilatorError::Library { path: path.clone(), reason };
        // SAFETY: the library was built by this user from this module's shim (`artifact_cache`), whose symbols have these types and
        // whose constructors have no side effects; the layout is checked before the first cycle.
        unsafe {
            let library = Library::new(&path).map_err(|e| fail(e.to_string()))?;
            let symbol = |e: libloading::Error| fail(e.to_string());
            let bytes = *library.get::<extern "C" fn() -> u32>(b"dermis_out_bytes").map_err(symbol)?;
            let start =
                *library.get::<extern "C" fn(*const c_char, i32) -> *mut c_void>(b"dermis_new").map_err(symbol)?;
            let cycle = *library.get(b"dermis_cycle").map_err(symbol)?;
            let free = *library.get(b"dermis_free").map_err(symbol)?;
            let find_words =
                if design.open_state { Some(*library.get(b"dermis_words").map_err(symbol)?) } else { None };
            if bytes() as usize != 4 * words {
                return Err(fail(format!("{} output bytes, {} expected", bytes(), 4 * words)));
            }
            let memories = memory_folder(design)?;
            let folder = CString::new(memories.path().to_string_lossy().as_bytes()).map_err(|e| fail(e.to_string()))?;
            let handle = start(folder.as_ptr(), RESET_SEED);
            Ok(VerilatedBench {
                handle,
                cycle,
                free,
                find_words,
                found: Vec::new(),
                words: vec![0; words],
                _library: library,
            })
        }
    }

    /// One clock cycle: `in` applied, `out` sampled before the rising edge.
    pub(crate) fn cycle(&mut self, inputs: u64) -> &[u32] {
        // SAFETY: `handle` lives until drop, `words` has the length checked in `new`.
        unsafe { (self.cycle)(self.handle, inputs, self.words.as_mut_ptr()) };
        &self.words
    }
}

impl VerilatedBench {
    /// Finds a register or memory; `None` if there is no such signal.
    fn find(&mut self, scope: &str, signal: &str) -> Option<Found> {
        let [scope, signal] = [CString::new(scope).ok()?, CString::new(signal).ok()?];
        let (mut word_bytes, mut bytes) = (0, 0);
        // SAFETY: `handle` lives until drop; the library checks the names.
        let first = unsafe {
            (self.find_words?)(self.handle, scope.as_ptr(), signal.as_ptr(), &raw mut word_bytes, &raw mut bytes)
        };
        if first.is_null() {
            return None;
        }
        self.found.push(Words { first, word_bytes: word_bytes as usize, bytes: bytes as usize });
        Some(Found(self.found.len() - 1))
    }

    /// The bytes of what was found, and those of a word.
    fn words(&mut self, Found(index): Found) -> (&mut [u8], usize) {
        let Words { first, word_bytes, bytes } = self.found[index];
        // SAFETY: memory of the model, which lives until drop, and which nothing else uses while `self` is borrowed.
        (unsafe { std::slice::from_raw_parts_mut(first, bytes) }, word_bytes)
    }
}

impl Drop for VerilatedBench {
    fn drop(&mut self) {
        // SAFETY: the only call, with the handle that `dermis_new` returned.
        unsafe { (self.free)(self.handle) };
    }
}

/// A running verilated engine.
pub struct Verilated {
    layout: Layout,
    bench: VerilatedBench,
}

impl Verilated {
    /// Builds `design`, or takes it from `cache` (usually `build/verilator`), and starts it.
    ///
    /// # Errors
    /// [`VerilatorError`]: no Verilator, a design it refuses, or files that cannot be written.
    pub fn new(design: &Design, cache: &Path) -> Result<Self, VerilatorError> {
        let layout = Layout::new(design.input_bits, design.array_bits, design.taps);
        let bench = VerilatedBench::new(design, &layout.verilog(design.top), layout.out_words(), cache)?;
        Ok(Verilated { layout, bench })
    }

    /// Finds a register or memory; `None` if there is no such signal or the design has no `open_state`. `scope` is the
    /// instance path from the design's top, separated by dots.
    pub fn find(&mut self, scope: &str, signal: &str) -> Option<Found> {
        // The shim also names its model "bench".
        let path = format!("bench.{INSTANCE}{}{scope}", if scope.is_empty() { "" } else { "." });
        self.bench.find(&path, signal)
    }

    /// The words that this device found as bytes, each word with its least significant byte first.
    ///
    /// # Panics
    /// If another device found it.
    pub fn bytes(&mut self, found: Found) -> &[u8] {
        self.bench.words(found).0
    }

    /// Flips a bit of a word before the next cycle; false if there is no such bit.
    ///
    /// # Panics
    /// If another device found it.
    pub fn flip(&mut self, found: Found, word: usize, bit: usize) -> bool {
        let (bytes, word_bytes) = self.bench.words(found);
        let byte = bytes.chunks_mut(word_bytes).nth(word).and_then(|word| word.get_mut(bit / 8));
        byte.map(|byte| *byte ^= 1 << (bit % 8)).is_some()
    }
}

impl Device for Verilated {
    fn cycle(&mut self, inputs: &Inputs) -> Outputs {
        self.layout.unpack(self.bench.cycle(self.layout.pack(inputs)))
    }
}

/// First line of `verilator --version`, asked once: a device that is in the cache starts faster than Verilator answers.
///
/// # Errors
/// [`VerilatorError::Missing`]: Verilator cannot be started.
pub fn version() -> Result<&'static str, VerilatorError> {
    static VERSION: OnceLock<String> = OnceLock::new();
    if let Some(version) = VERSION.get() {
        return Ok(version);
    }
    let output = Command::new("verilator").arg("--version").output().map_err(|_| VerilatorError::Missing)?;
    let version = String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_owned();
    Ok(VERSION.get_or_init(|| version))
}

/// Writes the design's memory files into a temporary folder, from which the shim lets `$readmemh` read them.
fn memory_folder(design: &Design) -> Result<tempfile::TempDir, VerilatorError> {
    let folder = tempfile::tempdir().map_err(FileError::at(&std::env::temp_dir()))?;
    for (name, text) in design.files.iter().filter(|(name, _)| !is_source(name)) {
        write(&folder.path().join(name), text.as_bytes())?;
    }
    Ok(folder)
}

/// Whether Verilator compiles the file; all others are read at run time.
fn is_source(name: &str) -> bool {
    name.ends_with(".v") || name.ends_with(".vlt")
}

/// Path of the design's library, built when the cache does not hold it.
fn library(design: &Design, bench: &str, cache: &Path) -> Result<PathBuf, VerilatorError> {
    let mut sources: Vec<(&str, &str)> = design.files.iter().filter(|(name, _)| is_source(name)).copied().collect();
    // Waivers come first: Verilator applies them only to files read afterwards.
    sources.sort_by_key(|(name, _)| !name.ends_with(".vlt"));
    let shim = if design.open_state { [SHIM, STATE].concat() } else { SHIM.to_owned() };
    sources.extend([("bench.v", bench), (SHIM_FILE, &shim)]);
    let version = version()?;
    let folder = |level: Optimisation| cache.join(fingerprint(&sources, &format!("{version} {}", level.argument())));
    let optimised = folder(Optimisation::On);
    let level = if artifact_cache::is_intact(&optimised, LIBRARY) { Optimisation::On } else { design.optimisation };
    let folder = folder(level);
    let design = &Design { optimisation: level, ..design.clone() };
    let ready = folder.join(LIBRARY);
    let _lock = artifact_cache::lock(&folder)?;
    if !artifact_cache::is_intact(&folder, LIBRARY) {
        build(design, &sources, &folder, cache)?;
    }
    Ok(ready.canonicalize().map_err(FileError::at(&ready))?)
}

/// Builds the library and publishes it as `folder`.
fn build(design: &Design, sources: &[(&str, &str)], folder: &Path, cache: &Path) -> Result<(), VerilatorError> {
    let work = artifact_cache::staging_folder(folder)?;
    for (name, text) in sources {
        write(&work.path().join(name), text.as_bytes())?;
    }
    let _progress = Progress::start(&format!("verilating {}", design.top));
    if let Err(log) = compile(design, sources, work.path(), cache) {
        if Command::new("g++").arg("--version").output().is_err() {
            return Err(VerilatorError::MissingCompiler);
        }
        let log: Vec<&str> = log.lines().take(LOG_LINES).collect();
        // Kept, so that the user can inspect the folder named in the error.
        return Err(VerilatorError::Build { design: design.top.into(), folder: work.keep(), log: log.join("\n") });
    }
    // Deletes the C++ files, which are larger than library and sources.
    let objects = work.path().join(OBJECTS);
    fs::remove_dir_all(&objects).map_err(FileError::at(&objects))?;
    Ok(artifact_cache::publish(work, folder, LIBRARY)?)
}

/// Translates the Verilog of `sources` in the folder `work`, and compiles that; the output of what failed, if anything.
fn compile(design: &Design, sources: &[(&str, &str)], work: &Path, cache: &Path) -> Result<(), String> {
    let verilog = sources.iter().map(|(name, _)| *name).filter(|name| is_source(name));
    let mut verilator = Command::new("verilator");
    verilator.current_dir(work).args(["--top-module", "bench", "--cc", "--prefix", "Vbench", "-O3"]);
    verilator.args(["--x-initial", "unique", "--x-assign", "unique"]);
    if design.open_state {
        verilator.arg("--public-flat-rw");
    }
    succeed(verilator.args(verilog))?;
    // In a fresh folder with a random name: no other process can put an object file there that is linked into the library.
    let own = cache.join(fingerprint(&[], "runtime"));
    let runtime = Runtime::new(&[design.optimisation.argument(), SHARED], &own).map_err(|error| error.to_string())?;
    succeed(runtime.compile(work, &[SHIM_FILE], LIBRARY).map_err(|error| error.to_string())?.args(LINK))
}

/// Runs a program to its end; what it wrote if it failed.
fn succeed(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| format!("{:?}: {error}", command.get_program()))?;
    let log = || String::from_utf8_lossy(&[output.stderr, output.stdout].concat()).into_owned();
    output.status.success().then_some(()).ok_or_else(log)
}
