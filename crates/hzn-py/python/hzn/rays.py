"""Edge points as rays."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ._hzn import Rays as Rays
from ._hzn import Sensor, _rays


def of(sensor: Sensor, points: ArrayLike, lit: ArrayLike) -> Rays:
    """Convert edge points that were located elsewhere to rays.

    Parameters
    ----------
    sensor
        Its camera is used.
    points
        Points (u, v) in order along their edge, shape (n, 2), pixels.
    lit
        Direction (u, v) from each point to its lit side, of any length, shape (n, 2).

    Returns
    -------
    Rays
        Rays with weight 1 inside the field of view of the lens, and weight 0 outside.

    Raises
    ------
    ImageError
        The shapes do not match.
    """
    return _rays(sensor, points, lit)
