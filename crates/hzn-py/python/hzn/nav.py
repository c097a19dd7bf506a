"""Navigation: the whole attitude and the position, from directions, inertial unit and satellite navigation.

Attitudes are rotation matrices from the frame of the vehicle (body) to ECEF; mounts are rotation matrices from the camera
to the body. Lengths are in metres, angles in radians, times in seconds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _hzn

_Array = NDArray[np.float64]


def _list(values: ArrayLike, shape: tuple[int, ...], name: str) -> Any:
    array = np.asarray(values, dtype=float)
    if array.shape != shape:
        raise _hzn.ConfigError(f"{name}: the shape is {array.shape}, but {shape} is expected")
    return array.tolist()


def _array(values: object) -> _Array:
    return np.asarray(values, dtype=np.float64)


def triad(first: tuple[ArrayLike, ArrayLike], second: tuple[ArrayLike, ArrayLike]) -> _Array | None:
    """Return the attitude from two directions (TRIAD).

    Parameters
    ----------
    first
        The more accurate direction: in the body and in the reference frame, shape (3,) each. It is met exactly.
    second
        The other direction; it gives the rotation about the first.

    Returns
    -------
    numpy.ndarray or None
        Rotation from body to reference, shape (3, 3); None if the directions are closer than 2 degrees.
    """
    both = [[_list(v, (3,), "direction") for v in pair] for pair in (first, second)]
    found = _hzn._triad(*both)
    return None if found is None else _array(found)


def wahba(body: ArrayLike, reference: ArrayLike, sigma_rad: ArrayLike) -> tuple[_Array, _Array, float] | None:
    """Return the attitude that fits two or more directions best (Wahba's problem, by Davenport's q method).

    Parameters
    ----------
    body
        Directions in the frame of the vehicle, shape (n, 3).
    reference
        The same directions in the reference frame, shape (n, 3).
    sigma_rad
        1-sigma of each direction, shape (n,), rad.

    Returns
    -------
    tuple or None
        Rotation from body to reference, shape (3, 3); covariance of its rotation vector in the reference frame, shape
        (3, 3), rad²; sum of the squared misfits over their variances. None if the directions do not determine it.
    """
    sigmas = np.asarray(sigma_rad, dtype=float)
    shape = (len(sigmas), 3)
    pairs = zip(_list(body, shape, "body"), _list(reference, shape, "reference"), sigmas.tolist(), strict=True)
    found = _hzn._wahba(list(pairs))
    return None if found is None else (_array(found[0]), _array(found[1]), found[2])


def sun(unix_s: float) -> _Array:
    """Return the position of the Sun in ECEF, shape (3,), metres, at a UTC in seconds since 1970; good to 0.01 degrees."""
    return _array(_hzn._celestial(False, unix_s))


def moon(unix_s: float) -> _Array:
    """Return the position of the Moon in ECEF, shape (3,), metres, at a UTC in seconds since 1970; good to 0.1 degrees."""
    return _array(_hzn._celestial(True, unix_s))


@dataclass(frozen=True)
class Innovation:
    """A measurement against the filter's prediction."""

    value: _Array
    """Measured minus predicted: two numbers for a direction (rad), three for others."""
    covariance: _Array
    """Its covariance."""
    nis: float
    """The square of the innovation over its covariance."""
    taken: bool
    """Whether it passed the gate and moved the state."""


def _innovation(found: tuple[list[float], list[list[float]], float, bool] | None) -> Innovation | None:
    return None if found is None else Innovation(_array(found[0]), _array(found[1]), found[2], found[3])


class Filter:
    """The error-state Schmidt-Kalman filter, as it flies.

    Parameters
    ----------
    time_s
        Time of the start.
    attitude, velocity, position
        The state at the start: shapes (3, 3), (3,), (3,); velocity and position in ECEF.
    attitude_sigma_rad, velocity_sigma, position_sigma
        1-sigma of each component.
    mounts
        The told mount of each camera, shape (3, 3) each; at most four.
    settings
        Sections and keys of a fuse.toml that differ from the defaults; cameras have the names "0", "1", ...

    Raises
    ------
    ConfigError
        A matrix is no rotation, a setting is refused, or there are more than four cameras.
    """

    def __init__(
        self,
        time_s: float,
        attitude: ArrayLike,
        velocity: ArrayLike,
        position: ArrayLike,
        *,
        attitude_sigma_rad: float = 0.0349,
        velocity_sigma: float = 1.0,
        position_sigma: float = 30.0,
        mounts: Sequence[ArrayLike] = (),
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        self._filter = _hzn._Filter(
            time_s,
            _list(attitude, (3, 3), "attitude"),
            _list(velocity, (3,), "velocity"),
            _list(position, (3,), "position"),
            [attitude_sigma_rad, velocity_sigma, position_sigma],
            [_list(mount, (3, 3), "mounts") for mount in mounts],
            dict(settings or {}),
        )

    def predict(self, time_s: float, gyro: ArrayLike, accel: ArrayLike, *, saturated: bool = False) -> str:
        """Move the state to a sample of the inertial unit: rates (rad/s) and specific forces (m/s²), vehicle.

        Returns ``taken``, ``first``, ``gap``, ``duplicate``, ``out-of-order`` or ``not-finite``.
        """
        return self._filter.predict(time_s, _list(gyro, (3,), "gyro"), _list(accel, (3,), "accel"), saturated)

    def update_direction(
        self,
        camera: int,
        measured: ArrayLike,
        reference: ArrayLike,
        covariance: ArrayLike,
        by_limb_height: ArrayLike = (0.0, 0.0, 0.0),
        is_limb: bool = False,
        common: ArrayLike | None = None,
    ) -> Innovation | None:
        """Take a direction of a camera at the time of the state.

        Parameters
        ----------
        camera
            Number of the camera.
        measured
            Unit vector in the camera frame, for example `hzn.Report.axis`.
        reference
            The same direction in ECEF, for example `hzn.Report.axis_fixed`.
        covariance
            Its covariance, shape (3, 3), rad².
        by_limb_height
            Derivative of the measured direction by the limb height, 1/km.
        is_limb
            Whether it is the axis of the Earth's limb; it matters only if the settings have
            ``limb_height.latitude_sigma_km``.
        common
            The part of the covariance whose error is the same in the next picture, shape (3, 3), rad²: the columns
            ``cov_common_*``. The filter takes it as the slow error and the rest as white noise. Without it, the
            whole covariance is the slow error.

        Returns
        -------
        Innovation or None
            None if there is no such camera, a number is not finite, or the covariance has a negative variance. The
            rounding of a covariance to single precision does no harm.
        """
        return _innovation(
            self._filter.update_direction(
                camera,
                _list(measured, (3,), "measured"),
                _list(reference, (3,), "reference"),
                _list(covariance, (3, 3), "covariance"),
                _list(by_limb_height, (3,), "by_limb_height"),
                is_limb,
                None if common is None else _list(common, (3, 3), "common"),
            )
        )

    def update_position(self, position: ArrayLike, sigma: float) -> Innovation | None:
        """Take a position in ECEF, with the 1-sigma of each component."""
        return _innovation(self._filter.update_position(_list(position, (3,), "position"), sigma))

    def update_velocity(self, velocity: ArrayLike, sigma: float) -> Innovation | None:
        """Take a velocity relative to the Earth in ECEF, with the 1-sigma of each component."""
        return _innovation(self._filter.update_velocity(_list(velocity, (3,), "velocity"), sigma))

    def update_attitude(self, attitude: ArrayLike, sigma_rad: float) -> Innovation | None:
        """Take an attitude, for example of a star tracker, with the 1-sigma about each axis."""
        return _innovation(self._filter.update_attitude(_list(attitude, (3, 3), "attitude"), sigma_rad))

    @property
    def time_s(self) -> float:
        """Time of the state."""
        return self._filter.state()[0]

    @property
    def attitude(self) -> _Array:
        """Rotation from the vehicle's frame to ECEF, shape (3, 3)."""
        return _array(self._filter.state()[1])

    @property
    def velocity(self) -> _Array:
        """Velocity relative to the Earth in ECEF, shape (3,), m/s."""
        return _array(self._filter.state()[2])

    @property
    def position(self) -> _Array:
        """Position in ECEF, shape (3,), m."""
        return _array(self._filter.state()[3])

    @property
    def covariance(self) -> _Array:
        """Covariance of all errors, shape (n, n): attitude (rotation vector in ECEF, rad), velocity, position, then others."""
        return _array(self._filter.covariance())

    @property
    def gyro_bias(self) -> _Array:
        """Estimated bias of the gyros, shape (3,), rad/s."""
        return _array(self._filter.biases()[0])

    @property
    def accel_bias(self) -> _Array:
        """Estimated bias of the accelerometers, shape (3,), m/s²."""
        return _array(self._filter.biases()[1])

    def mount(self, camera: int) -> _Array | None:
        """Return the estimated mount of a camera, shape (3, 3); None if there is no such camera."""
        found = self._filter.mount(camera)
        return None if found is None else _array(found)


def fuse(
    recordings: Sequence[str | PathLike[str]],
    *,
    imu: str | PathLike[str],
    gnss: str | PathLike[str] | None = None,
    attitude: str | PathLike[str] | None = None,
    directions: Sequence[str | PathLike[str]] = (),
    mounts: Mapping[str, ArrayLike] | None = None,
    clocks: Mapping[str, float] | None = None,
    columns: Sequence[str] = (),
    utc: str | None = None,
    settings: Mapping[str, Any] | None = None,
    smooth: bool = False,
    rate_hz: float = 10.0,
) -> dict[str, Any]:
    """Replay a flight, as ``hzn fuse`` does.

    Parameters
    ----------
    recordings
        Results of ``hzn run``, one file for each camera (.mcap, .csv, .jsonl); the name of a camera is that of its file.
    imu, gnss, attitude
        Tables of the inertial unit, the receiver and a star tracker, with the columns of ``hzn fuse``; the file of the
        receiver may be NMEA 0183 or an orbit ephemeris message (OEM). With a star tracker, the attitude needs neither a receiver nor recordings; without a
        receiver the position is not known.
    directions
        Tables of other sensors of a direction (magnetometer, Sun sensor, antenna) with the columns of ``hzn fuse
        --direction``; the name of a sensor is that of its file.
    mounts
        Mounts by the name of the camera, shape (3, 3), instead of those of the recordings.
    clocks
        Seconds to add to the times of a camera, by its name.
    columns
        Columns with other names or units, as ``--map`` of ``hzn fuse``: ``["imu:time=t_us,us"]``.
    utc
        UTC of time 0, such as ``"2019-06-13T04:00:00Z"``, from which the times of NMEA and OEM count.
    settings
        Sections and keys of a fuse.toml that differ from the defaults.
    smooth
        Also smooth.
    rate_hz
        Most solutions a second.

    Returns
    -------
    dict
        ``states`` and ``innovations`` are lists of dictionaries with the names of the results of ``hzn fuse``, for
        ``pandas.DataFrame`` for example; ``cameras``, ``notes``, ``restarts``, ``start_s``. ``verdict`` is
        ``"consistent"``, ``"doubtful"`` or ``"contradicts"``, and ``findings`` is a list of dictionaries with ``level``,
        ``source`` and ``what``: what contradicts what, the likeliest cause first. ``solved`` is None.

    Raises
    ------
    ConfigError
        A file, a mount or a setting is refused, or no two directions give a first attitude.
    """
    wanted = (smooth, False, False)
    tables = (columns, utc)
    return _replay(recordings, imu, gnss, attitude, directions, mounts, clocks, tables, settings, wanted, rate_hz)


def solve(
    recordings: Sequence[str | PathLike[str]],
    *,
    imu: str | PathLike[str] | None = None,
    gnss: str | PathLike[str] | None = None,
    attitude: str | PathLike[str] | None = None,
    directions: Sequence[str | PathLike[str]] = (),
    mounts: Mapping[str, ArrayLike] | None = None,
    clocks: Mapping[str, float] | None = None,
    columns: Sequence[str] = (),
    utc: str | None = None,
    settings: Mapping[str, Any] | None = None,
    points: bool = False,
    rate_hz: float = 10.0,
) -> dict[str, Any]:
    """Solve a whole flight at once, as ``hzn fuse --solve`` does.

    The result is the most probable flight: attitude, velocity and position at every measurement, with mounts, clocks,
    biases and limb height, from all measurements together. A measurement that is too far off counts less and is not
    refused.

    Without ``imu`` and ``gnss``, gravity joins the pictures of a satellite: limbs and the attitudes of a star tracker
    then give its orbit.

    Parameters
    ----------
    recordings, imu, gnss, attitude, directions, mounts, clocks, columns, utc, settings, rate_hz
        The same as for `fuse`; only here may ``imu`` be left out.
    points
        Use what all edge points of a limb say, the cone that was fitted to them with a free half-angle, instead of the
        axis that the told altitude and limb height were fused into. It needs recordings with their sensor.toml, as in
        MCAP, and a receiver.

    Returns
    -------
    dict
        That of `fuse`; the states with ``phase`` ``"smoothed"`` are those of the solve. ``solved`` is a dictionary with
        ``unknowns``, ``knots``, ``steps``, ``is_converged`` and ``cost`` (before and after); ``determined`` is a list
        with ``name``, ``unit``, ``estimate``, ``sigma`` and ``before``, the sigma of what was known before: where
        ``sigma`` is far below it, the flight has determined the value. ``limb_share`` has the shares of the
        unknown limb height in the variance of a limb's direction, before, and in that of the attitude; None if it is
        known. ``lowered`` is a list of the measurements that count less: ``time_s``, ``camera``, ``kind``, ``sigmas``,
        ``weight``. ``orbit`` is None with an inertial unit; else a dictionary with ``semi_axis_m``, ``eccentricity``
        and ``inclination_rad`` at the end, and ``sigma_m`` and ``bound_m``: 1-sigma of the position
        radial, along and across the orbit, and its Cramér-Rao bound.

    Raises
    ------
    ConfigError
        A file, a mount or a setting is refused, or no two directions give a first attitude.
    """
    wanted = (False, True, points)
    tables = (columns, utc)
    return _replay(recordings, imu, gnss, attitude, directions, mounts, clocks, tables, settings, wanted, rate_hz)


def _replay(
    recordings: Sequence[str | PathLike[str]],
    imu: str | PathLike[str] | None,
    gnss: str | PathLike[str] | None,
    attitude: str | PathLike[str] | None,
    directions: Sequence[str | PathLike[str]],
    mounts: Mapping[str, ArrayLike] | None,
    clocks: Mapping[str, float] | None,
    tables: tuple[Sequence[str], str | None],
    settings: Mapping[str, Any] | None,
    wanted: tuple[bool, bool, bool],
    rate_hz: float,
) -> dict[str, Any]:
    result: dict[str, Any] = _hzn._fuse_flight(
        [str(path) for path in recordings],
        None if imu is None else str(imu),
        None if gnss is None else str(gnss),
        None if attitude is None else str(attitude),
        {name: _list(mount, (3, 3), f"mounts[{name!r}]") for name, mount in (mounts or {}).items()},
        dict(clocks or {}),
        (list(tables[0]), tables[1]),
        [str(path) for path in directions],
        dict(settings or {}),
        wanted,
        rate_hz,
    )
    return result
