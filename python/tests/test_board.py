"""A board: a simulated one on a pseudo-terminal, whose forces are those of the bit-true model."""

import os
import subprocess
import time
from collections.abc import Iterator

import numpy as np
import pytest

import dermis
from conftest import ROOT

SCENE = "eight-by-eight"
# The board that the tests of `dermis host` have simulated before.
BOARD = "icebreaker"


def scene_on_the_board() -> dermis.Scene:
    """The scene with that board, as --target-board gives it."""
    text = (ROOT / "golden" / "scenes" / f"{SCENE}.toml").read_text()
    return dermis.Scene.from_toml(f'{text}\n[hardware]\nboard = "{BOARD}"\n', SCENE)


@pytest.fixture
def port() -> Iterator[str]:
    """The port of `dermis board`."""
    command = [os.environ["DERMIS"], "--build-dir", str(ROOT / "build"), "board", SCENE, "--target-board", BOARD]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as board:
        yield board.stdout.readline().strip()
        board.kill()


def test_a_core_behind_ethernet_answers_and_says_when_it_had_the_frame() -> None:
    command = [os.environ["DERMIS"], "board", SCENE, "--udp", "127.0.0.1:0"]
    scene = dermis.Scene.from_name(SCENE)
    stress = scene.generate(random=1, seed=2)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as core:
        address = core.stdout.readline().strip()
        assert address.startswith("udp:127.0.0.1:")
        with dermis.Board(address, scene, check=True, cross_check=0) as board:
            for _ in range(3):
                before = time.time_ns()
                result = board.reconstruct(stress)
                # On the loopback a frame takes less than a millisecond; a busy machine may take longer.
                assert before - 10**8 < result.time_ns < time.time_ns() + 10**8
                assert np.array_equal(result.forces_N, scene.reconstruct(stress, "fixed", cross_check=0).forces_N)
        core.kill()


def test_a_board_answers_every_frame(port: str) -> None:
    scene = scene_on_the_board()
    stress = [np.random.default_rng(seed).random((scene.rows, scene.cols)) * 0.1 for seed in range(3)]

    def sensor() -> Iterator[np.ndarray]:
        yield from stress

    with dermis.Board(port, scene, check=True, cross_check=1, timeout_s=5) as board:
        answers = board.stream(sensor())
        assert iter(answers) is answers
        for frame, answer in zip(stress, answers, strict=True):
            model = scene.reconstruct(frame, "fixed", cross_check=1)
            assert np.array_equal(answer.forces_N, model.forces_N)
            assert (answer.engine, answer.contacts, answer.flags) == ("board", None, model.flags)
        again = board.reconstruct(stress[0])
        assert np.array_equal(again.forces_N, scene.reconstruct(stress[0], "fixed", cross_check=0).forces_N)
        assert board.link_errors == (0, 0)
        with pytest.raises(dermis.InputError, match="frame: wanted one frame"):
            board.reconstruct(np.stack(stress))
        with pytest.raises(dermis.InputError, match="frames has shape"):
            next(board.stream([np.zeros((2, 3))]))
        with pytest.raises(dermis.BoardError, match=f"{port}: "):
            dermis.Board(port, scene)
    with pytest.raises(dermis.BoardError, match="the board is closed"):
        board.reconstruct(stress[0])
    # A frame minus itself as tare is zero.
    pressed = scene.generate(random=1, seed=2)
    with dermis.Board(port, scene, tare=pressed, timeout_s=5) as tared:
        assert "no-contact" in tared.reconstruct(pressed).flags
    with pytest.raises(dermis.BoardError, match="built for another scene"):
        dermis.Board(port, dermis.Scene.from_name("sensor-1"), timeout_s=5)


def test_what_is_no_board_is_named() -> None:
    scene = scene_on_the_board()
    with pytest.raises(dermis.BoardError, match="/dev/absent: ") as error:
        dermis.Board("/dev/absent", scene)
    assert isinstance(error.value, OSError)
    with pytest.raises(dermis.InputError, match="timeout_s = -1"):
        dermis.Board("/dev/absent", scene, timeout_s=-1)
    spi = dermis.Scene.from_name(str(ROOT / "sim" / "tests" / "scenes" / "tiny-spi.toml"))
    with pytest.raises(dermis.InputError, match="SPI|spi"):
        dermis.Board("/dev/absent", spi)
