"""Several arrays on one core: generates the core, and an engine of each array alone, and runs arrays.py under Icarus."""

import os
import shutil

import pytest
from test_cores import BUILD, HERE, environment, generate, icarus

ARRAYS = 4


@pytest.fixture(scope="module")
def scene():
    """The scene beside the tables of its arrays, which have zeros of their own and the same largest gain; and an engine of each."""
    folder = BUILD / "arrays"
    folder.mkdir(parents=True, exist_ok=True)
    scene = shutil.copy(HERE / "arrays.toml", folder)
    for array in range(ARRAYS):
        places = [(row, col) for row in range(4) for col in range(3)]
        lines = [f"{row},{col},{0.002 * array * (row - col)},{1 - 0.1 * array * (row > 0)}\n" for row, col in places]
        (folder / f"arrays-{array}.csv").write_text("row,col,offset,gain\n" + "".join(lines), encoding="utf-8")
        generate(folder / f"alone-{array}", scene=f"{scene}#{array}")
    return scene


def simulate(scene, folder, change=lambda text: text):
    generate(folder, "--bus", "axi", "--stream-bits", "64", scene=scene)
    verilog = folder / "dermis_arrays_axi.v"
    verilog.write_text(change(verilog.read_text(encoding="utf-8")), encoding="utf-8")
    alone = BUILD / "arrays/alone-{}/dermis_arrays_tb_beats.hex"
    more = {"DERMIS_ARRAYS": str(ARRAYS), "DERMIS_ALONE": str(alone)}
    if "DERMIS_NIGHTLY" in os.environ:
        more["DERMIS_ROUNDS"] = "200"
    vectors = BUILD / "arrays/alone-0/dermis_arrays_tb"
    return icarus(folder, "dermis_arrays_axi", [verilog], "arrays", environment("axi", 64, vectors) | more)


def test_arrays(scene):
    assert simulate(scene, BUILD / "arrays/axi") == (2, 0)


# The mean of the first array is that of all.
def test_a_defect_is_found(scene):
    right = "wire [5:0] place = {s_axis_tid, taxel};"

    def change(text):
        assert text.count(right) == 2, right
        return text.replace(right, "wire [5:0] place = {2'd0, taxel};")

    tests, failed = simulate(scene, BUILD / "arrays/defect", change)
    assert tests == 2 and failed > 0
