"""Recordings as a dataset of LeRobot, layout v3.0: stress, forces and wrench at the rate of the cameras.

    python -m dermis.lerobot sensor-1 dataset press-1.mcap press-2.mcap --fps 30 --task "press the button"

Each recording is an episode. All its frames are reconstructed in their order, as `Scene.tracker` does; at every tick of 1/fps the
dataset has the newest result, or the mean of those since the tick before. Needs pandas and pyarrow, which LeRobot installs.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ._dermis import FLAGS, Frame, InputError, Reconstruction, Scene

__all__ = ["export"]

_Columns = dict[str, NDArray[Any]]

_VERSION = "v3.0"
_FILES_PER_CHUNK = 1000
# What LeRobot's own recordings have; a new file is begun where an episode would make one larger.
_LARGEST_FILE_MB = 100
_LARGEST_VIDEO_MB = 200
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_STRESS, _FORCE, _WRENCH = "observation.tactile.stress", "observation.tactile.force", "observation.wrench"
_FLAGS = "observation.tactile.flags"
_WRENCH_NAMES = ["force_x_N", "force_y_N", "force_normal_N", "moment_x_Nmm", "moment_y_Nmm", "moment_normal_Nmm"]
_QUANTILES = (0.01, 0.1, 0.5, 0.9, 0.99)
_NS = 1_000_000_000


@dataclass
class _Result:
    """What a tick may have: the newest reading and what was found of it."""

    time_ns: int
    stress_MPa: NDArray[np.float64]
    found: Reconstruction


def export(
    scene: Scene,
    episodes: Iterable[Sequence[Frame] | str | PathLike[str]],
    out: str | PathLike[str],
    *,
    fps: int = 30,
    task: str = "touch",
    resampling: Literal["newest", "mean"] = "newest",
    engine: Literal["golden", "fixed"] = "golden",
    rate_hz: float | None = None,
    start_ns: Sequence[int] | None = None,
) -> Path:
    """Write recordings as a dataset of LeRobot.

    Parameters
    ----------
    scene : Scene
    episodes : iterable of lists of Frame, or of paths
        Frames in the order of time; a path is one of `Scene.load_frames`, such as a .mcap recording.
    out : path
        Folder of the dataset, which does not exist or is empty.
    fps : int, default 30
        Ticks per second, those of the cameras.
    task : str, default "touch"
        What was done, in words.
    resampling : "newest" or "mean", default "newest"
        A tick has the newest result that was there at its time, or the mean of those since the tick before, where there are any.
    engine : "golden" or "fixed", default "golden"
        As for `Scene.reconstruct`.
    rate_hz : float, optional
        Frames per second, where frames have no time of acquisition.
    start_ns : sequence of int, optional
        When the first tick of each episode is, in ns by the clock of its frames, such as that of the first picture; default: when
        the first result is there.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        An argument out of range, frames without a time or not in its order, an episode without a tick, a folder that is not empty.
    ImportError
        pandas or pyarrow is not installed.
    """
    if not isinstance(fps, int) or not 1 <= fps <= 1_000_000:
        raise InputError(f"fps = {fps} is not allowed; it must be a whole number from 1 to 1000000")
    if resampling not in ("newest", "mean"):
        raise InputError(f"resampling = {resampling!r} is not allowed; it must be 'newest' or 'mean'")
    if rate_hz is not None and not (math.isfinite(rate_hz) and rate_hz > 0):
        raise InputError(f"rate_hz = {rate_hz} is not allowed; it must be above 0")
    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"out: {folder} exists and is not an empty folder")
    dataset = _Dataset(folder, fps, task)
    for number, episode in enumerate(episodes):
        frames = scene.load_frames(episode) if isinstance(episode, (str, PathLike)) else episode
        name = str(episode) if isinstance(episode, (str, PathLike)) else f"episodes[{number}]"
        if start_ns is not None and number >= len(start_ns):
            raise InputError(f"start_ns has {len(start_ns)} values, there are more episodes")
        results = _results(scene, frames, name, engine, rate_hz)
        start = None if start_ns is None else int(start_ns[number])
        dataset.add(_resampled(results, name, fps, start, resampling))
    dataset.finish()
    return folder


def _results(scene: Scene, frames: Sequence[Frame], name: str, engine: Any, rate_hz: float | None) -> list[_Result]:
    """The results of frames in the order of time."""
    results: list[_Result] = []
    before: int | None = None
    with scene.tracker(engine) as tracker:
        for index, frame in enumerate(frames):
            time_ns = frame.time_ns if rate_hz is None else round(index * _NS / rate_hz)
            if time_ns is None:
                raise InputError(f"{name}: frame {index} has no time; rate_hz says how many there are in a second")
            if before is not None and time_ns <= before:
                raise InputError(f"{name}: frame {index} has the time {time_ns} ns, the one before {before} ns")
            before = time_ns
            found = tracker.push(frame, time_ns=time_ns)
            if found is not None:
                results.append(_Result(time_ns, frame.stress_MPa, found))
    if not results:
        raise InputError(f"{name}: there is no result of {len(frames)} frames")
    return results


def _wrench(found: Reconstruction) -> NDArray[np.float64]:
    """Force and moment; NaN where a device sends no moment."""
    moment = np.full(3, np.nan) if found.moment_Nmm is None else found.moment_Nmm
    return np.concatenate([found.resultant_N, moment])


def _resampled(results: list[_Result], name: str, fps: int, start_ns: int | None, resampling: str) -> _Columns:
    """The features of an episode at every tick."""
    times = np.array([result.time_ns for result in results])
    start = int(times[0]) if start_ns is None else start_ns
    count = int((int(times[-1]) - start) * fps // _NS) + 1
    # Whole nanoseconds: a tick is as late as its time rounded.
    ticks = start + np.array([round(k * _NS / fps) for k in range(max(count, 0))], dtype=np.int64)
    ends = np.searchsorted(times, ticks, side="right")
    if not len(ticks) or ends[0] == 0:
        raise InputError(f"{name}: the results are from {times[0]} to {times[-1]} ns, the first tick is at {start} ns")
    begins = np.concatenate([[ends[0] - 1], ends[:-1]])
    if resampling == "newest":
        begins = ends - 1
    begins = np.minimum(begins, ends - 1)

    def of(values: list[NDArray[Any]]) -> NDArray[np.float32]:
        every = np.stack(values)
        return np.stack([every[a:b].mean(axis=0) for a, b in zip(begins, ends)]).astype(np.float32)

    columns: _Columns = {_STRESS: of([result.stress_MPa for result in results])}
    forces = [result.found.forces_N for result in results]
    if all(force is not None for force in forces):
        columns[_FORCE] = of([force for force in forces if force is not None])
    columns[_WRENCH] = of([_wrench(result.found) for result in results])
    bits = [sum(1 << FLAGS.index(flag) for flag in result.found.flags) for result in results]
    # A flag of one of the results is one of their mean.
    raised = [int(np.bitwise_or.reduce(bits[a:b])) for a, b in zip(begins, ends)]
    columns[_FLAGS] = np.array(raised, dtype=np.int64)
    columns["timestamp"] = (np.arange(len(ticks)) / fps).astype(np.float32)
    return columns


def _statistics(values: NDArray[Any]) -> dict[str, Any]:
    """What LeRobot normalises with, of each element over time; 0 for an element that is never there."""
    values = values.reshape(len(values), *values.shape[1:] or (1,)).astype(np.float64)
    known = ~np.isnan(values)
    values = np.where(known.any(axis=0), values, 0.0)
    of: dict[str, Any] = {
        "min": np.nanmin(values, axis=0),
        "max": np.nanmax(values, axis=0),
        "mean": np.nanmean(values, axis=0),
        "std": np.nanstd(values, axis=0),
    }
    of |= {f"q{100 * share:02.0f}": np.nanquantile(values, share, axis=0) for share in _QUANTILES}
    return {key: own.tolist() for key, own in of.items()} | {"count": [len(values)]}


class _Dataset:
    """A dataset while it is written: its episodes, and the file that takes the next one."""

    def __init__(self, folder: Path, fps: int, task: str) -> None:
        try:
            # By name: they have no types.
            self.pandas, self.arrow, self.parquet = map(import_module, ("pandas", "pyarrow", "pyarrow.parquet"))
        except ImportError as error:
            raise ImportError(f"dermis.lerobot needs {error.name}, which is not installed: pip install pandas pyarrow") from error
        self.folder, self.fps, self.task = folder, fps, task
        self.rows = 0
        self.episodes: list[dict[str, Any]] = []
        self.features: dict[str, dict[str, Any]] = {}
        self.writer: Any = None
        # Number of the file, and bytes of its columns so far.
        self.file, self.bytes = 0, 0
        self.all_columns: list[_Columns] = []

    def add(self, columns: _Columns) -> None:
        """Adds an episode."""
        count, number = len(columns["timestamp"]), len(self.episodes)
        columns = columns | {
            "frame_index": np.arange(count),
            "episode_index": np.full(count, number),
            "index": self.rows + np.arange(count),
            "task_index": np.zeros(count, dtype=np.int64),
        }
        features = {name: _feature(name, values) for name, values in columns.items()}
        if self.features and self.features != features:
            raise InputError(f"episodes[{number}] has other features than episodes[0]")
        self.features = features
        table = self.arrow.table({name: self._column(values) for name, values in columns.items()})
        if self.bytes and self.bytes + table.nbytes > _LARGEST_FILE_MB << 20:
            self._close()
            self.file, self.bytes = self.file + 1, 0
        if self.writer is None:
            path = self.folder / "data" / self._place()
            path.parent.mkdir(parents=True, exist_ok=True)
            self.writer = self.parquet.ParquetWriter(path, table.schema, compression="snappy")
        self.writer.write_table(table)
        self.bytes += table.nbytes
        self.all_columns.append(columns)
        self.episodes.append(
            {
                "episode_index": number,
                "tasks": [self.task],
                "length": count,
                "data/chunk_index": self.file // _FILES_PER_CHUNK,
                "data/file_index": self.file % _FILES_PER_CHUNK,
                "dataset_from_index": self.rows,
                "dataset_to_index": self.rows + count,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
            }
            | {f"stats/{name}/{key}": own for name, values in columns.items() for key, own in _statistics(values).items()}
        )
        self.rows += count

    def finish(self) -> None:
        """Ends the files and writes those that describe them."""
        if not self.episodes:
            raise InputError("episodes is empty, wanted at least one")
        self._close()
        meta = self.folder / "meta"
        path = meta / "episodes" / _FILE.format(chunk_index=0, file_index=0)
        path.parent.mkdir(parents=True, exist_ok=True)
        self.parquet.write_table(self.arrow.Table.from_pylist(self.episodes), path)
        self.pandas.DataFrame({"task_index": [0]}, index=[self.task]).to_parquet(meta / "tasks.parquet")
        all_values = {name: np.concatenate([columns[name] for columns in self.all_columns]) for name in self.features}
        self._write("stats", {name: _statistics(values) for name, values in all_values.items()})
        self._write(
            "info",
            {
                "codebase_version": _VERSION,
                "robot_type": None,
                "total_episodes": len(self.episodes),
                "total_frames": self.rows,
                "total_tasks": 1,
                "chunks_size": _FILES_PER_CHUNK,
                "data_files_size_in_mb": _LARGEST_FILE_MB,
                "video_files_size_in_mb": _LARGEST_VIDEO_MB,
                "fps": self.fps,
                "splits": {"train": f"0:{len(self.episodes)}"},
                "data_path": f"data/{_FILE}",
                "video_path": None,
                "features": self.features,
            },
        )

    def _place(self) -> str:
        """The file that takes the next episode, below the folder of its kind."""
        return _FILE.format(chunk_index=self.file // _FILES_PER_CHUNK, file_index=self.file % _FILES_PER_CHUNK)

    def _close(self) -> None:
        if self.writer is not None:
            self.writer.close()
            self.writer = None

    def _write(self, name: str, content: dict[str, Any]) -> None:
        """Writes a file of `meta`."""
        text = json.dumps(content, indent=4, ensure_ascii=False, allow_nan=False)
        (self.folder / "meta" / f"{name}.json").write_text(text, encoding="utf-8")

    def _column(self, values: NDArray[Any]) -> Any:
        """An array as nested lists, as many levels as it has axes after the first."""
        column = self.arrow.array(values.reshape(-1))
        for length in reversed(values.shape[1:]):
            starts = np.arange(0, len(column) + 1, length, dtype=np.int32)
            column = self.arrow.ListArray.from_arrays(starts, column)
        return column


def _feature(name: str, values: NDArray[Any]) -> dict[str, Any]:
    """A feature as info.json has it."""
    shape = list(values.shape[1:]) or [1]
    names: dict[str, list[str] | None] = {_WRENCH: _WRENCH_NAMES, _STRESS: ["row", "col"], _FORCE: ["row", "col", "axis"]}
    return {"dtype": str(values.dtype), "shape": shape, "names": names.get(name)}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m dermis.lerobot", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", help="built-in name or path of a scene")
    parser.add_argument("out", type=Path, help="folder of the dataset, new or empty")
    parser.add_argument("recordings", nargs="+", help="a file of frames for each episode, such as press.mcap")
    parser.add_argument("--fps", type=int, default=30, help="ticks per second, those of the cameras (30)")
    parser.add_argument("--task", default="touch", help="what was done, in words (touch)")
    parser.add_argument("--resampling", choices=("newest", "mean"), default="newest", help="what a tick has (newest)")
    parser.add_argument("--engine", choices=("golden", "fixed"), default="golden", help="what reconstructs (golden)")
    parser.add_argument("--rate", type=float, help="frames per second, of frames without a time")
    return parser.parse_args()


def _main() -> None:
    given = _arguments()
    settings = {"fps": given.fps, "task": given.task, "resampling": given.resampling, "engine": given.engine}
    try:
        folder = export(Scene.from_name(given.scene), given.recordings, given.out, rate_hz=given.rate, **settings)
    except InputError as error:
        raise SystemExit(f"error: {error}") from error
    print(f"{folder}: {len(given.recordings)} episodes at {given.fps} frames/s")


if __name__ == "__main__":
    _main()
