"""Simulated scenes with truth, evaluation of answers against the truth, and the attainable accuracy of a camera."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ._hzn import Camera, ConfigError, Report, Simulation, _design, _evaluate


def simulate(
    scene: str | PathLike[str] | Mapping[str, Any],
    *,
    frames: int | None = None,
    seed: int | None = None,
    camera: str | None = None,
) -> Simulation:
    """Simulate a flight: pictures with exact truth, and the matching sensor.

    Parameters
    ----------
    scene
        A built-in scene (``rocket``, ``rocket-clean``, ``leo-infrared``, ``thermal-array``, ``horace``,
        ``horace-wide``, ``full-disc``, ``sun-moon``, ``tumble``, ``atek``, ``jupiter``, ``enceladus``, ``saturn``,
        ``geo``), the path of a scene.toml, or its sections and keys as a dictionary.
    frames
        Number of pictures; it replaces the number in the scene.
    seed
        Seed of all random numbers; it replaces the seed in the scene.
    camera
        Name of a camera, if the scene has several (``[[cameras]]``).

    Returns
    -------
    Simulation
        A sequence of pictures, each rendered when it is accessed.

    Raises
    ------
    ConfigError
        The scene does not exist, or a key or value is refused; the message names the first one.

    Examples
    --------
    >>> flight = hzn.simulate("leo-infrared", frames=20)
    >>> reports = [flight.sensor.process(frame.image, **frame.known) for frame in flight]
    >>> hzn.evaluate(reports, flight)["evaluations"][0]["errors"]["rms_deg"]
    """
    return Simulation(scene, frames=frames, seed=seed, camera=camera)


def evaluate(
    results: str | PathLike[str] | Iterable[Report],
    truth: str | PathLike[str] | Simulation | Iterable[Mapping[str, Any]],
    *,
    camera: Camera | None = None,
) -> dict[str, Any]:
    """Compare results with the truth: shares, errors, consistency of the covariances. Every picture counts.

    Parameters
    ----------
    results
        A file that ``hzn run`` wrote (.mcap, .csv, .jsonl), or reports. Reports of arrays have no name, so they must be
        in the order of the truth.
    truth
        A truth.csv or its folder, a `Simulation`, rows of truth (`SimulatedFrame.truth`), or a data frame of them.
    camera
        Camera for the length of limb in view; not needed with an MCAP or a `Simulation`, which contain it.

    Returns
    -------
    dict
        ``evaluations``: a dictionary per body, as ``hzn evaluate -o report.json`` writes it (book/guide/evaluation.md;
        angles in degrees). ``frames``: a dictionary per picture, ready for ``pandas.json_normalize``.

    Raises
    ------
    HznError
        Results and truth do not belong together, or a file cannot be read.
    """
    if hasattr(results, "columns"):
        raise ConfigError("results: a table is refused; give the reports, or the file that `hzn run` wrote")
    if hasattr(truth, "to_dict"):
        # A data frame of truth.csv. Its empty cells are NaN.
        rows = truth.to_dict("records")
        truth = [{name: None if value != value else value for name, value in row.items()} for row in rows]
    if isinstance(truth, Simulation):
        camera = camera or Camera(**truth.parameters["camera"])
        truth = [row for frame in truth for row in frame.truth]
    return _evaluate(results, truth if isinstance(truth, str | PathLike) else list(truth), camera)


def sensitivity(
    *,
    altitude_km: float | Sequence[float],
    camera: Camera | None = None,
    fov_deg: float | Sequence[float] = 90.0,
    size: tuple[int, int] = (1920, 1080),
    lens: Literal["pinhole", "equidistant"] = "pinhole",
    depression_deg: float | Sequence[float] = 0.0,
    roll_deg: float | Sequence[float] = 0.0,
    radius_km: float | Sequence[float] = 6371.0088,
    limb_height_km: float | Sequence[float] = 17.0,
    limb_height_sigma_km: float | Sequence[float] = 7.0,
    altitude_sigma_km: float | Sequence[float] = 0.5,
    sigma_px: float | Sequence[float] = 1.0,
    correlation_px: float | Sequence[float] = 300.0,
) -> dict[str, NDArray[np.float64]]:
    """Compute the accuracy that a camera would have, without rendering, for every combination of the given values.

    Parameters
    ----------
    altitude_km
        Altitude above the sphere, km.
    camera
        Camera; it replaces ``fov_deg``, ``size`` and ``lens``.
    fov_deg
        Field of view across the width, degrees.
    size
        Width and height of the picture, pixels.
    lens
        Projection.
    depression_deg
        Angle of the optical axis below the horizontal, degrees; 90 looks straight down.
    roll_deg
        Rotation of the camera about its optical axis, degrees.
    radius_km
        Radius of the body, km.
    limb_height_km, limb_height_sigma_km
        Height of the visible limb and its 1-sigma, km.
    altitude_sigma_km
        1-sigma of the altitude, km.
    sigma_px, correlation_px
        1-sigma of an edge point, and the correlation length of the errors along the edge, pixels.

    Returns
    -------
    dict
        Columns of equal length, ready for a data frame: the values of each combination, then 1-sigma values in degrees
        (pitch in the plane of optical axis and body, roll perpendicular to it) with the half-angle ``free``, ``fused``
        with the half-angle from altitude and limb height, and ``known``. NaN if too little of the limb is in view.

    Raises
    ------
    ConfigError
        A value is refused; the message names it.
    """
    grid: dict[str, float | Sequence[float]] = {
        "altitude_km": altitude_km,
        "depression_deg": depression_deg,
        "roll_deg": roll_deg,
        "radius_km": radius_km,
        "limb_height_km": limb_height_km,
        "limb_height_sigma_km": limb_height_sigma_km,
        "altitude_sigma_km": altitude_sigma_km,
        "sigma_px": sigma_px,
        "correlation_px": correlation_px,
    }
    if camera is None:
        grid = {"fov_deg": fov_deg, **grid}
    columns: dict[str, list[float]] = {name: [] for name in [*grid, *_SIGMAS]}
    for values in product(*(np.atleast_1d(np.asarray(v, float)).tolist() for v in grid.values())):
        place = dict(zip(grid, values, strict=True))
        own = {name: value for name, value in place.items() if name != "fov_deg"}
        sigmas = _design(camera or _ideal(lens, size, place["fov_deg"]), **own)
        for name, value in place.items():
            columns[name].append(value)
        for name, (group, key) in _SIGMAS.items():
            group_values = (sigmas[group] if group else sigmas) if sigmas else {key: math.nan}
            columns[name].append(group_values[key])
    return {name: np.array(column) for name, column in columns.items()}


_SIGMAS = {
    "half_angle_deg": ("", "half_angle_deg"),
    "limb_px": ("", "limb_px"),
    **{f"{axis}_{fit}_deg": (fit, f"{axis}_deg") for fit in ("free", "fused", "known") for axis in ("pitch", "roll")},
}


def _ideal(lens: Literal["pinhole", "equidistant"], size: tuple[int, int], fov_deg: float) -> Camera:
    """Return a camera with an ideal lens and this field of view across the width."""
    max_fov_deg = {"pinhole": 175.0, "equidistant": 350.0}.get(lens)
    if max_fov_deg is None:
        raise ConfigError(f"lens: {lens!r} is refused: must be pinhole or equidistant")
    if not 0.0 < fov_deg <= max_fov_deg:
        raise ConfigError(f"fov_deg: {fov_deg} is refused: must be above 0 and at most {max_fov_deg:g} for this lens")
    width, height = size
    half = math.radians(fov_deg / 2)
    f_px = width / 2 / (math.tan(half) if lens == "pinhole" else half)
    # The image circle of an equidistant lens ends at 175 degrees off axis; corners beyond it are not used.
    is_cut = lens == "equidistant" and math.degrees(math.hypot(width, height) / 2 / f_px) > 175
    return Camera(
        width=width,
        height=height,
        model=lens,
        fx_px=f_px,
        fy_px=f_px,
        cx_px=(width - 1) / 2,
        cy_px=(height - 1) / 2,
        theta_max_deg=175.0 if is_cut else None,
    )
