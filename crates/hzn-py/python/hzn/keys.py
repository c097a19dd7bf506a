"""Types of the sections of a sensor.toml, as dictionaries, for type checkers and editors.

``body: hzn.keys.Body = {"altitude_km": 230.0}`` is a dictionary whose keys a type checker compares with those of
``[body]``. The sensor itself checks names, values and limits in any case. A key that is None counts as left out.

`cargo xtask keys` writes this file from the table of keys.
"""

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, TypedDict

from numpy.typing import NDArray

from . import _hzn

_Numbers: TypeAlias = Sequence[float] | NDArray[Any]
_Rows: TypeAlias = Sequence[Sequence[float]] | Sequence[NDArray[Any]] | NDArray[Any]
_Polygons: TypeAlias = Sequence[_Rows] | NDArray[Any]


class CameraCovariance(TypedDict):
    """Covariance of the intrinsic parameters of a camera, as a calibration program reports it."""

    order: Sequence[str]
    """The parameters of the rows and columns, by their names (``fx_px``, ``k1``)."""
    rows: _Rows
    """The matrix row by row, symmetric and positive semidefinite; in px² and the units of the coefficients."""


class _Reference(TypedDict):
    reference_c: float
    """Temperature for which the other keys of the camera hold, °C."""


class CameraTemperature(_Reference, total=False):
    """How the lens of a camera changes with its temperature; only ``reference_c`` is required."""

    focal_ppm_per_k: float
    """Relative change of both focal lengths, millionths per kelvin."""
    cx_px_per_k: float
    """Motion of the principal point along x, px per kelvin."""
    cy_px_per_k: float
    """Motion of the principal point along y, px per kelvin."""
    untold_sigma_k: float
    """1σ of the temperature of a picture that comes without one, K."""


class Camera(TypedDict, total=False):
    """The calibration. Pixel centres are at integers, x points right, y down, z forward, as in OpenCV."""

    width: int
    """Columns of the picture, px. Values: 2 to 65535."""
    height: int
    """Rows of the picture, px. Values: 2 to 65535."""
    model: Literal["kannala-brandt", "equidistant", "pinhole", "brown-conrady", "double-sphere", "eucm"] | None
    """Projection of the lens. Default: ``kannala-brandt``."""
    fx_px: float
    """Focal length along x, px. Values: above 0 px."""
    fy_px: float
    """Focal length along y, px. Values: above 0 px."""
    cx_px: float
    """Column of the principal point, px. Values: −1 to 2 times the width."""
    cy_px: float
    """Row of the principal point, px. Values: −1 to 2 times the height."""
    k: _Numbers | None
    """Coefficients: k1 to k4 of ``kannala-brandt``, k1, k2, p1, p2, k3 of ``brown-conrady``, ξ, α of
    ``double-sphere``, α, β of ``eucm``. Values: at most as many as the model has; the lens must be monotone."""
    theta_max_deg: float | None
    """Radius of the image circle, degrees off the optical axis; pixels beyond it count as masked. Values: 0.1 to 175
    deg."""
    theta_min_deg: float | None
    """Radius of the blind centre, degrees off the optical axis; pixels nearer to the axis count as masked. Values:
    0.1 to 175 deg."""
    focal_sigma_percent: float | None
    """1σ of the focal length, the same for both axes, in percent; it widens the covariance. Values: 0 to 100 %.
    Default: 0."""
    centre_sigma_px: float | None
    """1σ of each coordinate of the principal point, px; it widens the covariance. Values: 0 to 1e6 px. Default: 0."""
    covariance: CameraCovariance | None
    """Covariance of the intrinsic parameters, used instead of the two sigmas; ``order`` names rows and columns
    (``fx_px``, ``fy_px``, ``cx_px``, ``cy_px``, ``k1`` ...), ``rows`` is the matrix. Values: symmetric, positive
    semidefinite."""
    temperature: CameraTemperature | None
    """Change of the lens with the temperature of the camera: ``reference_c``, ``focal_ppm_per_k``, ``cx_px_per_k``,
    ``cy_px_per_k``, and ``untold_sigma_k`` for pictures without a temperature. Values: focal length and centre
    change by at most 1 % of the focal length."""
    readout_s: float | None
    """Rolling shutter: time from the exposure of the first row to that of the last row, s; 0 for a global shutter,
    negative if the last row comes first. Values: −10 to 10 s. Default: 0."""
    file: str | None
    """A Kalibr, OpenCV, EuRoC or ROS camera_info file with the calibration. Its path is relative to this
    sensor.toml. Of the other keys of ``[camera]``, only ``camera``, ``theta_max_deg``, ``theta_min_deg``,
    ``readout_s``, ``temperature``, the sigmas and ``covariance`` are allowed with it. Values: a path."""
    camera: str | None
    """Name of the camera in ``file``. Values: a name in the file. Default: the first one."""


class Mount(TypedDict):
    """How the camera is mounted in the vehicle."""

    q_vehicle_from_camera_wxyz: _Numbers
    """Quaternion that converts camera coordinates to vehicle coordinates, scalar first; with it the results have
    roll, pitch, and the axis in the vehicle's frame. Values: unit quaternion. Default: no mounting."""


class Input(TypedDict, total=False):
    """Conversion of a pixel to one brightness."""

    channel: Literal["mean", "red", "green", "blue"]
    """Channel that gives the brightness of a colour pixel, or their mean. Default: "mean"."""
    bits: int | None
    """Significant bits of a sample, if the file's words have room for more. Values: 8 to 16. Default: from the file;
    for 16-bit words, determined from the pictures."""
    tone: Literal["linear", "srgb", "bt709", "unknown"] | float | None
    """Curve between light and counts, a word or a gamma; with it an edge is located at half of the light. Default:
    from the file, else ``unknown``."""
    orient: Literal["as-stored", "exif", "rotate-90", "rotate-180", "rotate-270"]
    """Rotation of a picture before it is processed; the camera's size and calibration are those of the rotated
    picture. Default: "as-stored"."""
    invert: bool
    """Whether the brightness is inverted, so that dark becomes bright: for a dark body before a bright sky. Values:
    true or false. Default: false."""
    scale_to_height: int | None
    """Number of rows of a smaller copy of the picture, which is processed instead of the picture; lengths in pixels
    are then those of the copy. Values: 16 to ``height``."""


class Brightness(TypedDict, total=False):
    """The brightness that a picture must have to be processed."""

    min_mean: float
    """Smallest mean brightness of the picture, as a fraction of full scale; a darker picture has the status
    ``too-dark``. Values: 0 to 1. Default: 0.0."""
    max_mean: float
    """Largest mean brightness of the picture, as a fraction of full scale; a brighter picture has the status
    ``too-bright``. Values: 0 to 1. Default: 0.98."""


class Threshold(TypedDict, total=False):
    """The threshold between dark and lit."""

    method: Literal["otsu", "fixed", "dynamic", "track"]
    """Method that finds the threshold. Default: "otsu"."""
    level: float
    """For ``fixed``: a pixel is lit at this value or above, in the picture's own counts; a value below 1 is a
    fraction of full scale. Values: above 0 to 65535. Default: 64.0."""
    factor: float
    """For ``dynamic``: the threshold is this factor times the mean of the sample; a larger factor gives a higher
    threshold. Values: above 0 to 100. Default: 1.0."""
    scale: float
    """For ``otsu``: factor by which the threshold is multiplied; a larger factor gives a higher threshold. Values:
    0.1 to 10. Default: 1.0."""


class Mask(TypedDict, total=False):
    """Parts of the vehicle in view."""

    polygons_px: _Polygons
    """Areas that are ignored, as polygons of corners [x, y], px; no pixel in them is lit, and their outline is not
    an edge. Values: up to 8 polygons of 3 to 16 corners."""


class Contour(TypedDict, total=False):
    """The search for edges."""

    method: Literal["border-following", "raster", "erode", "sobel"]
    """How edges are found. Default: "border-following"."""
    line_spacing_px: int | None
    """Rows between two search lines for edges that do not touch the border of the picture, px. Values: 1 or more px.
    Default: from the body's expected size."""
    erode_size_px: int
    """For ``erode``: side of the square neighbourhood, px. Values: odd, 3 to 31. Default: 3."""
    erode_threshold: int
    """For ``erode``: a lit pixel with fewer lit pixels in its neighbourhood, itself included, is an edge pixel.
    Values: 1 to the square of ``erode_size_px``. Default: 9."""


class Edge_points(TypedDict, total=False):
    """Edges that are candidates for the limb, and their edge points."""

    min_points: int
    """Fewest border pixels of an edge that may be the limb; a small body or picture needs fewer. Values: 3 or more.
    Default: 40."""
    keep_points: int
    """Points kept per edge, evenly along it; 0 keeps all that fit into memory. Values: 0 (all) or 16 to 65535.
    Default: 600."""
    sub_pixel: Literal["linear", "none", "erf", "zernike"]
    """How a border pixel becomes an edge point. Default: "linear"."""
    blur_px: float
    """For ``zernike``: blur of the optics, px (standard deviation); 0 takes an edge for an ideal step. Values: 0 to
    3 px. Default: 0.0."""


class Consensus(TypedDict, total=False):
    """The cone that most edge points agree on, and their outliers."""

    method: Literal["two-point", "none", "ransac", "ransac-preverify", "mlesac"]
    """How the inliers are found. Default: "two-point"."""
    threshold_px: float
    """Largest distance from the limb at which a point belongs to the consensus, px; the fit ``sphere`` also weights
    points up to twice as far away. Values: above 0 to 1000 px. Default: 3.0."""
    noise_sigma: float
    """Where an edge is noisy, the largest distance rises from ``threshold_px`` to this many times the noise from
    point to point; 0 keeps it at ``threshold_px``. Values: 0 to 100. Default: 2.0."""
    seed: int
    """Seed of the random draws; the same seed gives the same answer. Values: 0 to 4294967295. Default: 1."""
    max_draws: int
    """Largest number of draws; 800 find the limb among 80 % of outliers. Values: 1 to 100000. Default: 800."""


class Fit(TypedDict, total=False):
    """The fit of the cone."""

    method: Literal["sphere", "direct", "conic", "tls", "wtls", "least-squares", "generalised-tls", "circle"]
    """How the cone is fitted. Default: "sphere"."""
    half_angle: Literal["fused", "known", "free"]
    """Which half-angle the fitted cone has. Default: "fused"."""
    position: bool | None
    """Whether the fit gives the position of the body's centre: the whole vector with its covariance. An ellipsoid
    then needs its orientation in each prior: an attitude, or for a body of revolution its pole. Values: true or
    false. Default: true for ``ellipsoid`` and the planets with a name."""
    yaw_limit_deg: float
    """Largest 1σ at which the rotation about the line to the body is reported, degrees; 0 never reports it. The
    rotation needs ``fit.position`` and a body that is not a sphere. Values: 0 to 180 deg. Default: 1.0."""
    weigh_above_deg: float
    """For ``wtls``: points are weighted where the axis is farther from the optical axis than this, degrees; 0 always
    weights them. Values: 0 to 180 deg. Default: 0.0."""


class Covariance(TypedDict, total=False):
    """The errors of edge points as a Gauss-Markov process along the limb."""

    method: Literal["sandwich", "braun-barf"]
    """Method that computes the covariance. Default: "sandwich"."""
    noise: Literal["rms", "told", "reml"]
    """Source of the noise: the residuals of each picture, with the values below as their floor (``rms``, ``reml``),
    or the values below (``told``). Default: "rms"."""
    sigma_px: float
    """1σ of an edge point, px; raised to the RMS of the residuals if that is larger. Values: above 0 to 10000 px.
    Default: 0.1."""
    correlation_px: float
    """Correlation length of the errors of edge points along the edge, px; 0 for white errors. Values: 0 to 1e6 px.
    Default: 60.0."""
    bias_px: float
    """1σ of a shift that all points of an edge have in common, px. Values: 0 to 10000 px. Default: 0.3."""
    tilt_px: float
    """1σ of a tilt that the whole edge has in common, px: an error that goes from −1 to 1 times this value along the
    edge. Values: 0 to 10000 px. Default: 0.1."""
    bend_px: float
    """1σ of a bend that the whole edge has in common, px: an error that is this value at both ends of the edge, and
    minus half of it in the middle. Values: 0 to 10000 px. Default: 0.0."""
    white_px: float
    """1σ of the part of an edge point's error that is new at every point, px. ``hzn calibrate noise`` measures it.
    Values: 0 to 10000 px. Default: 0.0."""
    protection_probability: float
    """Probability with which the error of an answer exceeds its protection level (the column ``protection_deg``).
    Values: 0.0001 to 0.01. Default: 0.0001."""
    overbound: bool
    """For ``braun-barf``: whether the largest variance is used in every direction. Values: true or false. Default:
    false."""


class Gates(TypedDict, total=False):
    """The gates that an answer must pass, and the choice among answers."""

    min_inliers: int
    """Fewest inliers; a small body or picture needs fewer. Values: 3 or more. Default: 24."""
    min_arc_px: float | None
    """Shortest length of edge that inliers must cover, px. Values: 0 to 1e6 px. Default: a tenth of the diagonal, or
    a third of the body's circumference if less."""
    max_rms_px: float
    """Largest weighted RMS distance of the inliers from the limb, px; where ``consensus.noise_sigma`` raises the
    largest distance of an inlier, this limit is raised by the same factor. Values: above 0 px. Default: 2.0."""
    max_half_angle_sigma: float
    """Largest difference between the fitted and the expected half-angle, in standard deviations. Values: above 0.
    Default: 3.0."""
    max_sigma_deg: float
    """Largest standard deviation of an answer in its worst direction, degrees. Values: above 0 to 180 deg. Default:
    10.0."""
    min_support: float
    """Smallest part of the fitted limb in view that edge points must cover. Values: 0 to 1. Default: 0.4."""
    max_lit_sky: float
    """Largest part of the sky beyond the fitted limb that may be lit. Values: 0 to 1. Default: 0.3."""
    dark_sky: float
    """For Sun and Moon, and for a position without a known range: brightness from which a place in the sky counts as
    lit, as a fraction of the threshold. Values: above 0 to 1. Default: 0.25."""
    whole_edge: float
    """Smallest part of an edge's points that must be inliers if the edge winds; 0 turns the check off. Values: 0 to
    1. Default: 0.8."""
    max_rival_ratio: float
    """Largest ratio of the cone's RMS residual to that of a circle of the image or of up to four straight pieces;
    1e6 turns this test off. Values: 1 to 1e6. Default: 2.0."""
    min_evidence: float
    """Smallest evidence for the limb over a straight line, and largest evidence for a rival shape over the limb:
    twice the logarithm of the likelihood ratio; −1e6 turns these tests off. Values: −1e6 to 1e6. Default: 9.0."""
    residual_floor_px: float
    """Floor of the noise in the second test of the half-angle, px; this test takes the noise from the residuals,
    even if the told noise is larger. With 0 the test is off, and with 1e4 it uses the told noise. Values: 0 to 10000
    px. Default: 0.1."""
    max_departure: float
    """Longest smooth continuation of an edge next to the fitted limb, as a part of its longest run of inliers; 1e6
    turns the gate off. Values: 0 to 1e6. Default: 0.2."""
    min_support_abrupt: float
    """Smallest part of the fitted limb in view that edge points must cover if the edge leaves the limb without a
    loss of contrast; 0 turns the gate off. Values: 0 to 1. Default: 0.0."""
    max_glow: float
    """Largest brightness high above the limb, as a part of the brightness step at the limb; 1e6 turns the gate off.
    Values: 0 to 1e6. Default: 0.125."""
    max_band: float
    """Largest part of the inliers at which a second edge inside the limb leads back to the brightness of the sky; 1
    turns the gates ``band`` and ``faint`` off. Values: 0 to 1. Default: 0.5."""
    min_p_limb: float
    """Smallest probability that the edge of an answer is the limb (column ``p_limb``); 0 turns the gate off. Values:
    0 to 1. Default: 0.0."""
    prior_odds: float
    """Odds that an edge that passes all other gates is the limb, before its evidence is weighed. Values: above 0 to
    1e9. Default: 50.0."""
    max_attitude_sigma: float
    """Largest angle between the axis and the axis that a given attitude and position predict, in combined standard
    deviations of the answer and of that attitude. Values: above 0 to 1e6. Default: 4.0."""
    max_rate_deg_s: float | None
    """Largest rate of rotation of the vehicle, degrees per second; an axis that is farther from the previous answer
    is refused. Values: above 0 to 1e6 deg/s. Default: any."""
    fixed_edge: Literal["refuse", "warn", "off"]
    """Treatment of an answer whose edge stays in the picture while the vehicle turns: the edge belongs to the
    window, the lens or the vehicle. Default: "refuse"."""
    fixed_edge_sigma: float
    """Evidence for an edge that is fixed in the picture from which ``fixed_edge`` acts, in standard deviations.
    Values: above 0 to 1000. Default: 3.0."""
    max_unlit: float
    """Largest part of the inliers that the given Sun does not light; 1 turns the gate off, and so does ``body.sunlit
    = false``, which is for a thermal camera. Values: 0 to 1. Default: 0.5."""
    choice: Literal["score", "section-residual", "longest"]
    """Which of several edges that pass is the answer. Default: "score"."""
    limb_in_view: bool
    """Whether a part of the expected limb must lie in the picture: the limb with the expected half-angle about the
    fitted axis. Values: true or false. Default: false."""
    max_section_residual: float | None
    """Largest mean square distance of the points from the expected conic section, focal lengths squared. Values:
    above 0. Default: any."""
    altitude_limits_km: _Numbers | None
    """[lowest, highest] altitude, km: the radius of the fitted circle must be that of a limb between them. Values: 0
    to 1e9 km. Default: any."""
    radius_margin: float
    """With ``altitude_limits_km``: the radius may lie beyond its limits by this fraction of each limit. Values: 0 to
    1000. Default: 0.1."""
    radius_margin_px: float
    """With ``altitude_limits_km``: the radius may lie beyond its limits by this length, px. Values: 0 to 1e6 px.
    Default: 0.0."""


class Retry(TypedDict, total=False):
    """Further looks at a picture without an answer."""

    levels: _Numbers
    """Thresholds of further looks, on a scale from the mean of the dark pixels (0) to the first look's threshold
    (1); ``[]`` allows only one look. Values: 0 to 4. Default: [0.5, 0.25, 2.0, 0.0]."""
    min_sigma: float
    """Lowest threshold of every look, in standard deviations of the dark pixels' noise above their mean; a ``fixed``
    threshold is kept. Values: 0 to 100. Default: 3.0."""
    frame_px: int
    """Widest dark frame around the picture that is detected and left out, px; 0 turns the detection off. Values: 0
    to 64 px. Default: 8."""
    method: Literal["none", "division"]
    """The step that follows when no edge of the whole picture gives an answer. Default: "none"."""
    least_part: float
    """For ``division``: parts below this fraction of the picture's area are not cut again; a smaller value costs
    more time. Values: 0.015625 to 1. Default: 0.1."""
    combine: Literal["median", "mean"]
    """For ``division``: method that combines the answers of several parts. Default: "median"."""


class Track(TypedDict, total=False):
    """The search of a limb where the picture before puts it, in a sequence."""

    full_every: int
    """Number of pictures from one full search to the next in a sequence; in between, the limb is first looked for
    where the last answer puts it. 0 searches every picture fully. Values: 0 to 65535. Default: 0."""
    normals: int
    """Number of places along the predicted limb at which its edge is looked for; a larger number is more accurate
    and takes longer. Values: 32 to 2048. Default: 128."""


class Limits(TypedDict, total=False):
    """The bound on the time of the worst picture."""

    max_work: int | None
    """Work budget for one picture and one body, in steps of the border follower; when it is used up, the best answer
    so far counts. Values: 10000 to 1e9. Default: 245 760 on a flight computer, 1 966 080 on the host."""


class Body(TypedDict, total=False):
    """The body that the sensor searches for; each of several ``[[bodies]]`` has the same keys."""

    kind: Literal["earth", "earth-sphere", "sun", "moon", "sphere", "ellipsoid", "mercury", "venus", "mars", "jupiter", "saturn", "uranus", "neptune", "pluto", "ceres", "vesta", "phobos", "deimos", "io", "europa", "ganymede", "callisto", "mimas", "enceladus", "tethys", "dione", "rhea", "titan", "iapetus", "miranda", "ariel", "umbriel", "titania", "oberon", "triton", "charon"]
    """The body that the sensor searches for. Default: "earth"."""
    radius_km: float | None
    """Radius of a ``sphere``, km; not allowed for other bodies. Values: above 0, for ``sphere`` only."""
    radii_km: _Numbers | None
    """Semi-axes of an ``ellipsoid`` along its own x, y and z axes (z to the north pole), km; not allowed for other
    bodies, because a planet with a name has its own. Values: three lengths above 0, for ``ellipsoid`` only."""
    radii_sigma_km: float
    """1σ of each semi-axis, km; it widens the covariance of the position (``fit.position``). Values: 0 to 100000 km.
    Default: 0.0."""
    range_km: float | None
    """Distance of the camera from the body's centre for pictures without one in their prior, km, with
    ``fit.position``; it needs ``range_sigma_km``. Values: above 0 km."""
    range_sigma_km: float | None
    """1σ of ``range_km``, and of the column ``range_km`` of frames.csv if that has no ``range_sigma_km``, km.
    Values: 0 to 1e12 km."""
    altitude_km: float | None
    """Altitude of the camera for pictures without an altitude in their prior, km; above WGS-84 for ``earth``, else
    above the radius, which is the mean of the three semi-axes for an ellipsoid. Values: above 0 km."""
    altitude_sigma_km: float
    """1σ of the altitude, km; it widens the expected half-angle. Values: 0 to 1e6 km. Default: 0.5."""
    altitude_reference: Literal["ellipsoid", "sphere"]
    """For ``earth``: the surface from which an altitude without a position is measured. Default: "ellipsoid"."""
    limb: Literal["visible", "co2-15um", "window-8-14um", "height"]
    """Where the limb height comes from. Default: "visible"."""
    limb_height_km: float
    """Height of the visible limb above the surface, km; 17 km is right for a cloudless limb in sunlight at 550 nm.
    Values: −50 to 500 km. Default: 17.0."""
    limb_height_sigma_km: float
    """1σ of the limb height, km; 7 km spans the visible wavelengths and usual tones. Values: 0 to 10000 km. Default:
    7.0."""
    limb_tilt_sigma_km: float | None
    """1σ of a tilt of the limb, km: the amplitude of a height that varies with the azimuth like a cosine, along each
    of two axes. Values: 0 to 1000 km. Default: from the band."""
    night: Literal["refuse", "airglow"]
    """What the sensor does in a picture in which the Sun is known to be down, from time and position. Default:
    "refuse"."""
    airglow_height_km: float
    """Height of the outer edge of the airglow above the surface, km; for ``night = "airglow"``. At this height it
    has half of its light in the picture if ``input.tone`` is known, and else half of its counts. Values: 60 to 400
    km. Default: 106.0."""
    airglow_height_sigma_km: float
    """1σ of ``airglow_height_km``, km. Values: 0 to 10000 km. Default: 8.0."""
    limb_height_harmonic_sigma_km: float | None
    """1σ of the second harmonic of the limb height along the limb, km; it limits how well the rotation about the
    line to the body is known (``fit.yaw_limit_deg``). Values: 0 to 10000 km. Default: ``limb_height_sigma_km``."""
    clipped_height_km: float
    """Height that overexposure adds to the limb, km; it is multiplied by the fraction of the limb that is clipped at
    full scale. Values: 0 to 500 km. Default: 7.8."""
    clipped_sigma_km: float
    """1σ of ``clipped_height_km``, km; it also stands for the variation along the limb, and a larger value widens
    the covariance. Values: 0 to 10000 km. Default: 4.5."""
    limb_height_by_latitude_km: _Rows | None
    """Limb height by latitude instead of ``limb_height_km``: rows of [geodetic latitude in degrees, height in km],
    with rising latitudes. Values: up to 16 rows, for ``earth``."""
    sunlit: bool | None
    """Whether only the sunlit part of the limb counts as limb; this needs the direction to the Sun. In visible
    light, set true: near the terminator the light fades, and the edge is too low there. Values: true or false.
    Default: true for all but ``earth``, ``earth-sphere`` and ``sun``."""
    threshold: Threshold | None
    """Threshold for this body, as a table with the keys of ``[threshold]``. Values: the keys of ``[threshold]``.
    Default: ``[threshold]``; ``fixed`` at 0.9 for a ``sun`` among several bodies."""
    covariance: Covariance | None
    """Noise model of edge points for this body, as a table with the keys of ``[covariance]``. Values: the keys of
    ``[covariance]``. Default: ``[covariance]``."""


class _Optional(TypedDict, total=False):
    """The sections that may be left out."""

    preset: Literal["hzn", "sun", "moon", "dlr-2022", "zju-2022", "horace-2014", "horace-2015"] | None
    """Named starting values of the whole sensor; keys in the file replace them. Default: ``hzn``."""
    mount: Mount
    """How the camera is mounted in the vehicle."""
    body: Body
    """The body that the sensor searches for; each of several ``[[bodies]]`` has the same keys."""
    bodies: Sequence[Body]
    """Several bodies in one picture, instead of ``body``. The sensor searches in this order, for Sun and Moon last."""
    input: Input
    """Conversion of a pixel to one brightness."""
    brightness: Brightness
    """The brightness that a picture must have to be processed."""
    threshold: Threshold
    """The threshold between dark and lit."""
    mask: Mask
    """Parts of the vehicle in view."""
    contour: Contour
    """The search for edges."""
    edge_points: Edge_points
    """Edges that are candidates for the limb, and their edge points."""
    consensus: Consensus
    """The cone that most edge points agree on, and their outliers."""
    fit: Fit
    """The fit of the cone."""
    covariance: Covariance
    """The errors of edge points as a Gauss-Markov process along the limb."""
    gates: Gates
    """The gates that an answer must pass, and the choice among answers."""
    retry: Retry
    """Further looks at a picture without an answer."""
    track: Track
    """The search of a limb where the picture before puts it, in a sequence."""
    limits: Limits
    """The bound on the time of the worst picture."""


class Sections(_Optional):
    """The sections of a sensor.toml: the keyword arguments of `hzn.Sensor`. Only ``camera`` is required."""

    camera: _hzn.Camera | Camera


class Parameters(_Optional):
    """All parameters of a sensor: `hzn.Sensor.parameters`."""

    camera: Camera
