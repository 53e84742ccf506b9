"""Stages: integers beside floating point; errors under noise: those of the command."""

import json

import numpy as np
import pytest

import dermis
from conftest import dermis as program


@pytest.mark.parametrize("name", ["sensor-1", "sensor-1-noisy", "eight-by-eight"])
def test_integers_and_floating_point_agree_stage_by_stage(name: str) -> None:
    scene = dermis.Scene.from_name(name)
    frame = scene.frames[0]
    stages = {stage.name: stage for stage in scene.trace(frame)}
    order = "receive normalise fold pass rescale relax unfold search forces send".split()
    assert list(stages) == [stage for stage in order if stage in stages]
    assert ("relax" in stages) == (name == "sensor-1-noisy")
    for stage in stages.values():
        assert np.array_equal(stage.fixed, stage.words * stage.lsb)
        assert (stage.words.dtype, stage.floating.shape) == (np.int64, stage.words.shape)
        assert 2 ** (stage.bits - 1) > np.abs(stage.words).max() or stage.name == "pass"
        share = np.abs(stage.fixed - stage.floating).max() / np.abs(stage.floating).max()
        # The arithmetic has 18 bits and more; the search, and with it the forces sent, takes one of finitely many mu.
        assert share < (0.25 if stage.name in ("search", "send") else 2.4e-4), (stage, share)
    # The values are those of the physics: stress in, forces out.
    receive, send = stages["receive"], stages["send"]
    assert np.abs(receive.floating - frame.stress_MPa.ravel()).max() < 1e-12
    assert np.abs(receive.fixed - frame.stress_MPa.ravel()).max() <= receive.lsb[0] * (0.5 + 1e-9)
    forces = scene.reconstruct(frame, "fixed").forces_N
    assert np.allclose(send.fixed, np.moveaxis(forces, -1, 0).ravel(), rtol=1e-12, atol=0)
    assert (receive.unit, stages["search"].unit, send.unit) == ("MPa", "1", "N")


def test_a_trace_is_of_one_frame_of_a_scene_with_hardware() -> None:
    scene = dermis.Scene.from_name("eight-by-eight")
    with pytest.raises(dermis.InputError, match="wanted one frame"):
        scene.trace(scene.frames)
    text = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n"
    with pytest.raises(dermis.InputError, match="input.average = 1"):
        dermis.Scene.from_toml(text + "[input]\naverage = 1\n").trace(np.ones((8, 8)))
    with pytest.raises(dermis.InputError, match="adaptive"):
        dermis.Scene.from_toml(text + '[partition]\ncase = "adaptive"\n').trace(np.ones((8, 8)))


def test_noise_is_that_of_the_command() -> None:
    scene = dermis.Scene.from_name("sensor-1")
    rows = scene.noise(levels=[0, 0.001], draws=3, seed=5, objectives=["sparse"], frames=2)
    options = "--level 0 --level 0.001 --draws 3 --seed 5 --objective sparse --frames 2 --json"
    assert rows == json.loads(program("noise", "sensor-1", *options.split()))
    assert len(rows) == 4 and rows[0]["ratio_6"] is None
    with pytest.raises(dermis.InputError, match='objectives = "sparce" is not allowed; it must be of sparse, '):
        scene.noise(objectives=["sparce"])
    with pytest.raises(dermis.InputError, match="draws = 0"):
        scene.noise(draws=0)
    with pytest.raises(dermis.InputError, match="noise = 2 is not allowed"):
        scene.noise(levels=[2.0], draws=1)


def test_noise_over_shapes_is_that_of_the_command() -> None:
    scene = dermis.Scene.from_name("eight-by-eight")
    rows = scene.noise(
        shapes="tilted,ring", levels=[0.001], draws=2, estimators=["search"], contacts=2, gain_spread=0.01, unipolar=True,
        stated=False, frames=2,
    )
    options = "--shapes tilted,ring --level 0.001 --draws 2 --estimator search --contacts 2 --gain-spread 0.01 --unipolar"
    assert rows == json.loads(program("noise", "eight-by-eight", *options.split(), "--unstated", "--frames", "2", "--json"))
    assert {row["estimator"] for row in rows} == {"search sparse", "none"} and rows[0]["unipolar"] and not rows[0]["told"]
    with pytest.raises(dermis.InputError, match='shapes = "blob": one of hertz, '):
        scene.noise(shapes="ring,blob")
    with pytest.raises(dermis.InputError, match='estimators = "none" is not allowed; it must be of '):
        scene.noise(shapes="ring", estimators=["none"])
    with pytest.raises(dermis.InputError, match="drift needs shapes"):
        scene.noise(drift=0.1)
