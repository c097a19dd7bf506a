"""The cone that most rays agree on."""

from __future__ import annotations

from ._hzn import Cone as Cone
from ._hzn import Expected, Rays, Sensor, _keep


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
