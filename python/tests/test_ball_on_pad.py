"""The example with MuJoCo: Dermis finds the force that MuJoCo says, and the guide shows what the program prints.

DERMIS_ACCEPT=1 writes output and picture of the guide anew.
"""

import importlib.util
import os
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from conftest import ROOT

PAGE = ROOT / "docs" / "learning.md"
OUTPUT = re.compile(r"(<!-- output: ball_on_pad\.py -->\n)(.*?)(<!-- end of output -->)", re.DOTALL)
NOISE = 0.001


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("ball_on_pad", ROOT / "python" / "examples" / "ball_on_pad.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def result(example: ModuleType):
    return example.run(NOISE)


def test_the_force_is_that_of_mujoco(result) -> None:
    truth, found, sigma = result.truth_N, result.found_N, result.sigma_N
    assert len(found) == len(truth) == 150
    # The ball is pressed with 6 N and slides: the shear reaches friction, in two directions.
    assert abs(truth[-1, 2] - 6) < 0.1 and np.abs(np.linalg.norm(truth[-1, :2]) - 2.4) < 0.1
    assert truth[:, 0].max() > 1 and truth[:, 0].min() < -1
    pressed = truth[:, 2] >= 1
    off = np.linalg.norm(found - truth, axis=1)[pressed] / np.linalg.norm(truth[pressed], axis=1)
    assert np.median(off) < 0.1
    assert (np.abs(found - truth) < 2 * sigma)[pressed].mean() > 0.8
    # Shear of the other sign would not pass.
    mirrored = np.linalg.norm(found * [-1, -1, 1] - truth, axis=1)[pressed] / np.linalg.norm(truth[pressed], axis=1)
    assert np.median(mirrored) > 0.3


def test_the_stress_closes_with_the_force(example: ModuleType, result) -> None:
    """Over the array the stress sums up to nearly the normal force, the pad being wider than the contact."""
    import dermis

    scene = dermis.Scene.from_name(example.SCENE)
    area = scene.pitch_mm[0] * scene.pitch_mm[1]
    sums = result.stress_MPa.sum(axis=(1, 2)) * area
    late = result.truth_N[:, 2] > 5
    assert np.abs(sums[late] / result.truth_N[late, 2] - 1).max() < 0.15


def test_the_guide_shows_what_it_prints(example: ModuleType, result, tmp_path: Path) -> None:
    printed = f"{example.table(result)}\n\n{example.summary(result)}.\n"
    picture = PAGE.parent / "pictures" / "ball-on-pad.svg"
    page = PAGE.read_text()
    if os.environ.get("DERMIS_ACCEPT"):
        PAGE.write_text(OUTPUT.sub(lambda found: found[1] + printed + found[3], page))
        example.draw(result, picture)
        return
    shown = OUTPUT.search(page)
    assert shown and shown[2] == printed
    example.draw(result, tmp_path / "ball.png")
    import matplotlib.pyplot as plt

    pixels = plt.imread(tmp_path / "ball.png")[..., :3].reshape(-1, 3)
    assert len(np.unique((pixels * 15).astype(int), axis=0)) > 30
    assert "<svg" in picture.read_text()[:2000]
