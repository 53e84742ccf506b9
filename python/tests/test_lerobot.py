"""Datasets of LeRobot: the published layout, values of results at their ticks, and what is refused.

LeRobot itself, which brings PyTorch, is not installed here: `datasets`, with which it reads the files, is.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import datasets
import numpy as np
import pandas
import pyarrow.parquet
import pytest

import dermis
from dermis.lerobot import export

SCENE = dermis.Scene.from_name("eight-by-eight")
START = 1732770000020000003
# 100 frames/s, with the jitter of a serial port.
TIMES = [START + 10_000_000 * k + 1_000_003 * (k % 3) for k in range(45)]


def recording(count: int = 45, times: list[int] = TIMES) -> list[dermis.Frame]:
    """A press that grows, each frame with its time."""
    press = SCENE.generate([{"shape": "hertz-circle", "size_mm": [6], "normal_N": 4, "tangential_N": [0.8, 0.4]}])
    frames = []
    for k in range(count):
        text = json.loads(press.to_json())
        text |= {"time_ns": times[k], "stress_MPa": (press.stress_MPa.ravel() * (k + 1) / count).tolist()}
        frames.append(text)
    return [loaded(text) for text in frames]


def loaded(text: dict[str, Any]) -> dermis.Frame:
    import tempfile

    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(text, file)
        file.flush()
        return dermis.Frame.load(file.name)


def features(info: dict[str, Any]) -> datasets.Features:
    """The types of columns that follow from info.json, as LeRobot takes them."""

    def of(feature: dict[str, Any]) -> Any:
        shape, value = tuple(feature["shape"]), datasets.Value(feature["dtype"])
        if shape == (1,):
            return value
        if len(shape) == 1:
            return datasets.Sequence(value, length=shape[0])
        return {2: datasets.Array2D, 3: datasets.Array3D}[len(shape)](shape=shape, dtype=feature["dtype"])

    return datasets.Features({name: of(feature) for name, feature in info["features"].items()})


def read(folder: Path) -> tuple[dict[str, Any], Any]:
    """info.json, and the rows by way of `datasets`."""
    info = json.loads((folder / "meta" / "info.json").read_text())
    paths = sorted(str(path) for path in folder.glob("data/*/*.parquet"))
    cache = str(folder.parent / "cache")
    return info, datasets.Dataset.from_parquet(paths, features=features(info), cache_dir=cache).with_format("numpy")


def test_the_dataset_has_the_results_at_the_ticks(tmp_path: Path) -> None:
    frames = recording()
    folder = export(SCENE, [frames, frames[:20]], tmp_path / "set", fps=30, task="press the pad")
    info, rows = read(folder)
    with SCENE.tracker() as tracker:
        results = [tracker.push(frame) for frame in frames]
    ticks = [START + round(k * 1e9 / 30) for k in range(14)]
    assert TIMES[-1] >= ticks[-1] and TIMES[-1] < START + round(14e9 / 30)
    newest = [max(k for k in range(45) if TIMES[k] <= tick) for tick in ticks]
    assert len(set(newest)) == 14
    first = rows.select(range(14))
    assert np.array_equal(first["observation.tactile.stress"][:], np.float32([frames[k].stress_MPa for k in newest]))
    assert np.array_equal(first["observation.tactile.force"][:], np.float32([results[k].forces_N for k in newest]))
    wrench = [np.concatenate([results[k].resultant_N, results[k].moment_Nmm]) for k in newest]
    assert np.array_equal(first["observation.wrench"][:], np.float32(wrench))
    assert np.allclose(first["timestamp"][:], np.arange(14) / 30, rtol=0, atol=1e-6)
    flags = [sum(1 << dermis.FLAGS.index(flag) for flag in results[k].flags) for k in newest]
    assert first["observation.tactile.flags"][:].tolist() == flags
    # The second episode begins anew.
    assert rows["episode_index"][:].tolist() == [0] * 14 + [1] * 6 and rows["index"][:].tolist() == list(range(20))
    assert rows["frame_index"][:].tolist() == [*range(14), *range(6)] and set(rows["task_index"][:].tolist()) == {0}
    assert info["total_frames"] == 20 == len(rows) and info["total_episodes"] == 2 and info["fps"] == 30
    assert info["codebase_version"] == "v3.0" and info["splits"] == {"train": "0:2"}


def test_the_files_beside_it_describe_it(tmp_path: Path) -> None:
    folder = export(SCENE, [recording(), recording(20)], tmp_path / "set", task="press the pad")
    tasks = pandas.read_parquet(folder / "meta" / "tasks.parquet")
    assert tasks.loc["press the pad"].task_index == 0
    episodes = pyarrow.parquet.read_table(folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet").to_pylist()
    assert [(one["episode_index"], one["length"]) for one in episodes] == [(0, 14), (1, 6)]
    assert [(one["dataset_from_index"], one["dataset_to_index"]) for one in episodes] == [(0, 14), (14, 20)]
    assert all(one["tasks"] == ["press the pad"] and one["data/file_index"] == 0 for one in episodes)
    info, rows = read(folder)
    stats = json.loads((folder / "meta" / "stats.json").read_text())
    assert set(stats) == set(info["features"])
    wrench = rows["observation.wrench"][:].astype(np.float64)
    for name, of in {"min": np.min, "max": np.max, "mean": np.mean, "std": np.std}.items():
        assert np.allclose(stats["observation.wrench"][name], of(wrench, axis=0), rtol=0, atol=1e-9), name
    assert np.allclose(episodes[0]["stats/observation.wrench/mean"], wrench[:14].mean(axis=0), rtol=0, atol=1e-9)
    assert np.shape(stats["observation.tactile.force"]["q50"]) == (8, 8, 3)
    assert stats["observation.wrench"]["count"] == [20]


def test_a_mean_is_of_what_came_since_the_tick_before(tmp_path: Path) -> None:
    frames = recording()
    _, rows = read(export(SCENE, [frames], tmp_path / "set", resampling="mean", start_ns=[START + 50_000_000]))
    stress = rows["observation.tactile.stress"][:]
    ticks = [START + 50_000_000 + round(k * 1e9 / 30) for k in range(3)]
    since = [k for k in range(45) if ticks[1] < TIMES[k] <= ticks[2]]
    assert len(since) == 3
    assert np.allclose(stress[2], np.mean([frames[k].stress_MPa for k in since], axis=0), rtol=1e-6, atol=0)
    # At the first tick there is but the newest.
    assert np.array_equal(stress[0], np.float32(frames[5 if TIMES[5] <= ticks[0] else 4].stress_MPa))


def test_slow_frames_are_held(tmp_path: Path) -> None:
    frames = recording(5)
    _, rows = read(export(SCENE, [frames], tmp_path / "set", fps=100, rate_hz=20))
    stress = rows["observation.tactile.stress"][:]
    assert len(stress) == 21 and np.array_equal(stress[9], stress[5]) and not np.array_equal(stress[10], stress[9])


def test_missing_readings_stay_missing(tmp_path: Path) -> None:
    frames = []
    for frame in recording(10):
        text = json.loads(frame.to_json())
        text["stress_MPa"][11] = None
        frames.append(loaded(text))
    folder = export(SCENE, [frames], tmp_path / "set")
    _, rows = read(folder)
    assert np.isnan(rows["observation.tactile.stress"][:][:, 1, 3]).all()
    stats = json.loads((folder / "meta" / "stats.json").read_text())
    assert stats["observation.tactile.stress"]["mean"][1][3] == 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fps": 0}, "fps = 0 is not allowed"),
        ({"resampling": "last"}, "resampling = 'last' is not allowed"),
        ({"rate_hz": float("nan")}, "rate_hz = nan is not allowed"),
        ({"start_ns": [START - 1]}, "the first tick is at"),
        ({"start_ns": [START + 10**10]}, "the first tick is at"),
        ({"start_ns": []}, "start_ns has 0 values"),
        ({"episodes": []}, "episodes is empty"),
        ({"episodes": [[]]}, "episodes[0]: there is no result of 0 frames"),
        ({"episodes": ["absent.mcap"]}, "absent.mcap"),
        ({"episodes": [SCENE.frames[:2]]}, "episodes[0]: frame 0 has no time"),
        ({"episodes": [recording(2, [5, 5])]}, "episodes[0]: frame 1 has the time 5 ns, the one before 5 ns"),
    ],
)
def test_what_cannot_be_used_is_named(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(dermis.InputError) as error:
        export(SCENE, **({"episodes": [recording(3)], "out": tmp_path / "set"} | change))
    assert message in str(error.value)


def test_the_program_reads_a_recording_and_leaves_other_folders_alone(tmp_path: Path) -> None:
    lines = "".join(json.dumps({"time_ns": f.time_ns, "stress_MPa": f.stress_MPa.ravel().tolist()}) + "\n" for f in recording(12))
    (tmp_path / "lines").write_text(lines)
    recorded = tmp_path / "press.mcap"
    with (tmp_path / "lines").open() as given:
        import os

        program = [os.environ["DERMIS"], "reconstruct", "eight-by-eight", "--stream", "--brief", "--record", str(recorded)]
        subprocess.run(program, stdin=given, capture_output=True, check=True)

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        program = [sys.executable, "-m", "dermis.lerobot", *arguments]
        return subprocess.run(program, capture_output=True, text=True, cwd=tmp_path)

    done = run("eight-by-eight", "set", "press.mcap", "--fps", "50", "--task", "press")
    assert done.returncode == 0 and done.stdout == "set: 1 episodes at 50 frames/s\n", done.stderr
    _, rows = read(tmp_path / "set")
    assert len(rows) == 6
    again = run("eight-by-eight", "set", "press.mcap")
    assert again.returncode == 1 and "error: out: set exists and is not an empty folder" in again.stderr
