"""With all of LeRobot: its command line makes a robot with the camera, and its dataset has what the camera gave.

`make lerobot WHOLE=1` installs it; without PyTorch these tests are skipped.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="make lerobot WHOLE=1 installs all of LeRobot")

import dermis
import sources
from lerobot.configs import parser
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.robots import Robot, RobotConfig, make_robot_from_config
from lerobot.utils.import_utils import register_third_party_plugins
from lerobot_camera_dermis import force_image, forces_N_of
from touching import Touch

try:
    from lerobot.utils.feature_utils import build_dataset_frame, hw_to_dataset_features
except ImportError:  # Where they are in LeRobot 0.4.
    from lerobot.datasets.utils import build_dataset_frame, hw_to_dataset_features

register_third_party_plugins()

NAME = "eight-by-eight"
SCENE = dermis.Scene.from_name(NAME)
FULL_SCALE_N = 2.0
# Pixels of a taxel: the encoder of videos, SVT-AV1, ends the process where an image has but 8 × 8 of them in all.
BLOCK = 16
FRAMES = 5


@dataclass
class Settings:
    """As the programs of LeRobot have them."""

    robot: RobotConfig


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """Of a command line."""
    for k, stress in enumerate(sources.presses(SCENE, FRAMES)):
        (tmp_path / f"{k}.csv").write_text("\n".join(",".join(map(str, row)) for row in stress) + "\n")
    size = BLOCK * 8
    pad = f"{{type: dermis, scene: {NAME}, recording: {tmp_path}, full_scale: {FULL_SCALE_N}, fps: 4, width: {size}, height: {size}}}"
    arguments = [f"--robot.cameras={{pad: {pad}}}", "--robot.type=touch", f"--robot.calibration_dir={tmp_path / 'calibration'}"]
    monkeypatch.setattr(sys, "argv", ["lerobot-record", *arguments])

    @parser.wrap()
    def program(settings: Settings) -> Robot:
        return make_robot_from_config(settings.robot)

    return program()


def found() -> list[dermis.Reconstruction]:
    """What Dermis itself gives."""
    with SCENE.tracker() as tracker:
        return [tracker.push(stress) for stress in sources.presses(SCENE, FRAMES)]


def recorded(robot: Robot, root: Path, use_videos: bool) -> list[dict[str, Any]]:
    """The rows of an episode, read back."""
    features = hw_to_dataset_features(robot.observation_features, "observation", use_videos)
    dataset = LeRobotDataset.create("here/press", 4, features, root, robot_type=robot.name, use_videos=use_videos)
    robot.connect()
    for _ in range(FRAMES):
        dataset.add_frame(build_dataset_frame(features, robot.get_observation(), "observation") | {"task": "press"})
    robot.disconnect()
    dataset.save_episode()
    dataset.finalize()
    again = LeRobotDataset("here/press", root, video_backend="pyav")
    return [again[k] for k in range(len(again))]


def image_of(row: dict[str, Any]) -> np.ndarray:
    """The image of a row, which has its channels first and values up to 1."""
    return np.rint(row["observation.images.pad"].numpy().transpose(1, 2, 0) * 255).astype(np.uint8)


def test_a_dataset_of_images_has_every_pixel_and_the_forces_as_numbers(robot: Robot, tmp_path: Path) -> None:
    assert isinstance(robot, Touch)
    rows = recorded(robot, tmp_path / "set", use_videos=False)
    assert len(rows) == FRAMES == len({image_of(row).tobytes() for row in rows})
    for row, result in zip(rows, found(), strict=True):
        image = image_of(row)
        assert np.array_equal(image, np.kron(force_image(result.forces_N, FULL_SCALE_N), np.ones((BLOCK, BLOCK, 1), dtype=np.uint8)))
        assert np.array_equal(row["observation.state"].numpy(), np.float32(result.resultant_N))


def test_a_video_keeps_the_forces_to_a_tenth_of_the_scale(robot: Robot, tmp_path: Path) -> None:
    rows = recorded(robot, tmp_path / "set", use_videos=True)
    off = []
    for row, result in zip(rows, found(), strict=True):
        # The middle of each taxel's block.
        blocks = image_of(row).reshape(8, BLOCK, 8, BLOCK, 3)[:, BLOCK // 4 : -BLOCK // 4, :, BLOCK // 4 : -BLOCK // 4]
        off.append(np.abs(forces_N_of(blocks.mean(axis=(1, 3)), FULL_SCALE_N) - result.forces_N).max())
        # The numbers are not in the video.
        assert np.array_equal(row["observation.state"].numpy(), np.float32(result.resultant_N))
    # Measured: 8 %. Half a step of the image itself is below 0.4 %.
    assert 0.004 * FULL_SCALE_N < max(off) < 0.1 * FULL_SCALE_N, off
