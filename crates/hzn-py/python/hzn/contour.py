"""Edges between dark and lit, and sub-pixel points on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._hzn import Expected, Rays, Sensor, _borders, _pick


def find(
    sensor: Sensor,
    image: NDArray[np.uint8] | NDArray[np.uint16],
    level: int,
    expected: Expected | None = None,
    *,
    bits: int | None = None,
) -> list[NDArray[np.float64]]:
    """Follow every edge that has at least ``candidates.min_points`` border pixels.

    Parameters
    ----------
    sensor
        Its ``[contour]``, ``[candidates]`` and ``[mask]`` are used.
    image
        As for `hzn.Sensor.process`.
    level
        A pixel is lit at this value or above, in counts.
    expected
        Sets how far search lines are apart; without it, from the parameters alone, for the first body.
    bits
        Significant bits of uint16.

    Returns
    -------
    list of numpy.ndarray
        Border pixels (x, y) of each edge in order along it, the lit side on the left, each of shape (n, 2); the edges in
        the order in which `hzn.Sensor.process` looks at them, the likeliest first. It stops at none: neither at the limb
        nor at ``[limits]``.

    Raises
    ------
    ImageError
        An array that is no picture, or not one of this camera.
    """
    return _borders(sensor, image, level, expected or sensor.expect(), bits)


def points(
    sensor: Sensor,
    image: NDArray[np.uint8] | NDArray[np.uint16],
    level: int,
    border: ArrayLike,
    *,
    bits: int | None = None,
) -> Rays:
    """Locate the edge to a part of a pixel, by the method of the sensor's ``[candidates]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    image
        As for `hzn.Sensor.process`.
    level
        As for `find`.
    border
        Border pixels (x, y) in order along the edge, shape (n, 2).
    bits
        Significant bits of uint16.

    Returns
    -------
    Rays
        ``candidates.keep_points`` of them at most, evenly along the edge.

    Raises
    ------
    ImageError
        A picture or a border that cannot be.
    """
    return _pick(sensor, image, level, border, bits)
