"""Edge points as rays."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ._hzn import Rays as Rays
from ._hzn import Sensor, _rays


def of(sensor: Sensor, points: ArrayLike, lit: ArrayLike) -> Rays:
    """Take the lens away from points that were located elsewhere.

    Parameters
    ----------
    sensor
        Its camera is used.
    points
        Points (u, v) in order along their edge, shape (n, 2), pixels.
    lit
        For each the direction towards the light (u, v), of any length, shape (n, 2).

    Returns
    -------
    Rays
        With weight 1 where the lens sees the point, else 0.

    Raises
    ------
    ImageError
        Shapes that do not fit.
    """
    return _rays(sensor, points, lit)
