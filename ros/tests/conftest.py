"""What the tests share: a node on the loopback whose patches take their frames from named pipes, and the programs."""

import json
import os
import random
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

ROWS, COLS, PITCH_MM = 8, 6, (4.0, 3.0)
SCENE = f"""
[sensor]
rows = {ROWS}
cols = {COLS}
pitch_x_mm = {PITCH_MM[0]}
pitch_y_mm = {PITCH_MM[1]}
thickness_mm = 3.0
[search]
estimator = "search"
"""
# A result that comes so late after its frame is lost.
PATIENCE_S = 60.0


def run(program: str, *arguments: str, text: str = "", code: int = 0) -> subprocess.CompletedProcess[str]:
    """Runs DERMIS or DERMIS_ROS, which `make ros` names."""
    done = subprocess.run([os.environ[program], *arguments], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done


def frame(number: int) -> np.ndarray:
    """A press that moves, on every second frame; values with full mantissas."""
    if number % 2:
        return np.zeros((ROWS, COLS))
    y, x = np.mgrid[0:ROWS, 0:COLS]
    row, col = 3.3 + 1.5 * np.sin(number / 50), 2.4 + np.cos(number / 31)
    away = ((y - row) / 2.2) ** 2 + ((x - col) / 1.9) ** 2
    return np.sqrt(np.maximum(0.0, 1.0 - away)) / 7 * (1 + (x - col) / 20)


def line(number: int, values: np.ndarray | None = None) -> str:
    """Its line, with a time of its own that names it."""
    time_ns = 1_700_000_000_000_000_000 + number * 10_000_000
    values = frame(number) if values is None else values
    return json.dumps({"time_ns": time_ns, "stress_MPa": values.ravel().tolist()}) + "\n"


def expected(scene: Path, lines: str) -> dict[int, dict[str, Any]]:
    """What `dermis reconstruct` says of the lines, by their times."""
    done = run("DERMIS", "reconstruct", str(scene), "--stream", "--all", "--check-every", "0", text=lines)
    return {result["time_ns"]: result for result in map(json.loads, done.stdout.splitlines())}


def free_port() -> int:
    with socket.socket() as own:
        own.bind(("127.0.0.1", 0))
        return int(own.getsockname()[1])


def free_domain() -> int:
    """A domain of DDS in which nobody of this computer is."""
    for domain in random.sample(range(1, 200), 100):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            try:
                own.bind(("127.0.0.1", 7400 + 250 * domain + 10))
            except OSError:
                continue
            return domain
    raise AssertionError("all domains are taken")


class Node:
    """A node that runs."""

    def __init__(self, folder: Path, patches: str, node: str = "", carrier: str = "zenoh") -> None:
        self.folder, self.carrier, self.port, self.domain, self.said = folder, carrier, free_port(), free_domain(), []
        (folder / "scene.toml").write_text(SCENE)
        self.file = folder / "hand.toml"
        place = f'domain = {self.domain}\nconnect = []\nlisten = ["tcp/127.0.0.1:{self.port}"]\ncarrier = "{carrier}"\n'
        self.file.write_text(f"[node]\n{place}{node}\n{patches}")
        for name in self.pipes(patches):
            os.mkfifo(folder / name)
        command = [os.environ["DERMIS_ROS"], str(self.file)]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        self.wait_for("workers, at tcp/127.0.0.1" if carrier == "zenoh" else f"workers, at DDS domain {self.domain} on 127.0.0.1")

    @staticmethod
    def pipes(patches: str) -> list[str]:
        """The sources that are named pipes."""
        sources = [own.split('"')[1] for own in patches.splitlines() if own.startswith("source")]
        return [own for own in sources if own.endswith(".pipe")]

    def read(self) -> None:
        assert self.process.stderr is not None
        for own in self.process.stderr:
            self.said.append(own)

    def wait_for(self, words: str) -> None:
        """Waits until the node says so."""
        until = time.monotonic() + PATIENCE_S
        while not any(words in own for own in self.said):
            assert time.monotonic() < until and self.process.poll() is None, (words, self.said)
            time.sleep(0.01)

    def end(self) -> None:
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(PATIENCE_S) == 0, self.said
        self.reader.join()


@contextmanager
def node(folder: Path, patches: str, fields: str = "", carrier: str = "zenoh") -> Iterator[Node]:
    own = Node(folder, patches, fields, carrier)
    try:
        yield own
        own.end()
    finally:
        own.process.kill()


def feed(pipe: Path, lines: list[str], rate_Hz: float, answered: Callable[[], int] | None = None, window: int = 1) -> None:
    """Writes lines into a pipe, no faster than the rate; of a patch of which `answered` counts the results at most `window` are on the
    way, so that a slow computer drops none, unless a result is lost for a second."""
    with pipe.open("w") as file:
        begun, before = time.monotonic(), answered() if answered else 0
        for number, own in enumerate(lines):
            time.sleep(max(0.0, begun + number / rate_Hz - time.monotonic()))
            until = time.monotonic() + 1.0
            while answered and number - (answered() - before) >= window and time.monotonic() < until:
                time.sleep(0.001)
            file.write(own)
            file.flush()
        # The end of the pipe is no frame.
        time.sleep(0.5)


def wait(condition: Any) -> None:
    """Waits until a condition holds."""
    until = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)
