"""The camera: a thread reconstructs every reading of its source, and LeRobot reads the newest image.

| call | gives | waits | raises, beside DeviceNotConnectedError |
|---|---|---|---|
| `read` | the next image after the call | up to 10 s | TimeoutError; RuntimeError where the source has ended or failed |
| `async_read` | the newest image that no `async_read` had | up to `timeout_ms` | the same; images that are there come first |
| `read_latest` | the newest image | never | TimeoutError where it is too old; RuntimeError at once |

All results are computed in the order of their readings, since running zeros and means have a history; where a sensor is faster than the
engine, its readings wait in the source.

A source that ended or failed leaves the camera connected: LeRobot's robots refuse to disconnect, and to release their motors, where a
camera says that it is not. `connect` after `disconnect` begins anew: the source is opened again, a recording plays from its first frame,
and the engine has no history.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from threading import Condition, Event, Thread
from typing import Any

import numpy as np
from dermis import Board, Frame, Reconstruction, Scene
from lerobot.cameras.camera import Camera
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected
from lerobot.utils.errors import DeviceNotConnectedError
from numpy.typing import NDArray

from .config import DermisCameraConfig
from .image import beyond, enlarged, force_image, stress_image
from .source import of_function, played

__all__ = ["DermisCamera", "Reading"]

logger = logging.getLogger(__name__)

# That of LeRobot's own cameras.
_READ_MS = 10_000.0
# How long `disconnect` waits for a source that is asked for its next reading.
_END_S = 2.0


@dataclass(frozen=True)
class Reading:
    """What an image was made of, without its rounding."""

    stress: NDArray[np.float64]
    """(rows, cols), as the source gave it: MPa, or what the scene's calibration table takes; NaN where a reading is missing."""
    result: Reconstruction
    """Its forces, resultant, contacts and flags."""


@dataclass(frozen=True)
class _Shown:
    """An image of a pixel for each taxel, and when it was there by the clock of `time.perf_counter`."""

    image: NDArray[np.uint8]
    reading: Reading
    at_s: float


class _Ended(Exception):
    """The source has no more readings."""


class _Stream:
    """One connection: its thread and the newest image.

    The next connection has another one, so that a thread which returns late from its source changes nothing there.
    """

    def __init__(self, name: str, stopped: Event, readings: Iterator[Any], shown: Callable[[Any], _Shown | None], opened: ExitStack):
        self.stopped = stopped
        self.readings = readings
        self.shown = shown
        self.opened = opened
        self.changed = Condition()
        self.newest: _Shown | None = None
        # Images so far, and how many of them were there when `async_read` gave one.
        self.count = self.given = 0
        self.failure: Exception | None = None
        # A program that forgets to disconnect is not kept from its end.
        self.thread = Thread(target=self._run, name=f"{name} readings", daemon=True)

    def _run(self) -> None:
        failure: Exception = _Ended("the source has no more readings")
        try:
            with self.opened:
                for reading in self.readings:
                    if self.stopped.is_set():
                        break
                    shown = None if reading is None else self.shown(reading)
                    if shown is not None:
                        with self.changed:
                            self.newest, self.count = shown, self.count + 1
                            self.changed.notify_all()
        except Exception as error:  # Whatever a source raises is told to who reads the camera.
            failure = error
        with self.changed:
            self.failure = failure
            self.changed.notify_all()

    def wait(self, beyond: int, timeout_s: float) -> bool:
        """Waits for more images than `beyond`, or for the end; False if neither comes. The caller has `changed`."""
        return self.changed.wait_for(lambda: self.count > beyond or self.failure is not None, timeout_s)

    def stop(self) -> bool:
        """Ends the thread; False where the source does not return."""
        self.stopped.set()
        self.thread.join(_END_S)
        return not self.thread.is_alive()


class DermisCamera(Camera):
    """A tactile array as a camera.

    Raises
    ------
    dermis.InputError
        The scene cannot be used.
    ValueError
        Width or height is no multiple of the scene's columns or rows.
    """

    def __init__(self, config: DermisCameraConfig):
        super().__init__(config)
        self.config = config
        self.scene = Scene.from_name(config.scene)
        self.height: int = config.height or self.scene.rows
        self.width: int = config.width or self.scene.cols
        for name, size, of, count in (
            ("height", self.height, "rows", self.scene.rows),
            ("width", self.width, "columns", self.scene.cols),
        ):
            if size % count:
                raise ValueError(f"{name} = {size} is not allowed; scene {self.scene.name} has {count} {of}, it must be a multiple")
        if self.height == 3:
            raise ValueError("height = 3 is not allowed: LeRobot would take the rows for channels; a multiple of it is right")
        self._stream: _Stream | None = None
        # A thread that was waiting for its source when it was disconnected.
        self._late: Thread | None = None
        self._handed: Reading | None = None
        self._warned = False

    def __str__(self) -> str:
        return f"{type(self).__name__}({self.config.scene}, {self.config.recording or self.config.source})"

    @property
    def is_connected(self) -> bool:
        """From `connect` to `disconnect`, also where the source has ended."""
        return self._stream is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Not available: a sensor on a port does not say what it is."""
        raise NotImplementedError("a tactile array cannot be found by itself: its scene and its source are configured")

    @check_if_already_connected
    def connect(self, warmup: bool = True) -> None:
        """Open recording, source and board, and begin to read.

        Parameters
        ----------
        warmup : bool, default True
            Wait for the first result, up to the configuration's `timeout_s`.

        Raises
        ------
        DeviceAlreadyConnectedError
        ConnectionError
            Something cannot be opened, or no result came; everything is closed again. Or the source of the connection before has
            not returned yet: two of them would share the sensor.
        """
        if self._late is not None and self._late.is_alive():
            raise ConnectionError(f"{self}: the source of the last connection has not returned yet")
        try:
            stream = self._opened()
        except Exception as error:
            raise ConnectionError(f"{self}: {error}") from error
        self._late, self._handed, self._warned = None, None, False
        stream.thread.start()
        if warmup:
            try:
                with stream.changed:
                    stream.wait(0, self.config.timeout_s)
                    count, failure = stream.count, stream.failure
                if not count:
                    raise ConnectionError(f"{self}: {failure or f'no result within {self.config.timeout_s} s'}") from failure
            except BaseException:  # Ctrl-C too leaves no thread.
                self._end(stream)
                raise
        self._stream = stream
        logger.info("%s connected.", self)

    @check_if_not_connected
    def read(self) -> NDArray[Any]:
        """The next image after the call, which waits for it up to 10 s.

        Raises
        ------
        DeviceNotConnectedError, TimeoutError
        RuntimeError
            The source has ended or failed.
        """
        return self._next(self._connected(), _READ_MS, fresh=True)

    @check_if_not_connected
    def async_read(self, timeout_ms: float = 200) -> NDArray[Any]:
        """The newest image that no call had yet, for which it waits up to `timeout_ms`.

        Raises
        ------
        DeviceNotConnectedError, TimeoutError
        RuntimeError
            There is no such image, and the source has ended or failed.
        """
        return self._next(self._connected(), timeout_ms, fresh=False)

    @check_if_not_connected
    def read_latest(self, max_age_ms: int = 500) -> NDArray[Any]:
        """The newest image, without waiting.

        Raises
        ------
        DeviceNotConnectedError
        TimeoutError
            It is older than `max_age_ms`.
        RuntimeError
            There is none yet, or the source has ended or failed.
        """
        stream = self._connected()
        with stream.changed:
            shown, failure = stream.newest, stream.failure
        if failure is not None:
            raise self._failed(failure)
        if shown is None:
            raise RuntimeError(f"{self}: there is no image yet")
        age_ms = 1e3 * (time.perf_counter() - shown.at_s)
        if age_ms > max_age_ms:
            raise TimeoutError(f"{self}: the newest image is {age_ms:.0f} ms old, at most {max_age_ms} ms are allowed")
        return self._image(shown)

    @property
    def reading(self) -> Reading | None:
        """Readings and result of the image that was read last: forces as numbers, for a robot that has them in its observation."""
        return self._handed

    def disconnect(self) -> None:
        """End the thread, and close source and board.

        A source that does not return within 2 s is left to a thread that closes it when it does; until then `connect` is refused.

        Raises
        ------
        DeviceNotConnectedError
        """
        stream, self._stream = self._stream, None
        if stream is None:
            raise DeviceNotConnectedError(f"{self} is not connected.")
        self._end(stream)
        self._handed = None
        logger.info("%s disconnected.", self)

    def _opened(self) -> _Stream:
        """A connection whose thread is not started; if it fails, nothing stays open."""
        config, stopped = self.config, Event()
        with ExitStack() as opened:
            if config.board is None:
                tracker = opened.enter_context(self.scene.tracker("fixed" if config.engine == "fixed" else "golden"))
                reconstruct: Callable[[Any], Reconstruction | None] = tracker.push
            else:
                reconstruct = opened.enter_context(Board(config.board, self.scene)).reconstruct
            if config.recording is not None:
                readings: Iterator[Any] = played(self.scene.load_frames(config.recording), config.fps, stopped)
            else:
                readings = of_function(config.source or "", self.scene)
            # Last opened, first closed; an iterator other than a generator may have nothing to close.
            close = getattr(readings, "close", None)
            if close is not None:
                opened.callback(close)
            return _Stream(str(self), stopped, readings, lambda reading: self._shown(reading, reconstruct), opened.pop_all())
        raise AssertionError  # Not reached; to a type checker, an ExitStack may hide an exception.

    def _shown(self, reading: Any, reconstruct: Callable[[Any], Reconstruction | None]) -> _Shown | None:
        """The image of a reading; None where a mean needs more of them."""
        result = reconstruct(reading)
        if result is None:
            return None
        of = Reading(_stress(reading), result)
        scale = self.config.full_scale
        if self.config.content == "stress":
            values, image = of.stress, stress_image(of.stress, scale)
        else:
            forces_N = result.forces_N
            if forces_N is None:
                raise ValueError("the result has no force for each taxel")
            values, image = forces_N, force_image(forces_N, scale)
        over = beyond(values, scale)
        if over and not self._warned:
            self._warned = True
            logger.warning("%s: %d taxels are beyond full_scale = %g, and are shown at its end", self, over, scale)
        return _Shown(image, of, time.perf_counter())

    def _next(self, stream: _Stream, timeout_ms: float, *, fresh: bool) -> NDArray[Any]:
        with stream.changed:
            had = stream.count if fresh else stream.given
            if not stream.wait(had, timeout_ms / 1e3):
                raise TimeoutError(f"{self}: no new image within {timeout_ms:g} ms")
            shown = stream.newest
            # Woken without a new image, since the source has ended or failed.
            if shown is None or stream.count == had:
                raise self._failed(stream.failure)
            stream.given = stream.count
        return self._image(shown)

    def _image(self, shown: _Shown) -> NDArray[np.uint8]:
        self._handed = shown.reading
        return enlarged(shown.image, self.height, self.width)

    def _connected(self) -> _Stream:
        if self._stream is None:
            raise DeviceNotConnectedError(f"{self} is not connected.")
        return self._stream

    def _failed(self, failure: Exception | None) -> RuntimeError:
        error = RuntimeError(f"{self}: {failure}")
        error.__cause__ = failure
        return error

    def _end(self, stream: _Stream) -> None:
        if not stream.stop():
            self._late = stream.thread
            logger.warning("%s: the source does not return; it is closed when it does", self)


def _stress(reading: Any) -> NDArray[np.float64]:
    """A reading as an array; it has been reconstructed, so that shape and type are right."""
    if isinstance(reading, Frame):
        return reading.stress_MPa
    mask = np.ma.getmaskarray(reading) if isinstance(reading, np.ma.MaskedArray) else False
    # None, as Tracker.push takes it too, becomes NaN here.
    return np.where(mask, np.nan, np.asarray(reading, dtype=np.float64))
