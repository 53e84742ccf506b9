"""Frames: those of `dermis generate`, and errors by Eq. 3."""

from pathlib import Path

import numpy as np

import dermis
from conftest import dermis as program


def test_a_generated_frame_is_that_of_the_command(tmp_path: Path) -> None:
    scene = dermis.Scene.from_name("sensor-3")
    text = "flat-punch:at=-8,-20:size=4:normal=6:shear=0,2"
    options = ["--noise", "0.001", "--seed", "7", "--bits", "16", "--dead", "3,4", "--stuck", "0,7=0.2", "--random", "2"]
    printed = program("generate", "sensor-3", "--contact", text, *options, "--gain-spread", "0.01", "--unipolar")
    contact = {"shape": "flat-punch", "centre_mm": [-8, -20], "size_mm": 4, "normal_N": 6, "tangential_N": [0, 2]}
    converter = dict(noise=0.001, seed=7, bits=16, dead=[(3, 4)], stuck=[((0, 7), 0.2)], gain_spread=0.01, unipolar=True)
    frame = scene.generate([contact | {"size_mm": [4]}], random=2, **converter)
    assert frame.to_json() + "\n" == printed
    assert (frame.stress_MPa[3, 4], frame.stress_MPa[0, 7], frame.id) == (0, 0.2, "generated")
    # From a file it is the same.
    (tmp_path / "frame.json").write_text(printed)
    assert dermis.Frame.load(tmp_path / "frame.json").to_json() == frame.to_json()
    np.savetxt(tmp_path / "frame.csv", frame.stress_MPa, delimiter=",")
    [read] = scene.load_frames(tmp_path / "frame.csv")
    assert np.array_equal(read.stress_MPa, frame.stress_MPa)
    assert read.resultant_N is None and read.cell_forces_N is None


def test_the_cells_carry_the_contact() -> None:
    scene = dermis.Scene.from_name("sensor-1")
    frame = scene.generate([{"shape": "hertz-circle", "size_mm": [4], "normal_N": 5, "tangential_N": [1, -0.5]}])
    assert frame.resultant_N.tolist() == [1, -0.5, 5]
    assert np.allclose(frame.cell_forces_N.sum(axis=(0, 1)), frame.resultant_N)
    # x points towards higher columns, y towards higher rows.
    x, y = np.moveaxis(scene.positions_mm, -1, 0)
    assert (np.diff(x, axis=1) == scene.pitch_mm[0]).all() and (np.diff(y, axis=0) == scene.pitch_mm[1]).all()
    shifted = scene.generate([{"shape": "hertz-circle", "size_mm": [3], "normal_N": 5, "centre_mm": [6, -6]}])
    row, col = np.unravel_index(shifted.stress_MPa.argmax(), shifted.stress_MPa.shape)
    assert x[row, col] > 0 > y[row, col]


def test_errors_are_relative_and_absent_without_a_reference() -> None:
    errors = dermis.errors([3, -4, 10], [3.3, -4.4, 9])
    assert np.allclose([errors.x1, errors.x2, errors.x3, errors.tangential, errors.normal], [-0.1, -0.1, 0.1, 0.1, 0.1])
    assert dermis.errors([0, 1, 5], [1, 1, 5]).x1 is None
    scene = dermis.Scene.from_name("sensor-1")
    result = scene.reconstruct(scene.frames[0])
    again = dermis.errors(scene.frames[0].resultant_N, result.resultant_N)
    assert again.tangential == result.error.tangential
