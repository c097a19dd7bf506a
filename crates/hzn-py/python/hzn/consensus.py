"""The cone that most rays agree on."""

from __future__ import annotations

from ._hzn import Cone as Cone
from ._hzn import Expected, Rays, Sensor, _keep, _withdraw


def keep(sensor: Sensor, rays: Rays, expected: Expected | None = None) -> Cone | None:
    """Reject outliers by the method of the sensor's ``[consensus]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Points that are rejected get the weight 0.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.

    Returns
    -------
    Cone or None
        None if no cone is found.
    """
    return _keep(sensor, rays, expected or sensor.expect())


def withdraw(sensor: Sensor, rays: Rays, found: Cone) -> int:
    """Exclude the points on the limb of another body that was found before in the same picture.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Points within three times ``consensus.threshold_px`` of that limb get the weight 0.
    found
        Cone of the other body: ``Cone(fused.axis, fused.cos_half_angle)``.

    Returns
    -------
    int
        Number of these points. If they are more than half of all, `hzn.Sensor.process` gives up the edge.
    """
    return _withdraw(sensor, rays, found)
