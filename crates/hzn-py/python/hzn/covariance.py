"""The covariance of a fit, with the expected half-angle fused."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._hzn import Cone, Expected, Rays, Sensor, _fuse


class Fused(NamedTuple):
    """The answer of a fit. `hzn.Sensor.process` also tests whether it is a limb at all (``[gates]``)."""

    axis: NDArray[np.float64]
    """Unit vector to the body in the camera frame, shape (3,)."""
    covariance: NDArray[np.float64]
    """Covariance of the axis on its tangent plane, shape (3, 3) of rank 2, rad²."""
    cos_half_angle: float
    """Cosine of the half-angle."""


def fuse(sensor: Sensor, rays: Rays, fit: Cone, expected: Expected | None = None) -> Fused | None:
    """Compute the covariance from the correlated edge errors (``[covariance]``), and fuse the expected half-angle.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Points of the fit, with their weights.
    fit
        From `hzn.fit.cone`, or another fitted cone with a free half-angle.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.

    Returns
    -------
    Fused or None
        None if the points do not determine it.
    """
    fused = _fuse(sensor, rays, fit, expected or sensor.expect())
    return None if fused is None else Fused(*fused)
