"""The threshold between dark and lit pixels."""

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
    """Find the threshold by the method of the sensor's ``[threshold]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    image
        As for `hzn.Sensor.process`.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.
    bits
        Number of significant bits of uint16.

    Returns
    -------
    int
        Threshold in counts; a pixel is lit at this value or above.

    Raises
    ------
    HznError
        There is no threshold: too-dark, too-bright, or no-limb if the picture has no dark and bright part.
    ImageError
        The array is no picture, or not one of this camera.
    """
    return _level(sensor, image, expected or sensor.expect(), bits)
