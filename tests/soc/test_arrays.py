"""Several arrays on one core: generates the core, and an engine of each array alone, and runs arrays.py under Icarus."""

import os
import shutil
import subprocess

import pytest
from test_cores import BUILD, DERMIS, HERE, environment, generate, icarus

ARRAYS = 4
VERSION = 7


@pytest.fixture(scope="module")
def arrays_scene():
    """The scene beside the tables of its arrays, which have zeros of their own and the same largest gain; and an engine of each."""
    folder = BUILD / "arrays"
    folder.mkdir(parents=True, exist_ok=True)
    scene = shutil.copy(HERE / "arrays.toml", folder)
    for array in range(ARRAYS):
        places = [(row, col) for row in range(4) for col in range(3)]
        lines = [f"{row},{col},{0.002 * array * (row - col)},{1 - 0.1 * array * (row > 0)}\n" for row, col in places]
        (folder / f"arrays-{array}.csv").write_text("row,col,offset,gain\n" + "".join(lines), encoding="utf-8")
        generate(folder / f"alone-{array}", scene=f"{scene}#{array}")
    image = [DERMIS, "load", scene, f"{scene}#0", "--tables-version", str(VERSION), "--out", folder / "first.tables"]
    subprocess.run(image, check=True, stdout=subprocess.DEVNULL)
    return scene


def simulate(scene, folder, change=lambda text: text):
    generate(folder, "--bus", "axi", "--stream-bits", "64", scene=scene)
    verilog = folder / "dermis_arrays_axi.v"
    verilog.write_text(change(verilog.read_text(encoding="utf-8")), encoding="utf-8")
    alone = BUILD / "arrays/alone-{}/dermis_arrays_tb_beats.hex"
    more = {"DERMIS_ARRAYS": str(ARRAYS), "DERMIS_ALONE": str(alone)}
    more |= {"DERMIS_IMAGE": str(BUILD / "arrays/first.tables"), "DERMIS_VERSION": str(VERSION)}
    if "DERMIS_NIGHTLY" in os.environ:
        more["DERMIS_ROUNDS"] = "200"
    vectors = BUILD / "arrays/alone-0/dermis_arrays_tb"
    return icarus(folder, "dermis_arrays_axi", [verilog], "arrays", environment("axi", 64, vectors) | more)


def test_arrays(arrays_scene):
    assert simulate(arrays_scene, BUILD / "arrays/axi") == (3, 0)


@pytest.mark.parametrize(
    "name, right, count, wrong",
    [
        # Zeros, gains and means of the first array are those of all; an image is written to the array of the next frame.
        ("place", "wire [5:0] place = {s_axis_tid, taxel};", 2, "wire [5:0] place = {2'd0, taxel};"),
        ("image", "{write_array, write_taxel}", 1, "{s_axis_tid, write_taxel}"),
    ],
)
def test_a_defect_is_found(arrays_scene, name, right, count, wrong):
    def change(text):
        assert text.count(right) == count, right
        return text.replace(right, wrong)

    tests, failed = simulate(arrays_scene, BUILD / f"arrays/defect-{name}", change)
    assert tests == 3 and failed > 0
