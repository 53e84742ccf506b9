"""Builds the examples of hdl/examples around a generated core: linted by Verilator, run under Icarus."""

import json
import subprocess

import pytest
from test_cores import BUILD, HERE, NIGHTLY, environment, generate, icarus

EXAMPLES = HERE.parent.parent / "hdl/examples"
TOP = "dermis_press_axi"


def run(name, bits, change=lambda text: text):
    """Runs NAME.py on example NAME, changed by `change`; the number of its tests, and of those that failed."""
    folder = BUILD / "examples" / name
    generate(folder, "--bus", "axi", "--stream-bits", str(bits))
    generate(folder / "engine")
    example = folder / f"{name}.v"
    example.write_text(change((EXAMPLES / f"{name}.v").read_text(encoding="utf-8")), encoding="utf-8")
    lint = ["verilator", "--lint-only", "-Wall", "-Wno-DECLFILENAME", "-Wno-PINCONNECTEMPTY", "-Wno-UNUSED", "--top-module", name]
    subprocess.run([*lint, f"{TOP}.vlt", example.name, f"{TOP}.v"], check=True, cwd=folder)
    sizes = [len((folder / f"{TOP}_tb_{kind}.hex").read_text().splitlines()) for kind in ["codes", "words"]]
    own = {"DERMIS_SIZES": json.dumps(sizes), **environment("axi", bits, folder / "engine/dermis_press_tb")}
    return icarus(folder, name, [example, folder / f"{TOP}.v"], name, own)


@pytest.mark.parametrize("name, bits, tests", [("bare", 128, 1), ("dma", 32, 2)])
def test_example(name, bits, tests):
    assert run(name, bits) == (tests, 0)


@pytest.mark.parametrize(
    "name, bits, right, wrong",
    [
        ("bare", 128, "(first + lane) % 3 == 2", "(first + lane) % 3 == 1"),
        ("dma", 32, "read_at    <= read_at + 4 * MOST", "read_at    <= read_at + 4 * MOST + 4"),
        pytest.param("dma", 32, "write_at    <= write_at + 4 * MOST", "write_at    <= write_at + 3 * MOST", marks=NIGHTLY),
    ],
)
def test_a_wrong_example_is_found(name, bits, right, wrong):
    def change(text):
        assert right in text
        return text.replace(right, wrong)

    assert run(name, bits, change)[1] > 0
