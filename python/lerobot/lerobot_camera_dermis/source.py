"""Where readings come from: a recording that is played, or a function of one's own.

A function takes the scene and gives an iterable, as a generator does. Each item is what `dermis.Tracker.push` takes, an array of
(rows, cols) or a `dermis.Frame`; or None, which says that nothing came yet. A function that waits for a sensor gives None at least
every second: between two items the camera sees that it is to disconnect. It then closes the iterable, which ends a `with` block of a
generator, in the thread that reads it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from itertools import pairwise
from threading import Event
from typing import Any

from dermis import Frame, Scene

__all__ = ["of_function", "played"]


def of_function(name: str, scene: Scene) -> Iterator[Any]:
    """The readings of "module:function"."""
    module, _, attribute = name.partition(":")
    function: Callable[[Scene], Any] | None = getattr(import_module(module), attribute, None)
    if function is None:
        raise ImportError(f"module {module} has no {attribute}")
    return iter(function(scene))


def played(frames: Sequence[Frame], fps: int | None, stopped: Event) -> Iterator[Frame]:
    """Frames at their times of acquisition, from the first, which comes at once; at `fps` where they have none.

    Ends early when `stopped` is set.
    """
    times = [frame.time_ns for frame in frames]
    if not times:
        raise ValueError("there are no frames")
    known = [time_ns for time_ns in times if time_ns is not None]
    if len(known) == len(times):
        for index, (before, after) in enumerate(pairwise(known)):
            if after <= before:
                raise ValueError(f"frame {index + 1} has the time {after} ns, the one before {before} ns")
        due = [(time_ns - known[0]) / 1e9 for time_ns in known]
    elif fps is not None:
        due = [index / fps for index in range(len(times))]
    else:
        raise ValueError(f"frame {times.index(None)} has no time; fps says how many there are in a second")
    return _at(due, frames, stopped)


def _at(due_s: Sequence[float], frames: Sequence[Frame], stopped: Event) -> Iterator[Frame]:
    yield frames[0]
    # The engine builds its model with the first frame, which takes longer than the others: the clock begins when that is done.
    start = time.monotonic()
    for due, frame in zip(due_s[1:], frames[1:], strict=True):
        if stopped.wait(max(0.0, start + due - time.monotonic())):
            return
        yield frame
