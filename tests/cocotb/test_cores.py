"""Generates a core for each bus and width of the output stream, and runs core.py on it under Icarus."""

import os
import subprocess
from pathlib import Path

import pytest
from cocotb_tools.check_results import get_results
from cocotb_tools.runner import get_runner

HERE = Path(__file__).resolve().parent
DERMIS = os.environ.get("DERMIS", "dermis")
BUILD = Path(os.environ.get("DERMIS_BUILD", HERE.parent.parent / "build/cocotb"))
SCENE = HERE / "press.toml"


def generate(folder, *arguments):
    command = [DERMIS, "build", str(SCENE), "--out", str(folder), *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


@pytest.fixture(scope="session")
def vectors():
    """Codes and beats of the engine's testbench: the path without the ending."""
    generate(BUILD / "engine")
    return BUILD / "engine/dermis_press_tb"


@pytest.mark.parametrize("bus, bits", [("axi", 32), ("axi", 64), ("axi", 128), ("wishbone", 32)])
def test_core(vectors, bus, bits):
    folder = BUILD / f"{bus}-{bits}"
    generate(folder, "--bus", bus, "--stream-bits", str(bits))
    top = f"dermis_press_{bus}"
    runner = get_runner("icarus")
    runner.build(
        sources=[folder / f"{top}.v"], hdl_toplevel=top, build_dir=folder / "sim", always=True, timescale=("1ns", "1ps")
    )
    for memory in folder.glob("*.hex"):
        (folder / "sim" / memory.name).write_bytes(memory.read_bytes())
    environment = {
        "DERMIS_CORE": str(folder),
        "DERMIS_BUS": bus,
        "DERMIS_WORDS": str(bits // 32),
        "DERMIS_VECTORS": str(vectors),
        "PYTHONPATH": str(HERE),
    }
    results = runner.test(
        hdl_toplevel=top, test_module="core", build_dir=folder / "sim", test_dir=folder / "sim", extra_env=environment
    )
    tests, failed = get_results(results)
    assert failed == 0 and tests >= 8
