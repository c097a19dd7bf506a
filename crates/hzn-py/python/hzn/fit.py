"""The cone fitted to rays."""

from __future__ import annotations

from ._hzn import Cone, Expected, Rays, Sensor, _fit
from ._hzn import Fit as Fit


def cone(sensor: Sensor, rays: Rays, start: Cone, expected: Expected | None = None) -> Fit | None:
    """Fit a cone by the method of the sensor's ``[estimate]``.

    Parameters
    ----------
    sensor
        Its parameters are used.
    rays
        Those with a weight are fitted; afterwards each has the weight that it had in the fit.
    start
        From `hzn.consensus.keep`, or one's own.
    expected
        From `hzn.Sensor.expect`; without it, from the parameters alone.

    Returns
    -------
    Fit or None
        None when the points do not determine a cone.
    """
    return _fit(sensor, rays, start, expected or sensor.expect())
