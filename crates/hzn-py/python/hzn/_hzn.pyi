"""Classes over the sensor that the command line has too."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_Path: TypeAlias = str | PathLike[str]
_Image: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]
_Status: TypeAlias = Literal[
    "ok",
    "no-limb",
    "too-dark",
    "too-bright",
    "too-few-points",
    "ambiguous",
    "rejected",
    "truncated",
    "unreadable",
]

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

__version__: str

class HznError(ValueError):
    """Base of hzn's exceptions."""

class ConfigError(HznError):
    """A sensor, a calibration or a frame's own data that cannot be; the message names the field."""

class ImageError(HznError):
    """An array that is no picture, or not one of this camera."""

@final
class Camera:
    """A lens: from directions to pixels and back.

    Directions are in the camera frame (x right, y down, z forward); pixel centres are at integers.
    """

    @staticmethod
    def from_toml(path: _Path) -> Camera:
        """Read ``[camera]`` of a sensor.toml.

        Raises
        ------
        ConfigError
            The first thing wrong with the file: file, line, field, limit.
        """

    @staticmethod
    def from_kalibr(path: _Path, *, camera: str | None = None) -> Camera:
        """Read a Kalibr camchain (or a EuRoC sensor.yaml).

        Parameters
        ----------
        camera
            Which camera of the chain, such as ``"cam1"``; without it the first.

        Raises
        ------
        ConfigError
            A file or a lens that is not known.
        """

    @staticmethod
    def from_opencv(path: _Path) -> Camera:
        """Read OpenCV's calibration YAML.

        Raises
        ------
        ConfigError
            A file or a lens that is not known.
        """

    @property
    def width(self) -> int:
        """Columns of the picture."""

    @property
    def height(self) -> int:
        """Rows of the picture."""

    @property
    def model(self) -> Literal["kannala-brandt", "equidistant", "pinhole", "brown-conrady"]:
        """The projection."""

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Camera matrix, shape (3, 3), pixels."""

    @property
    def k(self) -> list[float]:
        """Coefficients of the lens, as sensor.toml has them."""

    def project(self, rays: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pixels of directions.

        Parameters
        ----------
        rays
            Directions in the camera frame, shape (n, 3), of any length.

        Returns
        -------
        numpy.ndarray
            Points (u, v) in pixels, shape (n, 2); NaN where the lens does not see.
        """

    def unproject(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Directions of pixels.

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            Unit vectors in the camera frame, shape (n, 3); NaN outside of the image circle.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class Sensor:
    """A horizon sensor.

    One sensor may be used from many threads at once: the answers are the same as from one.
    """

    def __new__(cls, parameters: Mapping[str, Any], *, flight: bool = False) -> Sensor:
        """Make a sensor of the sections and keys of a sensor.toml.

        Parameters
        ----------
        parameters
            As `Sensor.parameters` gives them; only ``camera`` must be there.
        flight
            Single precision and 2048 points, as on the flight computer.

        Raises
        ------
        ConfigError
            The first key or value that is refused, with its limit.
        """

    @staticmethod
    def from_toml(path: _Path, *, flight: bool = False) -> Sensor:
        """Read a sensor.toml.

        Raises
        ------
        ConfigError
            The first thing wrong with the file: file, line, field, limit.
        """

    @property
    def parameters(self) -> dict[str, Any]:
        """Every parameter, as sections and keys of sensor.toml. A copy: make another sensor of it to change one."""

    @property
    def camera(self) -> Camera:
        """The lens."""

    @property
    def flight(self) -> bool:
        """Single precision, as on the flight computer?"""

    def process(
        self,
        image: _Image,
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        time_s: float | None = None,
        bits: int | None = None,
        detail: bool = False,
    ) -> Report:
        """Find the limb in a picture.

        Parameters
        ----------
        image
            Shape (height, width) or (height, width, channels), uint8 or uint16. Not copied when it is C-contiguous.
        altitude_km
            Above WGS-84 for ``earth``, else above the radius; without it, that of the parameters.
        position_km
            Position of the camera in ECEF; it beats the altitude.
        attitude
            Prior attitude, quaternion (w, x, y, z) that takes the camera frame to ECEF.
        attitude_sigma_deg
            1-sigma of that attitude; without it, 5.
        time_s
            UTC in seconds since 1970. With a position it gives `Report.axis_ecef` of Sun and Moon.
        bits
            Significant bits of uint16, 8 to 16; without it, 16.
        detail
            Keep edges, points and times of the stages.

        Raises
        ------
        ImageError
            Another dtype, shape or size than the camera's.
        ConfigError
            An altitude, position or attitude that cannot be.
        """

    def process_each(
        self,
        image: _Image,
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        time_s: float | None = None,
        bits: int | None = None,
        detail: bool = False,
    ) -> list[Report]:
        """As `process`, for a sensor of several bodies: a report of each, in the order of the parameters."""

    def __eq__(self, other: object, /) -> bool: ...

@final
class Report:
    """What was found in one picture. Without an answer the properties of the answer are None."""

    @property
    def status(self) -> _Status:
        """Outcome."""

    @property
    def ok(self) -> bool:
        """Is there an answer?"""

    @property
    def stage(self) -> str:
        """The stage that was reached."""

    @property
    def detail(self) -> str:
        """Why there is no answer, in words; empty beside ``ok``."""

    @property
    def axis(self) -> NDArray[np.float64] | None:
        """Unit vector to the body in the camera frame, shape (3,)."""

    @property
    def axis_ecef(self) -> NDArray[np.float64] | None:
        """The same direction in ECEF, shape (3,), when the position is known."""

    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """Covariance of the axis on its tangent plane, shape (3, 3) of rank 2, rad²."""

    @property
    def sigma_max_deg(self) -> float | None:
        """The larger of the axis' two standard deviations, degrees."""

    @property
    def half_angle_deg(self) -> float | None:
        """Half-angle of the body from the free fit, degrees."""

    @property
    def altitude_km(self) -> float | None:
        """The altitude that was given, or that of the position, kilometres."""

    @property
    def altitude_est_km(self) -> float | None:
        """The altitude that follows from the free fit, kilometres."""

    @property
    def altitude_est_sigma_km(self) -> float | None:
        """Its standard deviation, kilometres."""

    @property
    def rms_px(self) -> float | None:
        """Weighted RMS distance of the inliers from the fitted limb, pixels."""

    @property
    def edge_points(self) -> int | None:
        """Sub-pixel edge points that were measured."""

    @property
    def dropped(self) -> int | None:
        """Border pixels dropped because a list was full."""

    @property
    def level(self) -> int | None:
        """Level between dark and lit in the picture's own counts."""

    @property
    def elapsed_us(self) -> float | None:
        """Time of processing, microseconds."""

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """Edges that were looked at: length_px, points, inliers, rms_px, verdict."""

    @property
    def limb(self) -> list[NDArray[np.float64]]:
        """The fitted limb in the picture as lines of points (u, v), each of shape (n, 2), pixels."""

    @property
    def edges(self) -> list[NDArray[np.float64]]:
        """Border pixels of the edges, each of shape (n, 2). Needs ``detail=True``."""

    @property
    def inliers(self) -> NDArray[np.float64]:
        """Edge points (u, v) that carry the answer, shape (n, 2), pixels. Needs ``detail=True``."""

    @property
    def rejected(self) -> NDArray[np.float64]:
        """Edge points (u, v) that were rejected, shape (n, 2), pixels. Needs ``detail=True``."""

    @property
    def stages_us(self) -> dict[str, float]:
        """Time of each stage, microseconds. Needs ``detail=True``."""

    def to_dict(self) -> dict[str, Any]:
        """The row that ``hzn run`` would write, by its columns; None for an empty cell."""

def overlay(image: _Image, report: Report, *, bits: int | None = None) -> NDArray[np.uint8]:
    """Draw what a report stands on over its picture: limb and axis, with ``detail=True`` edges and points too.

    Returns
    -------
    numpy.ndarray
        RGB, shape (height, width, 3), uint8.
    """

def read_mcap(path: _Path) -> dict[str, NDArray[Any]]:
    """Read the results of a recording as columns, ready for ``pandas.DataFrame`` or ``polars.DataFrame``.

    Returns
    -------
    dict
        One array a column, of equal length; NaN in empty cells.

    Raises
    ------
    HznError
        The file cannot be read, or is no MCAP.
    """
