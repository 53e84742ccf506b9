"""Sources as users write them: functions of the scene, named "sources:NAME" in a configuration."""

import time
from collections.abc import Iterator
from threading import Event, Semaphore
from typing import Any

import numpy as np
from dermis import Scene

# Set by a test when `waiting` or `stalling` is to go on; one for each reading of `asked`; what was closed, in its order.
GO_ON = Event()
ASKED = Semaphore(0)
CLOSED: list[str] = []
# A pause longer than a result takes, so that a reader sees every image.
PAUSE_S = 0.02


def presses(scene: Scene, count: int) -> list[np.ndarray]:
    """A press that grows."""
    press = scene.generate([{"shape": "hertz-circle", "size_mm": [6], "normal_N": 4, "tangential_N": [0.8, -0.4]}])
    return [press.stress_MPa * (k + 1) / count for k in range(count)]


def steady(scene: Scene) -> Iterator[Any]:
    """Never ends."""
    try:
        while True:
            for stress in presses(scene, 5):
                time.sleep(PAUSE_S)
                yield stress
    finally:
        CLOSED.append("steady")


def asked(scene: Scene) -> Iterator[Any]:
    """Five readings, each when the test asks for it."""
    for stress in presses(scene, 5):
        while not ASKED.acquire(timeout=0.05):
            yield None
        yield stress


def three(scene: Scene) -> Iterator[Any]:
    """Ends after three readings, of which the last has a missing taxel."""
    one, two, last = presses(scene, 3)
    yield from (one, None, two.tolist())
    last[1, 3] = np.nan
    yield np.ma.masked_invalid(last)


def stalling(scene: Scene) -> Iterator[Any]:
    """Nothing comes after the first reading until the test says so; it returns in between, as a read with a time limit does."""
    one, two = presses(scene, 2)
    yield one
    while not GO_ON.wait(0.01):
        yield None
    yield two
    while True:
        time.sleep(0.01)
        yield None


def waiting(scene: Scene) -> Iterator[Any]:
    """As `stalling`, but it does not return."""
    try:
        yield presses(scene, 1)[0]
        GO_ON.wait(30)
        yield presses(scene, 1)[0]
    finally:
        CLOSED.append("waiting")


def turned(scene: Scene) -> Iterator[Any]:
    """The second reading has another shape."""
    yield presses(scene, 1)[0]
    yield np.zeros((2, 3))


def wrong(scene: Scene) -> Iterator[Any]:
    """The first reading has another shape."""
    try:
        yield np.zeros((2, 3))
    finally:
        CLOSED.append("wrong")


def unplugged(scene: Scene) -> Iterator[Any]:
    """Fails as a port does."""
    yield presses(scene, 1)[0]
    raise OSError("the port is gone")


def silent(scene: Scene) -> Iterator[Any]:
    """Gives nothing."""
    while True:
        time.sleep(0.01)
        yield None


def refusing(scene: Scene) -> Iterator[Any]:
    """Cannot be opened."""
    raise PermissionError("the port is in use")


not_a_function = 3
