"""`dermis export onnx`: ONNX Runtime computes the mu and sigma that Dermis finds."""

from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest

import dermis
from conftest import ROOT
from conftest import dermis as command

# Single precision: sums of some hundred products in another order.
TOLERANCE = 1e-5


def exported(scene: str, folder: Path) -> Path:
    """The file of a scene's network."""
    path = folder / "net.onnx"
    assert f"{path}: " in command("export", "onnx", scene, str(path))
    onnx.checker.check_model(onnx.load(path), full_check=True)
    return path


def run(path: Path, stress: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """mu and sigma by ONNX Runtime."""
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    given = {"stress": stress.astype(np.float32), "mask": mask.astype(np.float32)}
    mu, sigma = session.run(["mu", "sigma"], given)
    return mu, sigma


def scene_of(name: str, more: str = "") -> dermis.Scene:
    """A built-in scene whose floating-point model takes the network, with further lines."""
    text = (ROOT / "golden" / "scenes" / f"{name}.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith("estimator")]
    text = "\n".join(lines).replace("[search]", '[search]\nestimator = "network"') + "\n" + more
    return dermis.Scene.from_toml(text, f"{name}.toml")


def found(scene: dermis.Scene, frames: list[dermis.Frame]) -> tuple[np.ndarray, np.ndarray]:
    """mu and sigma of Dermis' floating-point network."""
    results = [scene.reconstruct(frame, cross_check=0).to_dict() for frame in frames]
    own: list[Any] = [result["subarrays"][0] for result in results]
    return np.array([one["mu"] for one in own]), np.array([one["mu_sigma"] for one in own])


@pytest.mark.parametrize("name", ["sensor-1", "sensor-1-unipolar", "sensor-1-bonded", "eight-by-eight-bonded"])
def test_another_runtime_finds_the_same(name: str, tmp_path: Path) -> None:
    scene = scene_of(name)
    loads = [0.01, 1.0, 300.0]
    frames = [
        scene.generate(
            [{"shape": "hertz-circle", "size_mm": [3 + k % 3], "centre_mm": [k % 5 - 2, k % 7 - 3],
              "normal_N": loads[k % 3], "tangential_N": [0.3 * loads[k % 3], (-0.1) ** (k % 2) * loads[k % 3]]}],
            noise=0.002, seed=k, unipolar="unipolar" in name)
        for k in range(30)
    ]
    stress = np.stack([frame.stress_MPa for frame in frames])
    mu, sigma = run(exported(name, tmp_path), stress, np.zeros_like(stress))
    wanted_mu, wanted_sigma = found(scene, frames)
    assert np.abs(mu - wanted_mu).max() < TOLERANCE and np.abs(sigma - wanted_sigma).max() < TOLERANCE
    # Different shears: the comparison is not of constants; a frame in another place of the batch has another answer.
    assert wanted_mu.std(axis=0).min() > 0.05 and np.abs(mu[1:] - wanted_mu[:-1]).max() > 0.05
    mirrored, _ = run(tmp_path / "net.onnx", stress[:, :, ::-1], np.zeros_like(stress))
    assert np.abs(mirrored * [-1, 1] - wanted_mu).max() < TOLERANCE


def test_the_power_of_two_is_that_above_the_peak(tmp_path: Path) -> None:
    scene = scene_of("sensor-1")
    path = exported("sensor-1", tmp_path)
    base = scene.generate(random=1, seed=5).stress_MPa.astype(np.float32)
    base /= np.abs(base).max()
    # A peak at a power of two, one rounding below it, and above: the network sees a jump by two there, on both sides alike.
    one, below = np.float32(1), np.nextafter(np.float32(1), np.float32(0))
    exponents = range(-40, 20)
    scales = np.array([scale * 2.0**k for k in exponents for scale in (one, below, 1.37)])
    stress = base * scales[:, None, None].astype(np.float32)
    mu, sigma = run(path, stress, np.zeros_like(stress))
    assert np.abs(mu[0::3] - mu[0]).max() < TOLERANCE and np.abs(mu[1::3] - mu[1]).max() < TOLERANCE
    assert np.abs(mu[1] - mu[0]).max() > 100 * TOLERANCE
    own = [scene.reconstruct(frame.astype(np.float64), cross_check=0).to_dict()["subarrays"][0] for frame in stress]
    assert len(own) == 3 * len(exponents) and np.abs(mu - [one["mu"] for one in own]).max() < TOLERANCE
    assert np.abs(sigma - [one["mu_sigma"] for one in own]).max() < TOLERANCE
    nothing, wide = run(path, np.zeros((1, 10, 10)), np.zeros((1, 10, 10)))
    assert np.isfinite(nothing).all() and np.isfinite(wide).all()


def test_masked_taxels_are_not_read(tmp_path: Path) -> None:
    scene = scene_of("sensor-1", "[input]\ndead = [[2, 3], [7, 7]]\n")
    frames = [scene.generate(random=1, seed=k) for k in range(5)]
    stress, mask = np.stack([frame.stress_MPa for frame in frames]), np.zeros((5, 10, 10))
    mask[:, [2, 7], [3, 7]] = 1
    wanted_mu, wanted_sigma = found(scene, frames)
    stress[:, [2, 7], [3, 7]] = np.nan
    mu, sigma = run(exported("sensor-1", tmp_path), stress, mask)
    assert np.abs(mu - wanted_mu).max() < TOLERANCE and np.abs(sigma - wanted_sigma).max() < TOLERANCE


def test_a_window_of_odd_lines_has_a_file_too(tmp_path: Path) -> None:
    path = exported("sensor-3-contacts", tmp_path)
    model = onnx.load(path)
    about = {entry.key: entry.value for entry in model.metadata_props}
    rows, cols = (dim.dim_value for dim in model.graph.input[0].type.tensor_type.shape.dim[1:])
    assert rows % 2 == cols % 2 == 1 and "contact" in about["window"]
    scene = dermis.Scene.from_name("sensor-3-contacts")
    # Mirrored stress has the mirrored mu.
    stress = np.abs(np.random.default_rng(2).normal(size=(3, rows, cols)))
    mu, sigma = run(path, stress, np.zeros_like(stress))
    mirrored, _ = run(path, stress[:, ::-1], np.zeros_like(stress))
    assert np.abs(mirrored * [1, -1] - mu).max() < TOLERANCE and np.abs(mu).max() > 0.01
    assert float(about["mu_max"]) >= np.linalg.norm(mu, axis=1).max() and scene.rows > rows
