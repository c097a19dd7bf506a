"""Horizon sensing: from a picture of a planet's limb to the direction of the planet, with its covariance.

>>> sensor = hzn.Sensor.from_toml("sensor.toml")
>>> report = sensor.process(image, altitude_km=230.0)
>>> report.status, report.axis, report.covariance

Everything is in the camera frame (x right, y down, z forward) unless its name says otherwise; pixel centres are at
integers, as in OpenCV. Names end with their unit.
"""

from ._hzn import (
    Camera,
    ConfigError,
    HznError,
    ImageError,
    Report,
    Sensor,
    __version__,
    overlay,
    read_mcap,
)

__all__ = [
    "Camera",
    "ConfigError",
    "HznError",
    "ImageError",
    "Report",
    "Sensor",
    "__version__",
    "overlay",
    "read_mcap",
]
