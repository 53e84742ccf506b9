"""Tables written through a core's registers: generates the core and the specimen's image, and runs tables.py under Icarus."""

import os
import subprocess

import pytest
from test_cores import BUILD, DERMIS, HERE, NIGHTLY, environment, generate, icarus

VERSION = 7
HARDWARE, SPECIMEN = HERE / "written.toml", HERE / "specimen.toml"


@pytest.fixture(scope="module")
def files():
    """Folders of the engines of the hardware and of a specimen, each with its testbench and its image."""
    folders = [BUILD / "written", BUILD / "specimen"]
    for folder, scene, version in zip(folders, [HARDWARE, SPECIMEN], [1, VERSION]):
        generate(folder, scene=scene)
        command = [DERMIS, "load", HARDWARE, scene, "--tables-version", str(version), "--out", folder / "tables.bin"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folders


def simulate(files, folder, bus, change=lambda text: text):
    written, specimen = files
    generate(folder, "--bus", bus, "--stream-bits", "32", scene=HARDWARE)
    top = f"dermis_written_{bus}"
    verilog = folder / f"{top}.v"
    verilog.write_text(change(verilog.read_text(encoding="utf-8")), encoding="utf-8")
    more = {
        "DERMIS_SPECIMEN": str(specimen / "dermis_specimen_tb"),
        "DERMIS_IMAGE": str(specimen / "tables.bin"),
        "DERMIS_OWN_IMAGE": str(written / "tables.bin"),
        "DERMIS_VERSION": str(VERSION),
    }
    if "DERMIS_NIGHTLY" in os.environ:
        more["DERMIS_CYCLES"] = "200000"
    return icarus(folder, top, [verilog], "tables", environment(bus, 32, written / "dermis_written_tb") | more)


# The bytes take the same way behind both buses.
@pytest.mark.parametrize("bus", ["axi", "wishbone"] if "DERMIS_NIGHTLY" in os.environ else ["axi"])
def test_tables(files, bus):
    assert simulate(files, BUILD / f"written-{bus}", bus) == (4, 0)


@pytest.mark.parametrize(
    "name, right, wrong",
    [
        # A damaged image counts as whole; bytes do not wait for the end of a frame.
        ("crc", "wire wrong_crc = ends && ", "wire wrong_crc = 1'b0 && "),
        pytest.param(
            "frame",
            "wire is_byte = in_image || octet_valid && !in_frame && !held",
            "wire is_byte = in_image || octet_valid",
            marks=NIGHTLY,
        ),
    ],
)
def test_a_defect_of_tables_is_found(files, name, right, wrong):
    def change(text):
        assert text.count(right) == 1, right
        return text.replace(right, wrong)

    tests, failed = simulate(files, BUILD / f"defect-{name}", "axi", change)
    assert tests == 4 and failed > 0
