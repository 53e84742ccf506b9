"""The stress of forces on the surface, against the generator's, and what is refused."""

import threading

import numpy as np
import pytest

import dermis

SCENE = dermis.Scene.from_name("eight-by-eight-bonded")
PRESS = [{"shape": "hertz-circle", "size_mm": [5], "normal_N": 5, "tangential_N": [1, -0.5]}]


def test_cells_and_points_have_the_stress_of_their_contact() -> None:
    frame = SCENE.generate(PRESS)
    assert frame.cell_forces_N is not None
    stress = SCENE.stress_MPa(frame.cell_forces_N)
    peak = np.abs(frame.stress_MPa).max()
    # Evenly over cells of 4 mm in place of Hertz's pressure: a tenth is lost, but not the shear.
    assert np.abs(stress - frame.stress_MPa).max() < 0.11 * peak
    mirrored = SCENE.stress_MPa(frame.cell_forces_N * [-1, -1, 1])
    assert np.abs(mirrored - frame.stress_MPa).max() > 0.15 * peak
    # The same contact as many points: rings of equal shares of Hertz's pressure.
    share = (np.arange(400) + 0.5) / 400
    radius, angle = 5 * np.sqrt(1 - (1 - share) ** (2 / 3)), 2.399963 * np.arange(400)
    at_mm = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    points = SCENE.stress_MPa(np.tile(np.array([1, -0.5, 5]) / 400, (400, 1)), at_mm=at_mm)
    assert np.abs(points - frame.stress_MPa).max() < 0.01 * peak


def test_frames_are_computed_as_one_by_one() -> None:
    random = np.random.default_rng(3)
    forces = random.normal(size=(2, 3, 8, 8, 3))
    stress = SCENE.stress_MPa(forces)
    assert stress.shape == (2, 3, 8, 8)
    assert (stress[1, 2] == SCENE.stress_MPa(forces[1, 2])).all()
    assert np.allclose(SCENE.stress_MPa(forces.sum(axis=(0, 1))), stress.sum(axis=(0, 1)), rtol=0, atol=1e-12)
    assert SCENE.stress_MPa(np.zeros((0, 8, 8, 3))).shape == (0, 8, 8)
    # Not contiguous, not of float64, a list.
    assert (SCENE.stress_MPa(forces.transpose(1, 0, 2, 3, 4)) == stress.transpose(1, 0, 2, 3)).all()
    assert (SCENE.stress_MPa(np.ones((8, 8, 3), dtype=np.int16).tolist()) == SCENE.stress_MPa(np.ones((8, 8, 3)))).all()
    # Points: the same of all frames, and those of each.
    force, still = random.normal(size=(4, 5, 3)), random.normal(size=(5, 2))
    moving = np.stack([still] * 4)
    stress = SCENE.stress_MPa(force, at_mm=still)
    assert stress.shape == (4, 8, 8) and (stress == SCENE.stress_MPa(force, at_mm=moving)).all()
    moving[2] += 1
    assert (SCENE.stress_MPa(force, at_mm=moving)[[0, 1, 3]] == stress[[0, 1, 3]]).all()
    assert (SCENE.stress_MPa(force, at_mm=moving)[2] != stress[2]).all()
    assert (SCENE.stress_MPa(np.zeros((2, 0, 3)), at_mm=np.zeros((0, 2))) == np.zeros((2, 8, 8))).all()


def test_the_lock_is_free_meanwhile() -> None:
    forces, done = np.ones((600, 8, 8, 3)), threading.Event()
    worker = threading.Thread(target=lambda: (SCENE.stress_MPa(forces), done.set()))
    worker.start()
    turns = 0
    while not done.is_set():
        turns += 1
    worker.join()
    assert turns > 0 and SCENE.stress_MPa(forces).shape == (600, 8, 8)


@pytest.mark.parametrize(
    ("forces", "at_mm", "message"),
    [
        (np.zeros((8, 8)), None, "forces_N has shape (8, 8), scene eight-by-eight-bonded wants (8, 8, 3) or (..., 8, 8, 3)"),
        (np.zeros((8, 9, 3)), None, "forces_N has shape (8, 9, 3)"),
        (np.full((2, 8, 8, 3), np.nan), None, "forces_N[0, 0, 0] of frame "),
        (np.where(np.arange(192).reshape(8, 8, 3) == 100, -np.inf, 1), None, "forces_N[4, 1, 1] of frame 0 = -inf is not a finite"),
        (np.ma.masked_equal(np.eye(3), 0), [[0, 0]] * 3, "forces_N has masked values"),
        (np.full((4000, 3), 1e308), np.zeros((4000, 2)), "the stress on taxel "),
        (np.zeros((8, 8, 3), dtype=complex), None, "forces_N has values of type complex128"),
        (np.zeros((4, 3)), np.zeros((5, 2)), "forces_N has shape (4, 3), at_mm (5, 2); wanted (..., points, 3) with at_mm of"),
        (np.zeros((2, 4, 3)), np.zeros((3, 4, 2)), "forces_N has shape (2, 4, 3), at_mm (3, 4, 2)"),
        (np.zeros(3), np.zeros(2), "forces_N has shape (3,), at_mm (2,)"),
        (np.ones((1, 3)), [[np.nan, 0]], "at_mm[0, 0] of frame 0 = NaN is not a finite number"),
    ],
)
def test_what_cannot_be_used_is_named(forces, at_mm, message: str) -> None:
    with pytest.raises(dermis.InputError) as error:
        SCENE.stress_MPa(forces, at_mm=at_mm)
    assert message in str(error.value)
