"""A robot without motors whose hand is a tactile array: as LeRobot's robots, and with the sum of the forces as numbers."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from lerobot.cameras import CameraConfig, make_cameras_from_configs
from lerobot.robots import Robot, RobotConfig

AXES = ("x", "y", "normal")


@RobotConfig.register_subclass("touch")
@dataclass(kw_only=True)
class TouchConfig(RobotConfig):
    cameras: dict[str, CameraConfig] = field(default_factory=dict)


class Touch(Robot):
    config_class = TouchConfig
    name = "touch"

    def __init__(self, config: TouchConfig):
        super().__init__(config)
        self.config = config
        self.cameras = make_cameras_from_configs(config.cameras)

    @cached_property
    def observation_features(self) -> dict[str, Any]:
        images = {name: (one.height, one.width, 3) for name, one in self.config.cameras.items()}
        return images | {f"{name}.force_{axis}_N": float for name in self.cameras for axis in AXES}

    def get_observation(self) -> dict[str, Any]:
        of: dict[str, Any] = {}
        for name, camera in self.cameras.items():
            of[name] = camera.async_read(timeout_ms=2000)
            # After the read, so that the numbers are those of the image.
            of |= {f"{name}.force_{axis}_N": float(value) for axis, value in zip(AXES, camera.reading.result.resultant_N)}
        return of

    @property
    def is_connected(self) -> bool:
        return all(camera.is_connected for camera in self.cameras.values())

    def connect(self, calibrate: bool = True) -> None:
        for camera in self.cameras.values():
            camera.connect()

    def disconnect(self) -> None:
        for camera in self.cameras.values():
            camera.disconnect()

    action_features: dict[str, type] = {}
    is_calibrated = True

    def calibrate(self) -> None: ...

    def configure(self) -> None: ...

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        return action
