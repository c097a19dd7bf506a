"""The level between dark and lit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._hzn import Expected, Sensor, _level


def level(
    sensor: Sensor,
    image: NDArray[np.uint8] | NDArray[np.uint16],
    expected: Expected | None = None,
    *,
    bits: int | None = None,
) -> int:
    """Find the level by the method of the sensor's ``[binarize]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    image
        As for `hzn.Sensor.process`.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.
    bits
        Significant bits of uint16.

    Returns
    -------
    int
        A pixel is lit at this value or above, in counts.

    Raises
    ------
    HznError
        No level: too-dark, too-bright, or no-limb when there are no two sides.
    ImageError
        An array that is no picture, or not one of this camera.
    """
    return _level(sensor, image, expected or sensor.expect(), bits)
