"""A tactile array as a camera of LeRobot, type "dermis": the force on each taxel as an image.

LeRobot's programs import this package by its name, as every installed distribution that begins with `lerobot_camera_`; that registers
the type. `config` has what a robot's configuration says, `image` the scale of the pixels, `source` where readings come from, `camera`
the camera.
"""

from .camera import DermisCamera, Reading
from .config import DermisCameraConfig
from .image import force_image, forces_N_of, stress_image

__all__ = ["DermisCamera", "DermisCameraConfig", "Reading", "force_image", "forces_N_of", "stress_image"]
