"""Edges between dark and lit pixels, and sub-pixel edge points."""

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
    """Follow every edge that has at least ``edge_points.min_points`` border pixels.

    Parameters
    ----------
    sensor
        Its ``[contour]``, ``[edge_points]`` and ``[mask]`` are used.
    image
        As for `hzn.Sensor.process`.
    level
        A pixel is lit at this value or above, in counts.
    expected
        The distance of the search lines depends on it. From `hzn.Sensor.expect`; without it, from the parameters alone,
        for the first body.
    bits
        Number of significant bits of uint16.

    Returns
    -------
    list of numpy.ndarray
        Border pixels (x, y) of each edge in order along it, the lit side on the left, each of shape (n, 2). The edges
        are in the order in which `hzn.Sensor.process` examines them, the most likely first. All edges are returned: the
        search does not stop at the limb or at ``[limits]``.

    Raises
    ------
    ImageError
        The array is no picture, or not one of this camera.
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
    """Locate the edge with sub-pixel accuracy, by the method of the sensor's ``[edge_points]``.

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
        Number of significant bits of uint16.

    Returns
    -------
    Rays
        At most ``edge_points.keep_points`` points, evenly along the edge.

    Raises
    ------
    ImageError
        The picture or the border is invalid.
    """
    return _pick(sensor, image, level, border, bits)
