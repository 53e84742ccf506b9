//! Target: the C of a scene compiled for a Cortex-M and run in QEMU, which counts its instructions.
//!
//! QEMU gives each instruction the same virtual time, which a timer of the board reads: instructions are exact, cycles of a real
//! core are not among them, as they depend on its pipeline, its caches and the wait states of its flash.

use std::fs;
use std::path::Path;

use anyhow::{bail, Result};
use dermis_golden::fixed::{Model, Trace};
use serde::Serialize;

use super::constants::STATUS_WORDS;
use super::{CSource, OUTSIDE};
use crate::tools::{Tool, ToolError};

/// The compiler.
const COMPILER: Tool = Tool { name: "arm-none-eabi-gcc" };
/// The lister of an object's sections.
const SIZE: Tool = Tool { name: "arm-none-eabi-size" };
/// The simulator.
const QEMU: Tool = Tool { name: "qemu-system-arm" };
/// Virtual time of an instruction is 2^ICOUNT_SHIFT ns.
const ICOUNT_SHIFT: u32 = 6;
/// Period of the boards' timer in ns.
const TIMER_NS: u64 = 40;
/// Words that the program prints before those of a result: what was returned, ticks, bytes of stack.
const HEAD_WORDS: usize = 3;
/// Time limit of a tool.
const MINUTES: u32 = 5;

/// Most bytes of coefficients in a board's flash of 4 MB, beside code and readings.
const LARGEST_COEFFICIENTS: usize = 3_500_000;
/// Most bytes of work memory, readings and result in a board's memory of 4 MB, beside the stack.
const LARGEST_MEMORY: usize = 3_500_000;

/// A core.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Core {
    /// Name.
    pub name: &'static str,
    /// Name for the compiler.
    cpu: &'static str,
    /// QEMU's board.
    machine: &'static str,
    /// Clock of a usual part in MHz.
    pub clock_MHz: f64,
    /// Power of that part while it computes, W: lower and upper figure of [`POWER_SOURCE`].
    pub power_W: [f64; 2],
}

/// Where the power of the cores comes from.
pub const POWER_SOURCE: &str =
    "ST DS12110 (STM32H743) and DS8626 (STM32F407), supply current in run mode, rounded outwards";

/// The cores that are measured: of an STM32H7 and an STM32F4.
pub const CORES: [Core; 2] = [
    Core { name: "Cortex-M7", cpu: "cortex-m7", machine: "mps2-an500", clock_MHz: 480.0, power_W: [0.25, 0.8] },
    Core { name: "Cortex-M4", cpu: "cortex-m4", machine: "mps2-an386", clock_MHz: 168.0, power_W: [0.13, 0.3] },
];

/// What a core did with the frames of a source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoreRun {
    /// The core.
    pub core: Core,
    /// Most instructions of a frame.
    pub instructions: u64,
    /// Bytes of code and tables.
    pub flash_bytes: usize,
    /// Most bytes of stack of a call.
    pub stack_bytes: usize,
    /// Words of forces and status of each frame.
    #[serde(skip)]
    pub results: Vec<Vec<u32>>,
}

/// What all cores did with a source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Measured {
    /// The run of each core.
    Runs(Vec<CoreRun>),
    /// Why there is none.
    Not(&'static str),
}

/// Runs a source on all cores, where the tools are installed and a board holds it.
///
/// # Errors
/// A tool that fails; a word that differs from that of the bit-true `model`, which is a defect of this program.
pub fn measure_all(model: &Model, source: &CSource) -> Result<Measured> {
    if source.needs.coefficient_bytes > LARGEST_COEFFICIENTS || source.needs.memory_bytes() > LARGEST_MEMORY {
        return Ok(Measured::Not("it is larger than the memories of the simulated boards, 4 MB each"));
    }
    let expected: Vec<_> = source.readings.iter().map(|readings| expected(model, readings)).collect();
    let mut runs = Vec::new();
    for core in CORES {
        let folder = tempfile::tempdir()?;
        let run = match measure(source, core, folder.path()) {
            Err(ToolError::Missing { .. }) => {
                return Ok(Measured::Not("arm-none-eabi-gcc or qemu-system-arm is not installed"));
            }
            run => run?,
        };
        if run.results != expected {
            bail!("{}: a word differs from the bit-true model's on a {}: a defect of dermis", source.name, core.name);
        }
        runs.push(run);
    }
    Ok(Measured::Runs(runs))
}

/// The words that C gives for a frame: forces, then status, of the bit-true model.
pub fn expected(model: &Model, readings: &[i32]) -> Vec<u32> {
    let Trace { beats, status, .. } = model.run(readings);
    beats.iter().chain(&status).flatten().map(|&word| word as u32).collect()
}

/// Compiles a source for a core in `folder`, which exists, and runs it.
///
/// # Errors
/// A tool that is missing or fails, what it prints.
pub fn measure(source: &CSource, core: Core, folder: &Path) -> std::result::Result<CoreRun, ToolError> {
    for file in source.files.iter().chain(&source.bare_metal()) {
        let path = folder.join(&file.name);
        fs::write(&path, &file.text).map_err(ToolError::io(&path))?;
    }
    let run = |tool: Tool, arguments: &str, log: &str| {
        let arguments: Vec<String> = arguments.split_whitespace().map(str::to_owned).collect();
        tool.run(folder, &arguments, log, MINUTES)?;
        let log = folder.join(log);
        fs::read_to_string(&log).map_err(ToolError::io(&log))
    };
    let (name, Core { cpu, machine, .. }) = (&source.name, core);
    let compile = format!("-std=c99 -O3 -mcpu={cpu} -mthumb -ffreestanding -Wall -Wextra -Wpedantic -Werror");
    run(COMPILER, &format!("{compile} -c -o engine.o {name}.c"), "compile.log")?;
    let size = run(SIZE, "engine.o", "size.log")?;
    let wrong = |reason: &str| ToolError::Output { path: folder.to_owned(), reason: reason.to_owned() };
    let flash_bytes = flash_bytes(&size).ok_or_else(|| wrong("no sizes in size.log"))?;
    let link = format!("{compile} -nostdlib -T bare_metal.ld -o program.elf bare_metal.c engine.o -lgcc");
    run(COMPILER, &link, "link.log")?;
    let simulate = format!(
        "-machine {machine} -display none -monitor none -serial none -semihosting-config enable=on,target=native \
         -icount shift={ICOUNT_SHIFT} -kernel program.elf"
    );
    let printed = run(QEMU, &simulate, "qemu.log")?;
    let words: Option<Vec<u32>> = printed.split_whitespace().map(|word| u32::from_str_radix(word, 16).ok()).collect();
    let words = words.ok_or_else(|| wrong("no words in qemu.log"))?;
    let of_frame = HEAD_WORDS + 3 * source.taxels() + STATUS_WORDS;
    if words.len() != of_frame * source.readings.len() {
        return Err(wrong("not as many words in qemu.log as the frames have"));
    }
    let frames = || words.chunks(of_frame);
    if frames().any(|frame| frame[0] == OUTSIDE) {
        return Err(wrong("qemu.log: a frame was refused"));
    }
    let most = |at: usize| frames().map(|frame| u64::from(frame[at])).max().unwrap_or_default();
    Ok(CoreRun {
        core,
        instructions: (most(1) * TIMER_NS) >> ICOUNT_SHIFT,
        flash_bytes,
        stack_bytes: most(2) as usize,
        results: frames().map(|frame| frame[HEAD_WORDS..].to_vec()).collect(),
    })
}

/// Bytes of code and constants in what the lister prints; `None` unless there is nothing in memory.
fn flash_bytes(size: &str) -> Option<usize> {
    let numbers = size.lines().nth(1)?.split_whitespace().take(3).map(|number| number.parse::<usize>().ok());
    match numbers.collect::<Option<Vec<_>>>()?[..] {
        [text, 0, 0] => Some(text),
        _ => None,
    }
}
