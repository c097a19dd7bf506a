"""The cone that most rays agree on."""

from __future__ import annotations

from ._hzn import Cone as Cone
from ._hzn import Expected, Rays, Sensor, _keep, _withdraw


def keep(sensor: Sensor, rays: Rays, expected: Expected | None = None) -> Cone | None:
    """Reject outliers by the method of the sensor's ``[reject]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Points that cannot count get the weight 0.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.

    Returns
    -------
    Cone or None
        None when there is no such cone.
    """
    return _keep(sensor, rays, expected or sensor.expect())


def withdraw(sensor: Sensor, rays: Rays, found: Cone) -> int:
    """Leave out the points on the limb of another body, which was found before in the same picture.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Points within three times ``reject.threshold_px`` of that limb get the weight 0.
    found
        The other body's cone: ``Cone(fused.axis, fused.cos_half_angle)``.

    Returns
    -------
    int
        How many points these were. With more than half of them there `hzn.Sensor.process` tries the edge no further.
    """
    return _withdraw(sensor, rays, found)
