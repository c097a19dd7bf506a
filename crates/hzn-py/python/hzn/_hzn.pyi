"""Classes that wrap the sensor of the command line. Their docstrings are written here and compiled into the module."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from types import TracebackType
from typing import Any, Literal, TypeAlias, final, type_check_only

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack, disjoint_base

from . import keys

_Path: TypeAlias = str | PathLike[str]
_Image: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]
_Picture: TypeAlias = _Image | NDArray[np.floating[Any]]
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
    """Base class of hzn's exceptions."""

class ConfigError(HznError):
    """An impossible sensor, calibration or prior of a picture; the message names the field."""

class ImageError(HznError):
    """An array that is no picture, or not one of this camera."""

@final
class Camera:
    """A camera with its lens; it converts directions to pixels and back.

    Directions are in the camera frame (x right, y down, z forward); pixel centres are at integers, as in OpenCV.
    ``Camera(width=..., height=..., model=..., fx_px=..., fy_px=..., cx_px=..., cy_px=..., k=[...])`` takes the keys of
    ``[camera]`` in sensor.toml.
    """

    def __new__(cls, **keys: Unpack[keys.Camera]) -> Camera: ...
    @staticmethod
    def from_toml(path: _Path) -> Camera:
        """Read ``[camera]`` of a sensor.toml.

        Raises
        ------
        ConfigError
            The file has an error; the message names file, line, field and limit of the first one.
        """

    @staticmethod
    def from_kalibr(path: _Path, *, camera: str | None = None) -> Camera:
        """Read a Kalibr camchain (or a EuRoC sensor.yaml).

        Parameters
        ----------
        path
            The YAML file.
        camera
            Name of the camera in the chain, for example ``"cam1"``; without it, the first camera.

        Raises
        ------
        ConfigError
            The file or the lens model is not known.
        """

    @staticmethod
    def from_opencv(
        source: _Path | ArrayLike,
        distortion: ArrayLike | None = None,
        *,
        size: tuple[int, int] | None = None,
        fisheye: bool = False,
    ) -> Camera:
        """Take an OpenCV calibration: its file, or the camera matrix and the coefficients.

        A file may be YAML, XML or JSON of OpenCV's FileStorage, ROS's camera_info, or Foxglove's CameraCalibration.

        Parameters
        ----------
        source
            Path of the file, or the camera matrix K without skew, shape (3, 3), pixels.
        distortion
            D: 4 or 5 coefficients k1, k2, p1, p2, k3; with ``fisheye`` k1 to k4. Without it, the lens is an ideal
            pinhole.
        size
            Width and height of the picture, pixels; required with K, which does not contain them.
        fisheye
            K and D are of ``cv2.fisheye``.

        Raises
        ------
        ConfigError
            The file or the lens model is not known; the message names the argument.
        """

    @property
    def parameters(self) -> keys.Camera:
        """Copy of the keys of ``[camera]`` in sensor.toml."""

    @property
    def width(self) -> int:
        """Width of the picture, pixels."""

    @property
    def height(self) -> int:
        """Height of the picture, pixels."""

    @property
    def model(self) -> Literal["kannala-brandt", "equidistant", "pinhole", "brown-conrady", "double-sphere", "eucm"]:
        """Projection model."""

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Camera matrix, shape (3, 3), pixels."""

    @property
    def k(self) -> list[float]:
        """Coefficients of the lens, as in sensor.toml."""

    def project(self, rays: ArrayLike) -> NDArray[np.float64]:
        """Project directions to pixels.

        Parameters
        ----------
        rays
            Directions in the camera frame, shape (n, 3), of any length.

        Returns
        -------
        numpy.ndarray
            Points (u, v) in pixels, shape (n, 2); NaN outside the field of view of the lens.

        Raises
        ------
        ImageError
            The array has another shape.
        """

    def unproject(self, points: ArrayLike) -> NDArray[np.float64]:
        """Convert pixels to directions.

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            Unit vectors in the camera frame, shape (n, 3); NaN outside the image circle.

        Raises
        ------
        ImageError
            The array has another shape.
        """

    def undistort_points(self, points: ArrayLike) -> NDArray[np.float64]:
        """Map points to the plane z = 1, like ``cv2.undistortPoints`` and ``cv2.fisheye.undistortPoints``.

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            (x / z, y / z) of their rays, shape (n, 2). NaN outside the image circle, and at 90 degrees off axis or
            more, where the plane has no such point; `unproject` does not have this limit.

        Raises
        ------
        ImageError
            The array has another shape.
        """

    def jacobian(self, points: ArrayLike) -> NDArray[np.float64]:
        """Compute the derivatives of the unit rays with respect to (u, v).

        Parameters
        ----------
        points
            Points (u, v) in pixels, shape (n, 2).

        Returns
        -------
        numpy.ndarray
            Shape (n, 3, 2), radians per pixel: rows x, y, z of the ray, columns u, v. NaN outside the image circle.

        Raises
        ------
        ImageError
            The array has another shape.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class Rig:
    """Several cameras (heads) on one vehicle that are one sensor.

    The joint direction depends neither on the altitude nor on the limb height, because heads that look at different
    parts of the limb see a wrong height with different signs. Each head is checked by the others. A head searches for
    a limb of the size that the altitude says, or between the altitudes ``gates.altitude_limits_km`` of its sensor.

    Parameters
    ----------
    sensors
        The sensor of each head, one to four.
    mounts
        For each head, the rotation from the camera to the vehicle as a unit quaternion (w, x, y, z).
    names
        Name of each head, with letters, digits, ``_`` and ``-``; without it, ``head0``, ``head1`` and so on.
    limb_groups
        Name of the limb that each head sees, or ``None``. Heads with different names see limbs of different heights,
        as an infrared and a visible camera do, and share only the direction. Without it, all heads see one limb.
    mount_sigma_deg
        1-sigma of each mount about each axis, degrees.
    rig_sigma_deg
        1-sigma of the attitude of all heads together on the vehicle, degrees.
    limb_tilt_sigma_km, limb_own_sigma_km, false_alarm, misleading
        As in ``[rig]`` of rig.toml; without them, its defaults.

    Raises
    ------
    ConfigError
        A mount, a name or another value is refused; the message names the head as in a rig.toml. The sensors of
        several heads must look for the same first body, and must not have ``fit.half_angle = "known"``.

    Examples
    --------
    >>> rig = hzn.Rig([left, right], mounts=[q_vehicle_from_left, q_vehicle_from_right], names=["left", "right"])
    >>> answers = rig.process({"left": image_l, "right": image_r}, altitude_km=500.0)
    >>> answers["rig"].axis_vehicle
    """

    def __new__(
        cls,
        sensors: Sequence[Sensor],
        *,
        mounts: Sequence[Sequence[float]],
        names: Sequence[str] | None = None,
        limb_groups: Sequence[str | None] | None = None,
        mount_sigma_deg: float = 0.0,
        rig_sigma_deg: float = 0.0,
        limb_tilt_sigma_km: float | None = None,
        limb_own_sigma_km: float | None = None,
        false_alarm: float | None = None,
        misleading: float | None = None,
    ) -> Rig: ...
    @property
    def names(self) -> list[str]:
        """Names of the heads."""

    def process(
        self,
        images: dict[str, _Picture | _Path | None],
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        rate_rad_s: Sequence[float] | None = None,
        sun: Sequence[float] | None = None,
        time_s: float | None = None,
        camera_temperature_c: float | None = None,
        bits: int | None = None,
    ) -> dict[str, Report]:
        """Find the limb in the pictures of one epoch, and join the answers.

        Parameters
        ----------
        images
            The pictures by the name of their head, as for `Sensor.process`. A head without a picture, or with None,
            costs only itself.
        altitude_km, position_km, attitude_sigma_deg, time_s, camera_temperature_c, bits
            As for `Sensor.process`, for all heads.
        attitude
            Prior attitude of the vehicle: unit quaternion (w, x, y, z) from the vehicle to the fixed frame of the body.
        rate_rad_s, sun
            As for `Sensor.process`, in the axes of the vehicle.

        Returns
        -------
        dict
            The joint answer as ``"rig"``, whose axis and covariance are in the axes of the vehicle, and the report of
            each head with a picture. `Report.to_dict` has the columns of the check: ``heads_used``,
            ``heads_excluded``, ``separation_deg``, ``protection_deg``. If the heads contradict each other, the status
            is ``rejected`` and `Report.detail` begins with ``inconsistent``. Without an answer, ``coarse_x``,
            ``coarse_y``, ``coarse_z`` and ``coarse_sigma_deg`` have the coarse direction to the body, if the heads tell
            one; a place of a picture counts as lit from an eighth of full scale on, or from the level of a sensor with
            ``threshold.method = "fixed"``.

        Raises
        ------
        ImageError
            A picture has another dtype, shape or size than that of its head's camera, or cannot be read.
        ConfigError
            The rig has no head of this name, an altitude, position or attitude is impossible, or the EXIF times of the
            pictures are more than 0.1 s apart and no ``time_s`` is given.
        """

    def process_many(
        self,
        epochs: Iterable[
            Mapping[str, _Picture | _Path | None] | tuple[Mapping[str, _Picture | _Path | None], Mapping[str, Any]]
        ],
        *,
        jobs: int | None = None,
        progress: bool = False,
    ) -> Iterator[dict[str, Report]]:
        """Process a sequence of epochs on all cores. The answers come in order while it runs.

        In a sequence the rig knows the epochs before. A head whose picture has the samples of its picture before, or
        of another head, is excluded (``heads_excluded``), unless both have the same ``time_s`` or there is no limb in
        it. The coarse direction takes a place for lit by the last limb that its head found, as ``hzn run`` does.

        Parameters
        ----------
        epochs
            For each epoch a dictionary of pictures as for `process`; or pairs of it and a dictionary of keyword
            arguments of `process` (``altitude_km`` and so on). An iterable is read only as fast as it is processed.
        jobs
            Number of threads; without it, one per core. If a head has ``threshold.method = "track"`` or
            ``track.full_every``, there is only one.
        progress
            Show a progress bar (needs the package tqdm).

        Yields
        ------
        dict
            As `process` returns it, with the number of the epoch as `Report.index`. A picture file that cannot be read
            costs only its head, which has the status ``unreadable``. An array that is refused raises as in `process`,
            after the answers before it.

        Raises
        ------
        ConfigError
            As for `process`, or ``jobs`` is below 1.
        """

    def _see(self, images: Mapping[str, _Picture | _Path | None], known: _Prior, bits: int | None) -> _RigEpoch: ...
    def _join(self, memory: _RigMemory, epoch: _RigEpoch, index: int) -> dict[str, Report]: ...

@final
class Sensor:
    """A horizon sensor.

    ``Sensor(camera=..., body=..., preset=...)`` takes the sections of a sensor.toml as dictionaries; `hzn.keys` has
    their types. Only ``camera`` is required; it may also be a `Camera`. ``preset`` is ``"hzn"``, ``"dlr-2022"``,
    ``"zju-2022"``, ``"horace-2015"``, ``"sun"`` or ``"moon"``. ``flight=True`` computes in single precision with 2048
    points, as on the flight computer. A key or value that is refused raises `ConfigError` with its name and limit.

    A sensor may be used from several threads at the same time; the answers are the same as with one thread. It can be
    copied and pickled.

    Examples
    --------
    >>> sensor = hzn.Sensor(camera=hzn.Camera.from_kalibr("camchain.yaml"), body={"altitude_km": 230.0})
    """

    def __new__(cls, *, flight: bool = False, **sections: Unpack[keys.Sections]) -> Sensor: ...
    @staticmethod
    def from_toml(path: _Path, *, flight: bool = False) -> Sensor:
        """Read a sensor.toml.

        Raises
        ------
        ConfigError
            The file has an error; the message names file, line, field and limit of the first one.
        """

    @staticmethod
    def start(
        pictures: _Path | Sequence[_Path] | None = None,
        *,
        size: tuple[int, int] | None = None,
        fov_deg: float | None = None,
        lens: Literal["pinhole", "fisheye"] | None = None,
        altitude_km: float | None = None,
        body: Literal[
            "earth", "moon", "sun", "mercury", "venus", "mars", "jupiter", "saturn", "uranus",
            "neptune", "pluto", "ceres", "vesta", "phobos", "deimos", "io", "europa",
            "ganymede", "callisto", "mimas", "enceladus", "tethys", "dione", "rhea", "titan",
            "iapetus", "miranda", "ariel", "umbriel", "titania", "oberon", "triton", "charon",
        ] = "earth",
        topic: str | None = None,
        flight: bool = False,
    ) -> Sensor:
        """Make a sensor for a camera without a calibration: the one that ``hzn init`` writes.

        Unknown properties of the lens get a sigma, which the covariance of the answers includes. A recording of ROS 2
        with a ``sensor_msgs/CameraInfo`` beside its pictures has a calibration, which is used unless ``fov_deg`` or
        ``lens`` is given.

        Parameters
        ----------
        pictures
            Pictures of the camera: a file, a folder, a pattern, a video or a recording, or a list of them. They give
            the size, the curve between light and counts, and the focal length by their EXIF; or else the limb in them
            gives the field of view, for which an altitude must be known. A warning says if the limb contradicts the
            field of view or the altitude.
        size
            Width and height of the picture, pixels, if there are no pictures yet.
        fov_deg
            Field of view over the whole width, degrees.
        lens
            Kind of lens; without it, a pinhole up to a field of view of 90 degrees.
        altitude_km
            Altitude of all pictures above WGS-84, or above the mean radius of another body, km.
        body
            The body in the pictures.
        topic
            Topic of the pictures in an MCAP or a bag of ROS 2; without it, the first topic with pictures.
        flight
            As for `Sensor`.

        Raises
        ------
        ConfigError
            A value is refused, nothing says the field of view, or a recorded calibration is for another size.
        ImageError
            The pictures cannot be read, or have different sizes; or there are none on ``topic``.

        Warns
        -----
        UserWarning
            EXIF or the limb in the pictures contradicts the field of view, the camera was turned, or the recording has
            further topics with pictures.

        Examples
        --------
        >>> sensor = hzn.Sensor.start("iss.jpg", fov_deg=23.5, altitude_km=418)
        >>> sensor = hzn.Sensor.start(size=(1920, 1080), fov_deg=92, lens="fisheye", altitude_km=240)
        """

    @property
    def parameters(self) -> keys.Parameters:
        """All parameters, as sections and keys of sensor.toml.

        Reading returns a copy: change the copy and set it again. If the new parameters are refused (`ConfigError`),
        nothing changes. Calls that other threads have begun end with the parameters that they began with.

        Examples
        --------
        >>> parameters = sensor.parameters
        >>> parameters["consensus"]["threshold_px"] = 2.0
        >>> sensor.parameters = parameters
        """

    @parameters.setter
    def parameters(self, sections: keys.Sections | keys.Parameters, /) -> None: ...
    @property
    def camera(self) -> Camera:
        """The camera with its lens."""

    @property
    def flight(self) -> bool:
        """True if the sensor computes in single precision, as on the flight computer."""

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
        camera_temperature_c: float | None = None,
    ) -> Expected:
        """Compute the expected cone, for the single stages (`hzn.consensus` and its neighbours).

        Parameters
        ----------
        body
            Number of the body for a sensor of several bodies, from 0. Stages that get the result work for this body,
            with its threshold and its edge errors.
        altitude_km, position_km, attitude, attitude_sigma_deg, rate_rad_s, time_s, camera_temperature_c
            As in `process`.

        Raises
        ------
        ConfigError
            The sensor does not have this body; an altitude, position or attitude is impossible; or the body needs an
            altitude, and neither the arguments nor the parameters give one.
        """

    def process(
        self,
        image: _Picture | _Path,
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        rate_rad_s: Sequence[float] | None = None,
        range_km: float | None = None,
        range_sigma_km: float | None = None,
        pole: Sequence[float] | None = None,
        sun: Sequence[float] | None = None,
        time_s: float | None = None,
        camera_temperature_c: float | None = None,
        bits: int | None = None,
        detail: bool = False,
    ) -> _Result:
        """Find the limb in a picture.

        NaN, or an array of NaN, is an unknown value, as in a table of pandas with gaps.

        Parameters
        ----------
        image
            Shape (height, width) or (height, width, channels), uint8 or uint16, with any strides. It is not copied; C
            order is fastest. Of an array of floats, such as temperatures, the smallest becomes 8192 and the largest
            57344 of 65535, and what lies between keeps its place on the line. Another scale or offset moved the limb of
            a photograph by a tenth of its sigma. A number that is not finite becomes 8192. Or the path of a picture
            file, which is read as by ``hzn run``.
        altitude_km
            Above WGS-84 for ``earth``, otherwise above the radius. Without it, the parameters' altitude is used.
        position_km
            Position of the camera in the fixed frame of the body (for the Earth ECEF), km, shape (3,). It overrides the
            altitude.
        attitude
            Prior attitude: unit quaternion (w, x, y, z) from the camera frame to the fixed frame of the body.
        attitude_sigma_deg
            1-sigma of the prior attitude, degrees; without it, 5.
        rate_rad_s
            Rotation rate of the camera in the camera frame, rad/s, shape (3,). It corrects a rolling shutter
            (`camera.readout_s`).
        range_km
            Distance of the camera from the body's centre, km, if the position is fitted (`fit.position`). It needs
            ``range_sigma_km``, here or in the parameters.
        range_sigma_km
            1-sigma of that distance, km.
        pole
            Direction of the north pole of a body of revolution in the camera frame, shape (3,). It orients the body if
            there is no attitude.
        sun
            Direction to the Sun in the camera frame, shape (3,).
        time_s
            UTC in seconds since 1970, or the time since the start of a flight or a recording: from 0 up to a year
            (31 536 000 s) it is no UTC, and the Sun is not known from it. With a position and a UTC, Sun and Moon get
            `Report.axis_fixed`.
        camera_temperature_c
            Temperature of the camera, °C. With ``camera.temperature`` the picture has the lens of this temperature.
        bits
            Number of significant bits of uint16, 8 to 16. Without it, the sensor's `input.bits` is used, else 16. If
            nothing is found and the upper bits are unused, a warning says so. An array of floats has no such number.
        detail
            Keep edges, points and the times of the stages.

        Returns
        -------
        Report
            Report of the first body; `Report.others` has the reports of further bodies. If the altitude is unknown, or
            if it is not above the limb height, as at the start of every rocket, the status is ``no-altitude`` and
            `Report.detail` has the reason.

        Raises
        ------
        ImageError
            The array has another dtype, shape or size than the camera's picture, or the file cannot be read.
        ConfigError
            An altitude, position, attitude or temperature is impossible.

        Warns
        -----
        UserWarning
            A value is possible but looks wrong, for example an altitude in metres.
        """

    def what_fits(
        self,
        image: _Picture,
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        bits: int | None = None,
    ) -> str | None:
        """Say what would make the limb in a refused picture the expected one.

        The picture is searched for a limb of any half-angle. The sentence names its half-angle, and the altitude or the
        field of view with which it would be the expected one: ``the limb fits 59.8 +- 1.4 deg, expected 68.3 deg:
        altitude 1023 +- 107 km, or a field of view of 92.8 deg at 505 km``.

        One picture cannot show that both are wrong at once; ``hzn run`` and the viewer compare several pictures.

        Parameters
        ----------
        image, altitude_km, position_km, bits
            As for `process`.

        Returns
        -------
        str or None
            None if there is no such limb, if its half-angle is the expected one, if the sensor has several bodies, or
            for Sun and Moon, whose size says nothing about altitude or lens.

        Raises
        ------
        ImageError
            The array has another dtype, shape or size than the camera's picture.
        ConfigError
            An altitude or position is impossible.
        """

    def process_many(
        self,
        images: _Path | Iterable[_Picture | _Path | tuple[_Picture | _Path, Mapping[str, Any]]],
        *,
        topic: str | None = None,
        jobs: int | None = None,
        progress: bool = False,
    ) -> Iterator[_Result]:
        """Process a sequence on all cores. Reports come in order while it runs; memory does not grow with the length.

        Parameters
        ----------
        images
            A folder, a pattern, a video or an MCAP, as for ``hzn run``, with the frames.csv next to it; or paths of
            pictures; or arrays; or pairs of an array or a path and a dictionary of keyword arguments of `process`
            (``altitude_km`` and so on). An iterable is read only as fast as it is processed: each thread takes some
            milliseconds' work or 8 MB at a time, and at least one picture.
        topic
            Topic of the pictures in an MCAP or a bag of ROS 2; without it, the first topic with pictures.
        jobs
            Number of threads; without it, one per core. With ``threshold.method = "track"`` and with
            ``track.full_every`` there is only one.
        progress
            Show a progress bar (needs the package tqdm).

        Yields
        ------
        Report
            One per picture. A picture file that cannot be read has the status ``unreadable`` and the reason in
            `Report.detail`. An array that is refused raises as in `process`, after the reports before it.

        Raises
        ------
        ConfigError
            There are no pictures, the recording has none on ``topic`` (the message names its topics), or the frames.csv
            has an error.
        KeyboardInterrupt
            Comes within about the time of one picture; the pictures in progress are finished first.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class Report:
    """Result of one picture. Without an answer, the properties of the answer are None, and ``bool(report)`` is False.

    A notebook shows it with the picture and all annotations; the picture is the processed array with its present
    contents. A report can be pickled, but without the picture.
    """

    @property
    def index(self) -> int:
        """Index of the picture in the sequence, from 0."""

    @property
    def file(self) -> str:
        """Name of the picture; empty for an array."""

    @property
    def time_s(self) -> float | None:
        """Time of the picture, seconds; None if frames.csv has times, but none for this picture."""

    @property
    def body(self) -> str:
        """Kind of the body, as in sensor.toml."""

    @property
    def status(self) -> _Status:
        """Outcome of the picture."""

    @property
    def ok(self) -> bool:
        """True if there is an answer."""

    @property
    def stage(self) -> str:
        """Stage that was reached; empty for a report from a recording."""

    @property
    def tracked(self) -> bool:
        """Whether the limb was found where the picture before put it, in `Sensor.process_many` with ``[track]``."""

    @property
    def detail(self) -> str:
        """Reason why there is no answer, in words; empty with the status ``ok``."""

    @property
    def axis(self) -> NDArray[np.float64] | None:
        """Unit vector to the body in the camera frame, shape (3,)."""

    @property
    def axis_fixed(self) -> NDArray[np.float64] | None:
        """The same direction in the fixed frame (for the Earth ECEF), shape (3,), if the position is known."""

    @property
    def axis_vehicle(self) -> NDArray[np.float64] | None:
        """The same direction in the vehicle's frame, shape (3,), with ``[mount]`` in sensor.toml."""

    @property
    def nadir(self) -> NDArray[np.float64] | None:
        """Unit vector to the centre of the body in the camera frame, shape (3,).

        The axis of the Earth's limb is not the direction to its centre: at middle latitudes they are up to 0.19 degrees
        apart. The position that was given with the picture says by which angle, and the attitude in which direction.
        Without a position or an attitude this is `axis`, and `nadir_error_deg` says how far it can be off. It is exact
        for a round body and with ``fit.position``. None without an answer, and for another ellipsoid than the Earth
        without ``fit.position``.
        """

    @property
    def nadir_error_deg(self) -> float | None:
        """Largest angle between `nadir` and the direction to the centre, degrees, apart from the error of `axis`.

        Without an attitude it is the whole angle between axis and centre, without a position that at 45 degrees of
        latitude. With an attitude it is the effect of three of its sigmas.
        """

    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """Covariance of the axis on its tangent plane in the camera frame, shape (3, 3) of rank 2, rad²."""

    @property
    def covariance_common(self) -> NDArray[np.float64] | None:
        """Part of `covariance` whose error is the same in the next picture while the geometry stays, shape (3, 3), rad².

        The mean of n such answers has the covariance ``common + (covariance - common) / n``. It is None if the method
        does not know it.
        """

    @property
    def sigma_max_deg(self) -> float | None:
        """The larger of the axis' two standard deviations, degrees."""

    @property
    def half_angle_deg(self) -> float | None:
        """Half-angle of the body from the free fit, degrees."""

    @property
    def axis_free(self) -> NDArray[np.float64] | None:
        """Axis of the fit with a free half-angle, unit vector in the camera frame, shape (3,); None if it was not fitted."""

    @property
    def covariance_free(self) -> NDArray[np.float64] | None:
        """Covariance of `axis_free`, shape (3, 3) of rank 2, rad²: all terms except that of the expected half-angle."""

    @property
    def axis_by_cos(self) -> NDArray[np.float64] | None:
        """Derivative of `axis` by the cosine of the expected half-angle, camera frame, shape (3,).

        A wrong limb height moves this cosine in all pictures alike; a filter needs the derivative.
        """

    @property
    def position_km(self) -> NDArray[np.float64] | None:
        """Position of the body's centre in the camera frame, shape (3,), km, with ``fit.position``.

        It holds the same information as `axis`; a filter must use only one of them.
        """

    @property
    def position_covariance_km2(self) -> NDArray[np.float64] | None:
        """Covariance of `position_km`, shape (3, 3), km². On a short arc direction and range are known only together."""

    @property
    def body_fixed_km(self) -> NDArray[np.float64] | None:
        """Position of the camera in the axes of the body, shape (3,), km, if the attitude is known."""

    @property
    def yaw_deg(self) -> float | None:
        """Rotation of the body about the line to it, relative to the given attitude, degrees.

        It is right-handed about the direction to the body, and None if its 1-sigma is above ``fit.yaw_limit_deg``.
        """

    @property
    def yaw_sigma_deg(self) -> float | None:
        """1-sigma of `yaw_deg`, degrees."""

    @property
    def altitude_km(self) -> float | None:
        """The given altitude, or the altitude of the position, kilometres."""

    @property
    def altitude_est_km(self) -> float | None:
        """Altitude from the free fit, kilometres."""

    @property
    def altitude_est_sigma_km(self) -> float | None:
        """Standard deviation of `altitude_est_km`, kilometres."""

    @property
    def rms_px(self) -> float | None:
        """Weighted RMS distance of the inliers from the fitted limb, pixels."""

    @property
    def picture_direction(self) -> NDArray[np.float64] | None:
        """Unit vector in the picture (right, down) from the principal point towards the body, shape (2,).

        None for a body straight ahead, which is in no direction.
        """

    @property
    def picture_sigma(self) -> float | None:
        """1-sigma of the angle of `picture_direction`, radians."""

    @property
    def p_limb(self) -> float | None:
        """Probability that the edge of the answer is the limb; None for bodies without air."""

    @property
    def protection_deg(self) -> float | None:
        """Protection level: the angle that the error of the axis exceeds with the probability
        `covariance.protection_probability` if the edge is the limb, degrees; None without `p_limb`."""

    @property
    def roll_deg(self) -> float | None:
        """Roll of the vehicle, degrees; needs a mounting."""

    @property
    def pitch_deg(self) -> float | None:
        """Pitch of the vehicle, degrees; needs a mounting."""

    @property
    def edge_points(self) -> int | None:
        """Number of edge points that were located with sub-pixel accuracy."""

    @property
    def dropped(self) -> int | None:
        """Number of border pixels that were dropped because a list was full."""

    @property
    def level(self) -> int | None:
        """Threshold between dark and lit, in counts of the picture."""

    @property
    def elapsed_us(self) -> float | None:
        """Processing time, microseconds."""

    @property
    def others(self) -> list[Report]:
        """Reports of the bodies after the first, for a sensor of several bodies."""

    @property
    def candidates(self) -> list[dict[str, Any]]:
        """The first 16 examined edges, always with the chosen one: length_px, points, inliers, rms_px, verdict."""

    @property
    def limb(self) -> list[NDArray[np.float64]]:
        """The fitted limb in the picture, as lines of points (u, v), each of shape (n, 2), pixels."""

    @property
    def edges(self) -> list[NDArray[np.float64]]:
        """Border pixels of the edges, each of shape (n, 2). Needs ``detail=True`` (`HznError`)."""

    @property
    def inliers(self) -> NDArray[np.float64]:
        """Inliers: edge points (u, v) of the answer, shape (n, 2), pixels. Needs ``detail=True`` (`HznError`)."""

    @property
    def rejected(self) -> NDArray[np.float64]:
        """Edge points (u, v) that were rejected, shape (n, 2), pixels. Needs ``detail=True`` (`HznError`)."""

    @property
    def rays(self) -> NDArray[np.float64]:
        """Unit rays of the inliers in the camera frame, shape (n, 3). Needs ``detail=True`` (`HznError`)."""

    @property
    def stages_us(self) -> dict[str, float]:
        """Time of each stage, microseconds. Needs ``detail=True`` (`HznError`)."""

    def plot(self, image: _Picture | None = None, *, ax: Any = None) -> Any:
        """Draw the picture with the fitted limb, the points (with ``detail=True``) and the answer, with matplotlib.

        Parameters
        ----------
        image
            The processed array. Without it, the array of `Sensor.process` if it still exists, or its file, which is
            read again; otherwise only the limb is drawn.
        ax
            Axes to draw into; without it, a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Raises
        ------
        ImportError
            matplotlib is not installed.
        ImageError
            The picture does not have the size of the camera's picture, or its file cannot be read.
        """

    def mask(self, margin_deg: float = 0.0) -> NDArray[np.uint8] | None:
        """Return the mask for a star tracker: 255 where a body may cover a part of the pixel, 0 in the sky.

        It covers the body, with its night side, out to three sigmas of the fitted limb, further bodies that were found,
        and Sun and Moon in a known direction. It is the mask of ``hzn run --mask-pictures``. A warning names a body of
        the sensor that was not found and whose direction is not known.

        Parameters
        ----------
        margin_deg
            The outlines are moved outwards by this angle, for the glare of the Sun or for light in the air. 0 to 90.

        Returns
        -------
        numpy.ndarray or None
            Shape (height, width), uint8; None without an answer.

        Raises
        ------
        HznError
            The report was pickled or comes from a recording; or the arc is too short for the outline of its ellipsoid.
        ConfigError
            The margin is out of range.
        """

    def to_dict(self) -> dict[str, Any]:
        """Return the row that ``hzn run`` would write, by column; None for an empty cell.

        The names are those of CSV and JSON Lines: ``time_s``, the axis as ``axis_x``, ``axis_y``, ``axis_z``, its
        covariance as ``cov_xx`` to ``cov_zz``, ``p_limb``, `X
        `nadir` and `nadir_error_deg` are no columns. They follow from the axis, the altitude and the attitude of the
        picture, and a file of results has the first two, but never the attitude.

        Examples
        --------
        >>> table = pandas.DataFrame(report.to_dict() for report in reports)
        >>> row = report.to_dict() | {"nadir": report.nadir, "nadir_error_deg": report.nadir_error_deg}
        """

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Report: ...
    def __deepcopy__(self, _memo: Any, /) -> Report: ...

# At run time there is only `Report`. These two let a type checker know after `if report.ok:` or `if report:` that the
# answer is not None.
@type_check_only
class _Answer(Report):  # type: ignore[misc]  # pyright: ignore[reportGeneralTypeIssues]
    @property
    def ok(self) -> Literal[True]: ...
    @property
    def status(self) -> Literal["ok"]: ...
    @property
    def axis(self) -> NDArray[np.float64]: ...
    @property
    def covariance(self) -> NDArray[np.float64]: ...
    @property
    def sigma_max_deg(self) -> float: ...
    @property
    def half_angle_deg(self) -> float: ...
    @property
    def rms_px(self) -> float: ...
    def __bool__(self) -> Literal[True]: ...

@type_check_only
class _NoAnswer(Report):  # type: ignore[misc]  # pyright: ignore[reportGeneralTypeIssues]
    @property
    def ok(self) -> Literal[False]: ...
    @property
    def axis(self) -> None: ...
    @property
    def covariance(self) -> None: ...
    def __bool__(self) -> Literal[False]: ...

_Result: TypeAlias = _Answer | _NoAnswer

@final
class Calibration:
    """Result of `calibrate` and `calibrate_points`: a lens with its covariance, and the residuals of every point."""

    @property
    def camera(self) -> Camera:
        """The lens."""

    @property
    def names(self) -> list[str]:
        """Names of the intrinsic parameters: ``fx_px``, ``fy_px``, ``cx_px``, ``cy_px``, then the coefficients."""

    @property
    def values(self) -> list[float]:
        """Values of the parameters, in the order of `names`; focal lengths and principal point in pixels."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of the parameters in the order of `names`, shape (n, n), in their units squared."""

    @property
    def rms_px(self) -> float:
        """RMS distance between measured and projected points, pixels, as OpenCV reports it."""

    @property
    def sigma_px(self) -> float:
        """1-sigma of a measured coordinate, pixels, from the residuals."""

    @property
    def held_out_rms_px(self) -> float | None:
        """RMS distance in views that took no part in the fit of the lens, pixels; None with too few views."""

    @property
    def residuals_px(self) -> list[NDArray[np.float64]]:
        """Measured minus projected points of each view, shape (n, 2), pixels; shape (0, 2) for a dropped view."""

    @property
    def outliers(self) -> list[list[int]]:
        """For each view the indices of the points that do not count, because they disagree with all others."""

    @property
    def dropped(self) -> list[str | None]:
        """For each view the reason why it does not count; None for a view that counts."""

    @property
    def warnings(self) -> list[str]:
        """Doubts about the result, for example corners of the picture that no point reaches."""

    def to_toml(self) -> str:
        """Return ``[camera]`` of a sensor.toml, with the covariance."""

def calibrate(
    object_points: Sequence[ArrayLike],
    image_points: Sequence[ArrayLike],
    size: tuple[int, int],
    *,
    model: str = "kannala-brandt",
) -> Calibration:
    """Calibrate a camera from views of a flat target, without a first guess.

    Parameters
    ----------
    object_points
        For each view the points on the target: shape (n, 2), or (n, 3) with z = 0, in any unit. Seen from the front, x
        points right and y down.
    image_points
        For each view their places in the picture: shape (n, 2) or (n, 1, 2), pixels, pixel centres at integers.
    size
        Width and height of the pictures, pixels.
    model
        ``kannala-brandt`` (cv2.fisheye), ``brown-conrady`` (cv2.calibrateCamera), ``equidistant``, ``pinhole``,
        ``double-sphere`` or ``eucm``.

    Raises
    ------
    ConfigError
        The views do not determine the lens; the message says what to do.
    """

def calibrate_points(
    directions: Sequence[ArrayLike],
    image_points: Sequence[ArrayLike],
    size: tuple[int, int],
    *,
    model: str = "kannala-brandt",
) -> Calibration:
    """Calibrate a camera from points with known directions: a collimator on a rotator, or stars.

    Parameters
    ----------
    directions
        For each picture the directions of the points: shape (n, 3), in any frame. Each picture has a rotation of its
        own from this frame to the camera, which is estimated.
    image_points
        For each picture their places: shape (n, 2), pixels, pixel centres at integers.
    size
        Width and height of the pictures, pixels.
    model
        The lens model, as for `calibrate`.

    Raises
    ------
    ConfigError
        The points do not determine the lens, or they fit only after a change, for example a mirrored azimuth.
    """

def find_corners(
    picture: _Image, board: tuple[int, int]
) -> tuple[NDArray[np.uint16], NDArray[np.float64]] | None:
    """Find the inner corners of a chessboard, with sub-pixel places.

    Parameters
    ----------
    picture
        The picture, as for `Sensor.process`.
    board
        Inner corners along the rows and the columns of the board, for example (9, 6).

    Returns
    -------
    tuple of numpy.ndarray or None
        Column and row of each corner, shape (n, 2), and its place, shape (n, 2), pixels. A part of a board has fewer
        corners. None if there is no board of this size.

    Raises
    ------
    ImageError
        The array is no picture.
    """

def locate(
    points: ArrayLike,
    *,
    camera: Camera,
    radii_km: Sequence[float],
    attitude: Sequence[float],
    method: str = "gauss-newton",
    sigma_px: float = 1.0,
    lit: Sequence[float] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Compute the position of an ellipsoid from points on its limb that were found elsewhere.

    Parameters
    ----------
    points
        Points (u, v) on the limb, in order along it, shape (n, 2), pixels, pixel centres at integers.
    camera
        The camera.
    radii_km
        Semi-axes of the limb's ellipsoid along the axes of the body, km: with the height of the visible limb.
    attitude
        Unit quaternion (w, x, y, z) from the camera frame to the axes of the body.
    method
        ``gauss-newton`` is unbiased on short arcs. ``least-squares`` is the linear method of Christian & Robinson
        (2016), for comparison; it is biased on short arcs. ``robust`` rejects outliers and weighs the others.
    sigma_px
        1-sigma of each coordinate of a point, pixels; the noise of different points is independent. If the residuals
        of ``gauss-newton`` or ``robust`` are larger, their size counts.
    lit
        Rough direction to the body in the camera frame, shape (3,); without it, that of ``least-squares``. Only the
        side of the limb on which the body lies is taken from it.

    Returns
    -------
    tuple of numpy.ndarray or None
        Position of the body's centre from the camera in the camera frame, shape (3,), km, and its covariance, shape
        (3, 3), km². It contains only the noise of the points. None if the points do not determine a position.

    Raises
    ------
    ConfigError
        Radii, attitude, method, sigma or direction are refused; the message names it.
    ImageError
        The points have the wrong shape, or the lens does not see one of them.

    Examples
    --------
    >>> position_km, covariance_km2 = hzn.locate(
    ...     points, camera=camera, radii_km=[3396.19, 3396.19, 3376.2], attitude=[1, 0, 0, 0], sigma_px=0.1)
    """

def render(
    sensor: Sensor,
    position_km: Sequence[float],
    attitude: Sequence[float],
    time_s: float,
    *,
    world: _Path | Mapping[str, Any] | None = None,
    seed: int | None = None,
) -> _Image:
    """Render what the sensor's camera sees from one pose, for a simulation that moves the camera itself.

    Parameters
    ----------
    sensor
        The sensor, of which only the camera is used.
    position_km
        Position of the camera in the fixed frame of the body (for the Earth ECEF), km, shape (3,).
    attitude
        Unit quaternion (w, x, y, z) from the camera frame to the fixed frame of the body.
    time_s
        UTC in seconds since 1970. It places Sun and Moon.
    world
        Scene whose world, lens errors, exposure and detector are used, as for `simulate`; without it,
        ``rocket-clean``: the Earth by day, 8 bits, grey, in proportion to the light. ``leo-infrared`` is the Earth in
        the infrared. Trajectory, motion blur and parts of the vehicle are not used.
    seed
        Seed of the noise. Without it, the time is the seed: the same call gives the same picture, and pictures at
        other times have other noise.

    Returns
    -------
    numpy.ndarray
        Shape (height, width) or (height, width, 3), uint8 or uint16 as the scene's detector says.

    Raises
    ------
    ConfigError
        The camera is inside the body or below its limb, or another value or the scene is refused.

    Examples
    --------
    >>> image = hzn.render(sensor, position_km, q_fixed_from_camera, 1_560_421_800.0)
    >>> report = sensor.process(image, position_km=position_km)
    """

def overlay(image: _Picture, report: Report, *, bits: int | None = None) -> NDArray[np.uint8]:
    """Draw limb and axis of a report over its picture; with ``detail=True`` also edges and points.

    Parameters
    ----------
    image
        The picture, as for `Sensor.process`.
    report
        Report of the picture.
    bits
        Number of significant bits of uint16.

    Returns
    -------
    numpy.ndarray
        RGB, shape (height, width, 3), uint8.

    Raises
    ------
    ImageError
        The array is no picture.
    """

def read_mcap(path: _Path) -> dict[str, NDArray[Any]]:
    """Read the results of a recording as columns, ready for ``pandas.DataFrame`` or ``polars.DataFrame``.

    Returns
    -------
    dict
        One array per column, of equal length; NaN in empty cells. Columns and units: book/reference/files.md.

    Raises
    ------
    HznError
        The file cannot be read, or is no MCAP.
    """

def open_mcap(path: _Path) -> Recording:
    """Open a recording to read its pictures one after another; memory does not grow with its length.

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
    """A recording that is being read, from `open_mcap`. It is an iterator of its pictures and a context manager."""

    @property
    def sensor_toml(self) -> str | None:
        """Text of the sensor.toml that the recording was made with."""

    @property
    def metadata(self) -> dict[str, str]:
        """Versions and settings of the run."""

    def sensor(self) -> Sensor:
        """Make the sensor that the recording was made with.

        Raises
        ------
        HznError
            The recording holds no sensor.toml.
        """

    def close(self) -> None:
        """Close the file. Reading on raises `HznError`."""

    def __iter__(self) -> Recording: ...
    def __next__(self) -> Frame: ...
    def __enter__(self) -> Recording: ...
    def __exit__(
        self,
        *_exception: type[BaseException] | BaseException | TracebackType | None,
    ) -> None: ...

@final
class Frame:
    """A picture of a recording with its report."""

    @property
    def image(self) -> _Image | None:
        """The picture, shape (height, width) or (height, width, channels), decoded at each access; None if the
        recording was made without it.

        Raises
        ------
        ImageError
            The picture cannot be decoded.
        """

    @property
    def report(self) -> Report:
        """Result of the picture."""

@final
class Simulation:
    """A simulated flight, from `simulate`: a sequence of `SimulatedFrame`, each rendered when it is accessed."""

    def __new__(
        cls,
        scene: _Path | Mapping[str, Any],
        *,
        frames: int | None = None,
        seed: int | None = None,
        camera: str | None = None,
    ) -> Simulation: ...
    @property
    def parameters(self) -> dict[str, Any]:
        """Sections and keys of the scene.toml: change a copy and pass it to `simulate`."""

    @property
    def sensor(self) -> Sensor:
        """The sensor that took the pictures. Its limb height and noise model are measured on 32 other pictures of the
        scene; this takes as long as to render them, but only once."""

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
        """The picture, shape (height, width) or (height, width, 3); it is rendered only once."""

    @property
    def known(self) -> dict[str, Any]:
        """Keyword arguments of `Sensor.process`: ``sensor.process(frame.image, **frame.known)``."""

    @property
    def truth(self) -> list[dict[str, Any]]:
        """The truth for each body: columns of truth.csv (book/reference/files.md)."""

@final
class Expected:
    """The expected cone of a picture, from `Sensor.expect`."""

    @property
    def half_angle_deg(self) -> float:
        """Half-angle of the cone, degrees."""

@disjoint_base
class Cone:
    """A cone of directions, as the consensus finds it. ``Cone(axis, cos_half_angle)`` makes one from given values."""

    def __new__(cls, axis: Sequence[float] | NDArray[np.float64], cos_half_angle: float) -> Cone: ...
    @property
    def axis(self) -> NDArray[np.float64]:
        """Unit vector to the body in the camera frame, shape (3,)."""

    @property
    def cos_half_angle(self) -> float:
        """Cosine of the half-angle."""

    @property
    def draws(self) -> int:
        """Number of random draws of the consensus."""

@final
class Fit(Cone):
    """A fitted cone, from `hzn.fit.cone`."""

    @property
    def rms_px(self) -> float:
        """Weighted RMS distance of the points from the limb, pixels."""

    @property
    def inliers(self) -> int:
        """Number of points with a weight above 0."""

@final
class Rays:
    """Edge points in order along their edge, with their rays and weights."""

    @property
    def points(self) -> NDArray[np.float64]:
        """The points (u, v), shape (n, 2), pixels."""

    @property
    def lit(self) -> NDArray[np.float64]:
        """Direction from each point to its lit side: a step of one pixel along u or v, shape (n, 2)."""

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit rays in the camera frame, shape (n, 3)."""

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weights from 0 (ignored) to 1, shape (n,). Reading returns a copy; set the property to choose the points.
        After a fit, it has the weights of the fit. Points outside the field of view of the lens stay at 0.
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
def _number(report: Report, index: int) -> Report: ...
@final
class _Sequence:
    def __new__(cls, sensor: Sensor, inputs: Sequence[_Path], topic: str | None = None) -> _Sequence: ...
    def total(self) -> int | None: ...
    def __iter__(self) -> _Sequence: ...
    def __next__(self) -> _Item: ...
    def process(self, item: _Item) -> Report: ...

@final
class _Item: ...
@final
class _RigEpoch: ...
@final
class _RigMemory:
    def __new__(cls, rig: Rig) -> _RigMemory: ...

@final
class _Prior:
    def __new__(
        cls,
        *,
        altitude_km: float | None = None,
        position_km: Sequence[float] | None = None,
        attitude: Sequence[float] | None = None,
        attitude_sigma_deg: float | None = None,
        rate_rad_s: Sequence[float] | None = None,
        range_km: float | None = None,
        range_sigma_km: float | None = None,
        pole: Sequence[float] | None = None,
        sun: Sequence[float] | None = None,
        time_s: float | None = None,
        camera_temperature_c: float | None = None,
    ) -> _Prior: ...

def _process_encoded(
    sensor: Sensor,
    index: int,
    name: str,
    data: bytes | None,
    why: str,
    known: _Prior,
) -> Report: ...
def _check_prior(sensor: Sensor, known: _Prior) -> None: ...
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

_Three: TypeAlias = list[float]
_Rows: TypeAlias = list[list[float]]
_Taken: TypeAlias = tuple[list[float], list[list[float]], float, bool]

def _triad(first: list[_Three], second: list[_Three]) -> _Rows | None: ...
def _wahba(directions: list[tuple[_Three, _Three, float]]) -> tuple[_Rows, _Rows, float] | None: ...
def _celestial(moon: bool, unix_s: float) -> _Three: ...
def _fuse_flight(
    recordings: list[str],
    imu: str | None,
    gnss: str | None,
    attitude: str | None,
    mounts: dict[str, _Rows],
    clocks: dict[str, float],
    tables: tuple[list[str], str | None],
    directions: list[str],
    given: dict[str, Any],
    wanted: tuple[bool, bool, bool],
    rate_hz: float,
) -> dict[str, Any]: ...

@final
class _Filter:
    def __new__(
        cls,
        time_s: float,
        attitude: _Rows,
        velocity: _Three,
        position: _Three,
        sigmas: _Three,
        mounts: list[_Rows],
        given: dict[str, Any],
    ) -> _Filter: ...
    def predict(self, time_s: float, gyro: _Three, accel: _Three, saturated: bool) -> str: ...
    def update_direction(
        self,
        camera: int,
        measured: _Three,
        reference: _Three,
        covariance: _Rows,
        by_limb_height: _Three,
        is_limb: bool,
        common: _Rows | None,
    ) -> _Taken | None: ...
    def update_position(self, position: _Three, sigma: float) -> _Taken | None: ...
    def update_velocity(self, velocity: _Three, sigma: float) -> _Taken | None: ...
    def update_attitude(self, attitude: _Rows, sigma: float) -> _Taken | None: ...
    def state(self) -> tuple[float, _Rows, _Three, _Three]: ...
    def covariance(self) -> _Rows: ...
    def mount(self, camera: int) -> _Rows | None: ...
    def biases(self) -> tuple[_Three, _Three]: ...
