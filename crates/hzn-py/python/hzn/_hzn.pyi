"""Classes over the sensor that the command line has too. Their docstrings are written here, and compiled into the module."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from types import TracebackType
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

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
    "no-altitude",
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

    Directions are in the camera frame (x right, y down, z forward); pixel centres are at integers, as in OpenCV.
    ``Camera(width=..., height=..., model=..., fx_px=..., fy_px=..., cx_px=..., cy_px=..., k=[...])`` takes the keys of
    ``[camera]`` in sensor.toml.
    """

    def __new__(cls, **keys: Any) -> Camera: ...
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
        path
            The YAML file.
        camera
            Which camera of the chain, such as ``"cam1"``; without it the first.

        Raises
        ------
        ConfigError
            A file or a lens that is not known.
        """

    @staticmethod
    def from_opencv(
        source: _Path | ArrayLike,
        distortion: ArrayLike | None = None,
        *,
        size: tuple[int, int] | None = None,
        fisheye: bool = False,
    ) -> Camera:
        """Take an OpenCV calibration: its YAML file, or camera matrix and coefficients.

        Parameters
        ----------
        source
            Path of the YAML file, or the camera matrix K, shape (3, 3), pixels.
        distortion
            D: 4 or 5 coefficients k1, k2, p1, p2, k3; with ``fisheye`` k1 to k4. Without it an ideal pinhole.
        size
            Width and height of the picture, pixels; K does not say it.
        fisheye
            K and D are of ``cv2.fisheye``.

        Raises
        ------
        ConfigError
            A file or a lens that is not known; which argument.
        """

    @property
    def parameters(self) -> dict[str, Any]:
        """The keys of ``[camera]`` in sensor.toml. A copy."""

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

    def project(self, rays: ArrayLike) -> NDArray[np.float64]:
        """Pixels of directions.

        Parameters
        ----------
        rays
            Directions in the camera frame, shape (n, 3), of any length.

        Returns
        -------
        numpy.ndarray
            Points (u, v) in pixels, shape (n, 2); NaN where the lens does not see.

        Raises
        ------
        ImageError
            Another shape.
        """

    def unproject(self, points: ArrayLike) -> NDArray[np.float64]:
        """Directions of pixels.

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            Unit vectors in the camera frame, shape (n, 3); NaN outside of the image circle.

        Raises
        ------
        ImageError
            Another shape.
        """

    def undistort_points(self, points: ArrayLike) -> NDArray[np.float64]:
        """Points on the plane z = 1, as ``cv2.undistortPoints`` and ``cv2.fisheye.undistortPoints`` give them.

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            (x / z, y / z) of their rays, shape (n, 2); NaN outside of the image circle and from 90 degrees off axis on,
            where there is no such point: `unproject` has no such limit.

        Raises
        ------
        ImageError
            Another shape.
        """

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """Derivatives of the unit rays by (u, v).

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            Shape (n, 3, 2), radians a pixel: rows x, y, z of the ray, columns u, v. NaN outside of the image circle.

        Raises
        ------
        ImageError
            Another shape.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class Sensor:
    """A horizon sensor.

    ``Sensor(camera=..., body=..., preset=...)`` takes the sections of a sensor.toml as dictionaries; for ``camera`` a
    `Camera` will do, and only it must be there. ``preset`` is ``"hzn"``, ``"dlr-2022"``, ``"zju-2022"``,
    ``"horace-2015"``, ``"sun"`` or ``"moon"``. ``flight=True`` calculates in single precision with 2048 points, as on the
    flight computer. A key or value that is refused is a `ConfigError` with its name and limit.

    One sensor may be used from many threads at once: the answers are the same as from one. It can be copied and pickled.

    Examples
    --------
    >>> sensor = hzn.Sensor(camera=hzn.Camera.from_kalibr("camchain.yaml"), body={"altitude_km": 230.0})
    """

    def __new__(cls, *, flight: bool = False, **sections: Any) -> Sensor: ...
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
        """Every parameter, as sections and keys of sensor.toml.

        What is read is a copy: change it and set it again. A set that is refused (`ConfigError`) leaves everything as it
        was; calls under way in other threads end with the parameters that they began with.

        Examples
        --------
        >>> parameters = sensor.parameters
        >>> parameters["reject"]["threshold_px"] = 2.0
        >>> sensor.parameters = parameters
        """

    @parameters.setter
    def parameters(self, sections: dict[str, Any], /) -> None: ...
    @property
    def camera(self) -> Camera:
        """The lens."""

    @property
    def flight(self) -> bool:
        """Single precision, as on the flight computer?"""

    def expect(
        self,
        *,
        body: int = 0,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        rate_rad_s: Sequence[float] | None = None,
        time_s: float | None = None,
    ) -> Expected:
        """Work out the cone to expect, for the single stages (`hzn.consensus` and its neighbours).

        Parameters
        ----------
        body
            Of a sensor of several bodies the number of one, from 0: the stages that are told so work for this one, with its
            own level and edge errors.
        altitude_km, position_km, attitude, attitude_sigma_deg, rate_rad_s, time_s
            As in `process`.

        Raises
        ------
        ConfigError
            A body that the sensor does not have; an altitude, position or attitude that cannot be.
        """

    def process(
        self,
        image: _Image,
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        rate_rad_s: Sequence[float] | None = None,
        time_s: float | None = None,
        bits: int | None = None,
        detail: bool = False,
    ) -> Report:
        """Find the limb in a picture.

        Parameters
        ----------
        image
            Shape (height, width) or (height, width, channels), uint8 or uint16, of any strides. It is not copied; in C
            order it is read fastest.
        altitude_km
            Above WGS-84 for ``earth``, else above the radius; without it, that of the parameters.
        position_km
            Position of the camera in ECEF, shape (3,); it beats the altitude.
        attitude
            Prior attitude, quaternion (w, x, y, z) that takes the camera frame to ECEF.
        attitude_sigma_deg
            1-sigma of that attitude; without it, 5.
        rate_rad_s
            Rate of rotation of the camera in its own axes, rad/s, shape (3,); with a rolling shutter (`camera.readout_s`).
        time_s
            UTC in seconds since 1970. With a position it gives `Report.axis_ecef` of Sun and Moon.
        bits
            Significant bits of uint16, 8 to 16; without it, the sensor's `input.bits`, else 16. Where nothing is found and the
            upper bits are unused, a warning says so.
        detail
            Keep edges, points and times of the stages.

        Returns
        -------
        Report
            Of a sensor of several bodies that of the first; `Report.others` has the rest. Below the limb height, where every
            rocket begins, its status is ``no-altitude``.

        Raises
        ------
        ImageError
            Another dtype, shape or size than the camera's.
        ConfigError
            An altitude, position or attitude that cannot be.
        """

    def process_many(
        self,
        images: _Path | Iterable[_Image | _Path | tuple[_Image, Mapping[str, Any]]],
        *,
        jobs: int | None = None,
        progress: bool = False,
    ) -> Iterator[Report]:
        """Process a sequence on all cores. Reports come in order while it runs; memory does not grow with its length.

        Parameters
        ----------
        images
            A folder, a pattern, a video or an MCAP, taken as ``hzn run`` takes it, with the frames.csv beside it; or paths
            of pictures; or arrays; or pairs of an array and a dictionary of what `process` is told besides
            (``altitude_km`` and so on). Of an iterable no more is taken than is being worked on: by each thread some
            milliseconds' work or 8 MB, a picture at least.
        jobs
            Threads; without it, one a core. With ``binarize.method = "track"`` there is only one.
        progress
            Show a bar (needs the package tqdm).

        Yields
        ------
        Report
            One a picture. A picture file that cannot be read has the status ``unreadable`` and its reason in
            `Report.detail`; an array that is refused raises as in `process`, after the reports before it.

        Raises
        ------
        ConfigError
            Nothing there, or a frames.csv that is wrong.
        KeyboardInterrupt
            Within a frame's time; the pictures that were begun are finished first.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class Report:
    """What was found in one picture. Without an answer the properties of the answer are None.

    A notebook shows it with the picture (the array that was processed, as it is now) and everything drawn over it. It can
    be pickled; the picture stays behind.
    """

    @property
    def index(self) -> int:
        """Place in the sequence, from 0."""

    @property
    def file(self) -> str:
        """Name of the picture; empty for an array."""

    @property
    def time_s(self) -> float | None:
        """Time of the picture, seconds; None where frames.csv gives times, but none of this picture."""

    @property
    def body(self) -> str:
        """Kind of the body, as in sensor.toml."""

    @property
    def status(self) -> _Status:
        """Outcome."""

    @property
    def ok(self) -> bool:
        """Is there an answer?"""

    @property
    def stage(self) -> str:
        """The stage that was reached; empty when it was read from a recording."""

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
    def roll_deg(self) -> float | None:
        """Roll of the vehicle, degrees; with a mounting."""

    @property
    def pitch_deg(self) -> float | None:
        """Pitch of the vehicle, degrees; with a mounting."""

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
    def others(self) -> list[Report]:
        """Of a sensor of several bodies, the reports of those after the first."""

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """The first 16 edges that were looked at, the chosen one always among them: length_px, points, inliers, rms_px,
        verdict."""

    @property
    def limb(self) -> list[NDArray[np.float64]]:
        """The fitted limb in the picture as lines of points (u, v), each of shape (n, 2), pixels."""

    @property
    def edges(self) -> list[NDArray[np.float64]]:
        """Border pixels of the edges, each of shape (n, 2). Needs ``detail=True`` (`HznError`)."""

    @property
    def inliers(self) -> NDArray[np.float64]:
        """Edge points (u, v) that carry the answer, shape (n, 2), pixels. Needs ``detail=True`` (`HznError`)."""

    @property
    def rejected(self) -> NDArray[np.float64]:
        """Edge points (u, v) that were rejected, shape (n, 2), pixels. Needs ``detail=True`` (`HznError`)."""

    @property
    def rays(self) -> NDArray[np.float64]:
        """Unit rays of the inliers in the camera frame, shape (n, 3). Needs ``detail=True`` (`HznError`)."""

    @property
    def stages_us(self) -> dict[str, float]:
        """Time of each stage, microseconds. Needs ``detail=True`` (`HznError`)."""

    def to_dict(self) -> dict[str, Any]:
        """The row that ``hzn run`` would write, by its columns; None for an empty cell."""

    def __copy__(self) -> Report: ...
    def __deepcopy__(self, _memo: Any, /) -> Report: ...

def overlay(image: _Image, report: Report, *, bits: int | None = None) -> NDArray[np.uint8]:
    """Draw what a report stands on over its picture: limb and axis, with ``detail=True`` edges and points too.

    Parameters
    ----------
    image
        The picture, as for `Sensor.process`.
    report
        Its report.
    bits
        Significant bits of uint16.

    Returns
    -------
    numpy.ndarray
        RGB, shape (height, width, 3), uint8.

    Raises
    ------
    ImageError
        An array that is no picture.
    """

def read_mcap(path: _Path) -> dict[str, NDArray[Any]]:
    """Read the results of a recording as columns, ready for ``pandas.DataFrame`` or ``polars.DataFrame``.

    Returns
    -------
    dict
        One array a column, of equal length; NaN in empty cells. Columns and units: book/reference/files.md.

    Raises
    ------
    HznError
        The file cannot be read, or is no MCAP.
    """

def open_mcap(path: _Path) -> Recording:
    """Open a recording to go through its frames, one after another; memory does not grow with its length.

    Raises
    ------
    HznError
        The file cannot be read, or is no MCAP.

    Examples
    --------
    >>> with hzn.open_mcap("flight.mcap") as recording:
    ...     for frame in recording:
    ...         print(frame.report.file, frame.report.status)
    """

@final
class Recording:
    """A recording that is being read, from `open_mcap`. It is an iterator of its frames, and a context manager."""

    @property
    def sensor_toml(self) -> str | None:
        """Text of the sensor.toml that it was made with."""

    @property
    def metadata(self) -> dict[str, str]:
        """Versions and settings of the run."""

    def sensor(self) -> Sensor:
        """Make the sensor that it was made with.

        Raises
        ------
        HznError
            It holds no sensor.toml.
        """

    def close(self) -> None:
        """Close the file. To read on is an `HznError`."""

    def __iter__(self) -> Recording: ...
    def __next__(self) -> Frame: ...
    def __enter__(self) -> Recording: ...
    def __exit__(
        self,
        *_exception: type[BaseException] | BaseException | TracebackType | None,
    ) -> None: ...

@final
class Frame:
    """A frame of a recording."""

    @property
    def image(self) -> _Image | None:
        """The picture, shape (height, width) or (height, width, channels), decoded anew at each access; None when it was
        left out.

        Raises
        ------
        ImageError
            It cannot be decoded.
        """

    @property
    def report(self) -> Report:
        """What was found in it."""

@final
class Simulation:
    """A flight that is rendered frame by frame when it is looked at, from `simulate`. A sequence of `SimulatedFrame`."""

    def __new__(
        cls, scene: _Path | Mapping[str, Any], *, frames: int | None = None, seed: int | None = None
    ) -> Simulation: ...
    @property
    def parameters(self) -> dict[str, Any]:
        """Sections and keys of the scene.toml: change a copy and give it to `simulate`."""

    @property
    def sensor(self) -> Sensor:
        """The sensor that took the pictures, with limb height and noise model measured on 32 other pictures of the scene.
        That takes as long as to render them, once."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> SimulatedFrame: ...
    def __iter__(self) -> Iterator[SimulatedFrame]: ...

@final
class SimulatedFrame:
    """A simulated picture with its truth."""

    @property
    def file(self) -> str:
        """Name that ``hzn simulate`` would give the picture."""

    @property
    def image(self) -> _Image:
        """The picture, shape (height, width) or (height, width, 3); rendered once."""

    @property
    def known(self) -> dict[str, Any]:
        """What `Sensor.process` is told of it: ``sensor.process(frame.image, **frame.known)``."""

    @property
    def truth(self) -> list[dict[str, Any]]:
        """The truth for each body: columns of truth.csv (book/reference/files.md)."""

@final
class Expected:
    """The cone that follows from what is known about a picture, from `Sensor.expect`."""

    @property
    def half_angle_deg(self) -> float:
        """Its half-angle, degrees."""

@disjoint_base
class Cone:
    """A cone of directions: what a method of rejection finds. ``Cone(axis, cos_half_angle)`` makes one's own."""

    def __new__(cls, axis: Sequence[float] | NDArray[np.float64], cos_half_angle: float) -> Cone: ...
    @property
    def axis(self) -> NDArray[np.float64]:
        """Unit vector to the body in the camera frame, shape (3,)."""

    @property
    def cos_half_angle(self) -> float:
        """cos of the half-angle."""

    @property
    def draws(self) -> int:
        """Draws that were made to find it."""

@final
class Fit(Cone):
    """A cone that was fitted, from `hzn.fit.cone`."""

    @property
    def rms_px(self) -> float:
        """Weighted RMS distance of the points from the limb, pixels."""

    @property
    def inliers(self) -> int:
        """Points with a weight."""

@final
class Rays:
    """Edge points in order along their edge, with their rays and weights."""

    @property
    def points(self) -> NDArray[np.float64]:
        """The points (u, v), shape (n, 2), pixels."""

    @property
    def lit(self) -> NDArray[np.float64]:
        """On which side of each point the light is: a step of a pixel along u or v, shape (n, 2)."""

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit rays in the camera frame, shape (n, 3)."""

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weights from 0 (does not count) to 1, shape (n,). A copy: set it to choose the points. After a fit, what each point
        counted. Points that the lens does not see stay at 0.
        """

    @weights.setter
    def weights(self, weights: ArrayLike, /) -> None: ...
    def __len__(self) -> int: ...

def _level(sensor: Sensor, image: _Image, expected: Expected, bits: int | None = None) -> int: ...
def _borders(
    sensor: Sensor, image: _Image, level: int, expected: Expected, bits: int | None = None
) -> list[NDArray[np.float64]]: ...
def _pick(sensor: Sensor, image: _Image, level: int, border: ArrayLike, bits: int | None = None) -> Rays: ...
def _rays(sensor: Sensor, points: ArrayLike, lit: ArrayLike) -> Rays: ...
def _keep(sensor: Sensor, rays: Rays, expected: Expected) -> Cone | None: ...
def _withdraw(sensor: Sensor, rays: Rays, found: Cone) -> int: ...
def _fit(sensor: Sensor, rays: Rays, start: Cone, expected: Expected) -> Fit | None: ...
def _fuse(
    sensor: Sensor, rays: Rays, fit: Cone, expected: Expected
) -> tuple[NDArray[np.float64], NDArray[np.float64], float] | None: ...
@final
class _Sequence:
    def __new__(cls, sensor: Sensor, inputs: Sequence[_Path]) -> _Sequence: ...
    def total(self) -> int | None: ...
    def __iter__(self) -> _Sequence: ...
    def __next__(self) -> _Item: ...
    def process(self, item: _Item) -> Report: ...

@final
class _Item: ...

def _process_encoded(
    sensor: Sensor,
    index: int,
    name: str,
    data: bytes | None,
    why: str,
    expected: Expected,
) -> Report: ...
def _write_mcap(path: _Path, sensor: Sensor, reports: Sequence[Report]) -> None: ...
def _evaluate(
    results: _Path | Iterable[Report], truth: _Path | Sequence[Mapping[str, Any]], camera: Camera | None
) -> dict[str, Any]: ...
def _design(
    camera: Camera,
    *,
    radius_km: float,
    altitude_km: float,
    altitude_sigma_km: float,
    limb_height_km: float,
    limb_height_sigma_km: float,
    depression_deg: float,
    roll_deg: float,
    sigma_px: float,
    correlation_px: float,
) -> dict[str, Any] | None: ...
def _panic() -> None: ...
