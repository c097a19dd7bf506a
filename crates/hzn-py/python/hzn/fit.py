"""The fit of a cone to rays."""

from __future__ import annotations

from ._hzn import Cone, Expected, Rays, Sensor, _fit
from ._hzn import Fit as Fit


def cone(sensor: Sensor, rays: Rays, start: Cone, expected: Expected | None = None) -> Fit | None:
    """Fit a cone by the method of the sensor's ``[fit]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Points with a weight above 0 are fitted. Afterwards the rays have the weights of the fit.
    start
        From `hzn.consensus.keep`, or any other cone.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.

    Returns
    -------
    Fit or None
        None if the points do not determine a cone.
    """
    return _fit(sensor, rays, start, expected or sensor.expect())
