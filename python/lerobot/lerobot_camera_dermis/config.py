"""What a robot's configuration says of a tactile array, under `cameras:`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lerobot.cameras.configs import CameraConfig

__all__ = ["DermisCameraConfig"]


@CameraConfig.register_subclass("dermis")
@dataclass(kw_only=True)
class DermisCameraConfig(CameraConfig):
    """A tactile array, type "dermis".

    Parameters
    ----------
    scene : str
        Name of a built-in scene, or path of a scene.
    full_scale : float
        Force on a taxel in N, or with content "stress" the reading (MPa), of the brightest pixel.
    recording, source : str
        One of both: a file or folder of frames, which is played at its times; or "module:function", of which function(scene) gives
        readings, such as of a sensor (see `source`).
    board : str, optional
        Port of a board, as for `dermis.Board`, which reconstructs the readings in place of this computer.
    content : "force" or "stress", default "force"
        What the image shows.
    engine : "golden" or "fixed", default "golden"
        As for `dermis.Scene.tracker`.
    timeout_s : float, default 5
        How long `connect` waits for the first result.
    fps : int, optional
        Frames per second, which LeRobot asks of the cameras of a robot. Frames of a recording without times are played at this rate;
        a source goes at its own.
    width, height : int, optional
        Of the image, multiples of the scene's columns and rows; default: a pixel for each taxel.
    """

    scene: str
    full_scale: float
    recording: str | None = None
    source: str | None = None
    board: str | None = None
    content: str = "force"
    engine: str = "golden"
    timeout_s: float = 5.0

    def __post_init__(self) -> None:
        for name in ("full_scale", "timeout_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value} is not allowed; it must be above 0")
        for name in ("fps", "width", "height"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ValueError(f"{name} = {value} is not allowed; it must be 1 or more")
        for name, allowed in (("content", ("force", "stress")), ("engine", ("golden", "fixed"))):
            value = getattr(self, name)
            if value not in allowed:
                raise ValueError(f"{name} = {value!r} is not allowed; it must be {allowed[0]!r} or {allowed[1]!r}")
        if (self.recording is None) == (self.source is None):
            raise ValueError(f"recording = {self.recording!r}, source = {self.source!r}: exactly one of both must be given")
        if self.source is not None and not all(self.source.partition(":")):
            raise ValueError(f"source = {self.source!r} is not allowed; it must be 'module:function'")
        if self.board is not None and self.engine != "golden":
            raise ValueError(f"engine = {self.engine!r} is not allowed beside board, which reconstructs itself")
