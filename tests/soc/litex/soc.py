"""A SoC for LiteX's simulation: a VexRiscv, its memories, and a core between two DMA channels.

usage: soc.py CORE_FOLDER OUT_FOLDER

Compiles the firmware, simulates the SoC until the firmware ends, and prints what the firmware printed.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import litex
from litex.build.generic_platform import Pins, Subsignal
from litex.build.io import CRG
from litex.build.sim import SimPlatform
from litex.build.sim.config import SimConfig
from litex.build.sim.platform import SimFinish
from litex.soc.integration import export
from litex.soc.integration.common import get_mem_data
from litex.soc.integration.soc_core import SoCCore

from dermis_litex import add_dermis

CLOCK_HZ = 50_000_000
FIRMWARE = Path(__file__).parent / "firmware"
PADS = [
    ("sys_clk", 0, Pins(1)),
    (
        "serial",
        0,
        Subsignal("source_valid", Pins(1)),
        Subsignal("source_ready", Pins(1)),
        Subsignal("source_data", Pins(8)),
        Subsignal("sink_valid", Pins(1)),
        Subsignal("sink_ready", Pins(1)),
        Subsignal("sink_data", Pins(8)),
    ),
]


class Soc(SoCCore):
    def __init__(self, core):
        platform = SimPlatform("SIM", PADS)
        self.crg = CRG(platform.request("sys_clk"))
        super().__init__(
            platform,
            CLOCK_HZ,
            cpu_type="vexriscv",
            cpu_variant="standard",
            uart_name="sim",
            integrated_rom_size=0x8000,
            integrated_sram_size=0x8000,
            ident="",
        )
        self.sim_finish = SimFinish()
        add_dermis(self, core)


def write_headers(soc, core, folder):
    """Addresses and registers of the SoC, its memories for the linker, and the codes of the core's testbench."""
    codes = next(core.glob("*_tb_codes.hex")).read_text().split()
    files = {
        "generated/csr.h": export.get_csr_header(soc.csr_regions, soc.constants, soc.mem_regions["csr"].origin),
        "generated/mem.h": export.get_mem_header(soc.mem_regions),
        "generated/soc.h": export.get_soc_header(soc.constants),
        "regions.ld": export.get_linker_regions(soc.mem_regions),
        "codes.h": f"#define TAXELS {len(codes)}\nstatic const uint32_t codes[TAXELS] = {{ "
        + ", ".join(f"0x{code}" for code in codes)
        + " };\n",
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def compile_firmware(soc, core, folder):
    """The firmware as the words of the ROM."""
    package = Path(litex.__file__).parent
    includes = [folder, core, package / "soc/software/include", package / "soc/cores/cpu/vexriscv"]
    elf, image = folder / "firmware.elf", folder / "firmware.bin"
    options = ["-Os", "-Wall", "-Wextra", "-Werror", "-ffreestanding", "-nostdlib", "-Wl,--no-warn-rwx-segments"]
    subprocess.run(
        ["riscv64-unknown-elf-gcc", *soc.cpu.gcc_flags.split(), *options]
        + [f"-I{include}" for include in includes]
        + [f"-L{folder}", f"-T{FIRMWARE / 'link.ld'}", FIRMWARE / "start.S", FIRMWARE / "main.c", "-lgcc", "-o", elf],
        check=True,
    )
    subprocess.run(["riscv64-unknown-elf-objcopy", "-O", "binary", elf, image], check=True)
    return get_mem_data(str(image), data_width=32, endianness=soc.cpu.endianness)


def main():
    core, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    soc = Soc(core)
    # The firmware needs the addresses, the ROM the firmware: LiteX's builder would want the sources of its BIOS.
    soc.finalize()
    write_headers(soc, core, out)
    soc.init_rom("rom", compile_firmware(soc, core, out), auto_size=False)
    for index, (source, language, library, *copy) in enumerate(soc.platform.sources):
        if copy and copy[0]:
            shutil.copy(source, out)
            soc.platform.sources[index] = (Path(source).name, language, library)
    simulation = SimConfig()
    simulation.add_clocker("sys_clk", freq_hz=CLOCK_HZ)
    simulation.add_module("serial2console", "serial")
    soc.build(build_dir=str(out), sim_config=simulation, interactive=False, verbose=False, opt_level="O1")


if __name__ == "__main__":
    main()
