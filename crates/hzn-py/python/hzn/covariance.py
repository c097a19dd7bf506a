"""The covariance of a fit, with the expected half-angle fused."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._hzn import Cone, Expected, Rays, Sensor, _fuse


class Fused(NamedTuple):
    """The answer of a fit. `hzn.Sensor.process` also asks whether it is a limb at all (``[select]``)."""

    axis: NDArray[np.float64]
    """Unit vector to the body in the camera frame, shape (3,)."""
    covariance: NDArray[np.float64]
    """Its covariance on the tangent plane, shape (3, 3) of rank 2, rad²."""
    cos_half_angle: float
    """cos of the half-angle."""


def fuse(sensor: Sensor, rays: Rays, fit: Cone, expected: Expected | None = None) -> Fused | None:
    """Weigh the correlated errors of the edge by the sensor's ``[covariance]``, and fuse the expected half-angle.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        The points of the fit, with their weights.
    fit
        From `hzn.fit.cone`; or a cone that was fitted otherwise, its half-angle freely.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.

    Returns
    -------
    Fused or None
        None when the points do not determine it.
    """
    fused = _fuse(sensor, rays, fit, expected or sensor.expect())
    return None if fused is None else Fused(*fused)
