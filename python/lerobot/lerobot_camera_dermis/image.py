"""Images of 8 bits, as LeRobot stores them, of forces and stress.

| channel | of forces | of stress |
|---|---|---|
| red | x: 128 + 127·Fx/S | 255·σ/S |
| green | y: 128 + 127·Fy/S | the same |
| blue | normal: 255·Fn/S | the same |

S is the full scale; values are rounded, and those beyond it are held at its end: shear between 1 and 255, the others between 0 and 255.
So a force is exact to S/254 of the shear and S/510 of the normal component, half a step. What falls below zero, a normal force that
pulls, is 0, and so is the stress of a missing reading.

In: forces (rows, cols, 3) in N, or stress (rows, cols). Out: (rows, cols, 3) of uint8, row 0 at the top.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["beyond", "enlarged", "force_image", "forces_N_of", "stress_image"]

_STEPS = np.array([127.0, 127.0, 255.0])
_ZERO = np.array([128.0, 128.0, 0.0])
_LOWEST = np.array([1.0, 1.0, 0.0])


def force_image(forces_N: NDArray[np.float64], full_scale_N: float) -> NDArray[np.uint8]:
    """The image of the forces on each taxel."""
    levels = np.rint(_ZERO + _STEPS * forces_N / full_scale_N)
    return np.clip(levels, _LOWEST, 255.0).astype(np.uint8)


def forces_N_of(image: NDArray[np.uint8], full_scale_N: float) -> NDArray[np.float64]:
    """The forces that an image of a pixel for each taxel shows; those that were held at an end are there."""
    forces_N: NDArray[np.float64] = (image - _ZERO) * full_scale_N / _STEPS
    return forces_N


def stress_image(stress: NDArray[np.float64], full_scale: float) -> NDArray[np.uint8]:
    """The grey image of stress; NaN, a missing reading, is black."""
    levels = np.clip(np.rint(255.0 * np.nan_to_num(stress, nan=0.0) / full_scale), 0.0, 255.0)
    return np.repeat(levels.astype(np.uint8)[..., np.newaxis], 3, axis=-1)


def beyond(values: NDArray[np.float64], full_scale: float) -> int:
    """How many taxels are beyond the scale and lose more than a rounding: forces (rows, cols, 3) or stress (rows, cols)."""
    over = values > full_scale
    if values.ndim == 3:
        over[..., :2] |= values[..., :2] < -full_scale
        over = np.any(over, axis=-1)
    return int(np.count_nonzero(over))


def enlarged(image: NDArray[np.uint8], height: int, width: int) -> NDArray[np.uint8]:
    """Each taxel as a block of equal pixels; always a new array, which its reader may change."""
    rows, cols = image.shape[:2]
    return image.repeat(height // rows, axis=0).repeat(width // cols, axis=1)
