"""Generates a core for each bus and width of the output stream, and runs core.py on it under Icarus."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from cocotb_tools.check_results import get_results
from cocotb_tools.runner import get_runner
from systemrdl import RDLCompiler
from systemrdl.node import FieldNode

HERE = Path(__file__).resolve().parent
DERMIS = os.environ.get("DERMIS", "dermis")
# Tests that run side by side each have a folder of their own.
BUILD = Path(os.environ.get("DERMIS_BUILD", HERE.parent.parent / "build/soc")) / os.environ.get("PYTEST_XDIST_WORKER", "")
SCENE = HERE / "press.toml"
# Of core.py.
TESTS = 10
NIGHTLY = pytest.mark.skipif("DERMIS_NIGHTLY" not in os.environ, reason="minutes; make nightly runs it")


def generate(folder, *arguments, scene=SCENE):
    command = [DERMIS, "build", str(scene), "--out", str(folder), *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


@pytest.fixture(scope="session")
def vectors():
    """Codes and beats of the engine's testbench: the path without the ending."""
    generate(BUILD / "engine")
    return BUILD / "engine/dermis_press_tb"


def run(simulator, folder, top, sources, module, environment, build_args=()):
    """Runs the tests of `module` on `top` with the memory files of `folder`; how many there are, and how many failed."""
    work = folder / "sim"
    runner = get_runner(simulator)
    build = {"build_dir": work, "build_args": build_args, "always": True, "timescale": ("1ns", "1ps")}
    runner.build(sources=sources, hdl_toplevel=top, **build)
    for memory in folder.glob("*.hex"):
        (work / memory.name).write_bytes(memory.read_bytes())
    results = work / "results.xml"
    try:
        runner.test(
            hdl_toplevel=top,
            test_module=module,
            build_dir=work,
            test_dir=work,
            extra_env={"DERMIS_CORE": str(folder), "PYTHONPATH": str(HERE), **environment},
            results_xml=str(results),
        )
    except SystemExit:
        # A test failed; an absent file of results is an error below.
        pass
    return get_results(results)


def icarus(folder, top, sources, module, environment):
    """As `run`, under Icarus."""
    return run("icarus", folder, top, sources, module, environment)


def environment(bus, bits, vectors):
    """What core.py reads."""
    return {"DERMIS_BUS": bus, "DERMIS_WORDS": str(bits // 32), "DERMIS_VECTORS": str(vectors)}


def simulate(folder, bus, bits, vectors, change=lambda text: text):
    """Runs core.py on a core whose Verilog `change` has changed; the number of its tests, and of those that failed."""
    generate(folder, "--bus", bus, "--stream-bits", str(bits))
    top = f"dermis_press_{bus}"
    verilog = folder / f"{top}.v"
    verilog.write_text(change(verilog.read_text(encoding="utf-8")), encoding="utf-8")
    return icarus(folder, top, [verilog], "core", environment(bus, bits, vectors))


@pytest.mark.parametrize(
    "bus, bits", [("axi", 64), ("wishbone", 32), *(pytest.param("axi", bits, marks=NIGHTLY) for bits in [32, 128])]
)
def test_core(vectors, bus, bits):
    assert simulate(BUILD / f"{bus}-{bits}", bus, bits, vectors) == (TESTS, 0)


@pytest.mark.parametrize(
    "name, right, wrong",
    [
        ("identifier", "assign m_axis_tid = own_label[3:0];", "assign m_axis_tid = 4'd0;"),
        # Until version 3 of the map: the output is reset too.
        ("reset", "assign stream_out__rst = rst;", "assign stream_out__rst = restart__q;"),
        ("place", "wire words_part_1 = left == 3'd1;", "wire words_part_1 = left == 3'd0;"),
        pytest.param("error", "error_framing <= 1'b0;", "error_framing <= 1'b1;", marks=NIGHTLY),
    ],
)
def test_a_defect_is_found(vectors, name, right, wrong):
    def change(text):
        assert text.count(right) == 1, right
        return text.replace(right, wrong)

    tests, failed = simulate(BUILD / f"defect-{name}", "axi", 64, vectors, change)
    assert tests == TESTS and failed > 0


def test_the_map_in_systemrdl_is_that_in_json():
    folder = BUILD / "map"
    generate(folder, "--bus", "axi")
    compiler = RDLCompiler()
    compiler.compile_file(folder / "registers.rdl")
    top = compiler.elaborate().top
    read = {
        register.inst_name: (
            register.absolute_address,
            {own.inst_name: (own.lsb, own.width) for own in register.children() if isinstance(own, FieldNode)},
        )
        for register in top.registers()
    }
    registers = json.loads((folder / "registers.json").read_text(encoding="utf-8"))["registers"]
    fields = lambda own: {field["name"]: (field["low"], field["bits"]) for field in own["fields"]} or {"value": (0, 32)}
    assert read == {own["name"]: (own["address"], fields(own)) for own in registers}
