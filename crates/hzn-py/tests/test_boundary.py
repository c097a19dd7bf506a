"""Any Python object at the boundary of the Rust part gets an answer or a Python error that a caller can expect.

A panic of the Rust part is an exception that is not derived from Exception, so it fails these tests, as a crash does.
"""

import math
from typing import get_args, get_type_hints

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import hzn
from conftest import CAMERA, PARAMETERS, limb

EXPECTED = (TypeError, ValueError, OverflowError)
SENSOR = hzn.Sensor(**PARAMETERS)
SMALL = hzn.Sensor(
    camera=dict(CAMERA, width=24, height=16, fx_px=20.0, fy_px=20.0, cx_px=11.5, cy_px=7.5), body=PARAMETERS["body"]
)
MANY = settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))

numbers = st.one_of(
    st.floats(),
    st.integers(-(2**70), 2**70),
    st.sampled_from([0, -1, 1e308, 5e-324, math.nan, 6378.137, 7000.0]),
)
things = st.one_of(st.none(), st.booleans(), numbers, st.text(max_size=5), st.binary(max_size=5))
vectors = st.one_of(
    st.lists(numbers, max_size=6),
    arrays.arrays(
        st.sampled_from([np.float64, np.float32, np.int32]),
        arrays.array_shapes(min_dims=0, max_dims=2, min_side=0, max_side=5),
    ),
    things,
)
values = st.recursive(
    st.one_of(things, vectors),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
)


@st.composite
def pictures(draw, height=16, width=24):
    """Draw an array: any type and shape, or pixels of the right shape seen through any strides."""
    if draw(st.booleans()):
        dtype = st.one_of(
            arrays.integer_dtypes(),
            arrays.unsigned_integer_dtypes(),
            arrays.floating_dtypes(),
            st.just(np.dtype(bool)),
            st.just(np.dtype("O")),
        )
        shape = arrays.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=30)
        return np.zeros(draw(shape), draw(dtype))
    channels = draw(st.sampled_from([(), (1,), (3,), (4,)]))
    steps = draw(st.tuples(*[st.sampled_from([1, -1, 2, 3])] * (2 + len(channels))))
    whole = [abs(step) * n for step, n in zip(steps, (height, width, *channels), strict=True)]
    seed, dtype = draw(st.integers(0, 2**32 - 1)), draw(st.sampled_from([np.uint8, np.uint16]))
    pixels = np.random.default_rng(seed).integers(0, np.iinfo(dtype).max, whole, dtype, endpoint=True)
    if draw(st.booleans()):
        pixels = np.asfortranarray(pixels)
    return pixels[tuple(slice(None, None, step) for step in steps)]


PRIOR = [
    "altitude_km",
    "position_km",
    "attitude",
    "attitude_sigma_deg",
    "rate_rad_s",
    "range_km",
    "range_sigma_km",
    "pole",
    "sun",
    "time_s",
    "camera_temperature_c",
    "bits",
    "detail",
]


def check(report):
    """Check what every report promises."""
    if report.ok:
        sigma = np.linalg.eigvalsh(report.covariance)
        assert np.isfinite(report.axis).all() and np.isfinite(sigma).all() and sigma.min() > -1e-12 * sigma.max()
        assert abs(np.linalg.norm(report.axis) - 1) < 1e-6


@MANY
@given(pictures(), st.dictionaries(st.sampled_from(PRIOR), vectors, max_size=5))
def test_pictures_and_priors(picture, prior):
    try:
        report = SMALL.process(picture, **prior)
    except EXPECTED:
        return
    check(report)


@MANY
@given(st.dictionaries(st.sampled_from(PRIOR), vectors, max_size=5))
def test_priors_of_a_picture_with_a_limb(prior):
    try:
        report = SENSOR.process(limb(), **prior)
    except EXPECTED:
        return
    check(report)


@MANY
@given(values)
def test_no_pictures(picture):
    with pytest.raises(EXPECTED):
        SMALL.process(picture)


SECTIONS = {name: kind for name, kind in get_type_hints(hzn.keys.Sections).items()}


def keys_of(kind):
    """Return the names of the keys of a section, also if it is optional or a list."""
    inner = [keys_of(k) for k in get_args(kind)]
    return sorted({*getattr(kind, "__annotations__", {}), *(name for names in inner for name in names)})


KEYS = {name: keys_of(kind) for name, kind in SECTIONS.items()}


@st.composite
def parameters(draw):
    """Draw valid parameters with some keys replaced."""
    sections = {"camera": dict(SMALL.parameters["camera"]), "body": dict(PARAMETERS["body"])}
    for name in draw(st.lists(st.sampled_from(sorted(KEYS)), min_size=1, max_size=3)):
        section = draw(st.one_of(values, st.just(None))) if draw(st.integers(0, 5)) == 0 else sections.get(name, {})
        if isinstance(section, dict) and KEYS[name]:
            section = {**section, draw(st.sampled_from(KEYS[name])): draw(values)}
        sections[name] = section
    return sections


@MANY
@given(parameters(), st.booleans())
def test_parameters(sections, flight):
    assert sum(map(bool, KEYS.values())) > 8, KEYS
    try:
        sensor = hzn.Sensor(flight=flight, **sections)
    except EXPECTED:
        return
    assert hzn.Sensor(flight=flight, **sensor.parameters) == sensor
    size = (sensor.camera.height, sensor.camera.width)
    if size == (16, 24):
        check(sensor.process(np.zeros(size, np.uint8), altitude_km=400.0))


@MANY
@given(vectors, arrays.arrays(np.float64, arrays.array_shapes(max_dims=3, max_side=4), elements=st.floats()))
def test_points_of_a_camera(any_points, points):
    camera = SENSOR.camera
    for call in (camera.project, camera.unproject, camera.undistort_points, camera.jacobian):
        for argument in (any_points, points):
            try:
                found = call(argument)
            except EXPECTED:
                continue
            assert len(found) == len(argument)


RAYS = hzn.rays.of(SENSOR, [[160.0, 100.0], [170.0, 101.0], [180.0, 102.5], [200.0, 106.0]], [[0.0, 1.0]] * 4)


@MANY
@given(vectors, vectors, st.one_of(numbers, things))
def test_stages(first, second, number):
    expected = SENSOR.expect(altitude_km=400.0)

    def fit():
        cone = hzn.consensus.Cone(first, number)
        return hzn.covariance.fuse(SENSOR, RAYS, hzn.fit.cone(SENSOR, RAYS, cone, expected) or cone, expected)

    def weigh():
        rays = hzn.rays.of(SENSOR, first, second)
        rays.weights = second
        return hzn.consensus.keep(SENSOR, rays, expected)

    calls = [
        fit,
        weigh,
        lambda: hzn.contour.points(SENSOR, limb(), number, first),
        lambda: hzn.contour.find(SENSOR, limb(), number, expected),
        lambda: SENSOR.expect(altitude_km=number, position_km=first, attitude=second),
        lambda: hzn.Cone(first, number),
    ]
    for call in calls:
        try:
            call()
        except (*EXPECTED, AttributeError):
            continue


@MANY
@given(st.lists(vectors, min_size=3, max_size=3), st.lists(numbers, min_size=2, max_size=2))
def test_navigation(arguments, scalars):
    a, b, c = arguments
    x, y = scalars
    nav = hzn.nav.Filter(
        0.0,
        np.eye(3),
        np.zeros(3),
        [7e6, 0.0, 0.0],
        mounts=[np.eye(3)],
        attitude_sigma_rad=0.1,
        velocity_sigma=1.0,
        position_sigma=100.0,
    )
    calls = [
        lambda: hzn.nav.triad((a, b), (b, c)),
        lambda: hzn.nav.wahba(a, b, c),
        lambda: hzn.nav.sun(x),
        lambda: hzn.nav.moon(x),
        lambda: hzn.nav.Filter(x, a, b, c, attitude_sigma_rad=y, velocity_sigma=y, position_sigma=y),
        lambda: nav.predict(x, a, b),
        lambda: nav.update_position(a, y),
        lambda: nav.update_velocity(b, y),
        lambda: nav.update_attitude(c, y),
    ]
    for call in calls:
        try:
            call()
        except EXPECTED:
            continue
    covariance = nav.covariance
    assert np.isfinite(covariance).all() and np.linalg.eigvalsh(covariance).min() > -1e-9 * np.abs(covariance).max()
