"""Renders pictures of the Earth's limb. This program shares no code with hzn and its simulator.

A flight has one camera. Its lens, exposure, noise, tone curve and file format are drawn at random, and so are the
altitude, the clouds, the Sun and the attitude of each picture. The Earth is the WGS-84 ellipsoid. Each pixel has one line of
sight, which meets the ground or passes it at a tangent height:

* Light of the air: 1 - exp(-tau). The optical depth tau along the limb decays exponentially with the tangent height. The
  vertical optical depths of red, green and blue are 0.06, 0.11 and 0.24.
* Ground: ocean, land and clouds from sums of plane waves on the sphere, seen through the air.
* Sunlight: full above the horizon, and weaker by a smooth step of a few degrees around the terminator. With `shade` it is
  light that the air scatters once: the Sun's way through the air weakens it, most of all in deep air (ScatteredOnce).

The camera adds the Sun with a halo, ghosts (discs and rings), stray light, vignetting, stars, blur, noise, clipping at
full scale, an sRGB or a linear tone curve, and JPEG artefacts.

Simplifications: the light is not refracted, the Earth's shadow has no height, and no light is scattered twice.
"""

import dataclasses
import math
import pathlib

import cv2
import numpy as np

EQUATOR_KM, POLE_KM = 6378.137, 6356.752314
MEAN_KM = 6371.0
AXES_KM = np.array([EQUATOR_KM, EQUATOR_KM, POLE_KM])
WIDTH, HEIGHT = 960, 720
# Height of a usual limb, km. It only decides which pixels count as limb, and which axis is the truth.
LIMB_KM = 17.0
VERTICAL_DEPTH = np.array([0.06, 0.11, 0.24])
# Sine of the Sun's elevation at which half of the light is left, and the width of the step.
TERMINATOR, TWILIGHT = -0.03, 0.035
SUN_RADIUS_RAD = 0.0047
ATTITUDE_SIGMA_DEG = 5.0

# Sun's elevation below the camera in degrees, and exposure: 1 makes white clouds about as bright as full scale.
CLASSES = {
    "day": ((25.0, 80.0), (0.45, 1.3)),
    "day, overexposed": ((25.0, 80.0), (1.3, 3.0)),
    "low Sun": ((-5.0, 15.0), (0.45, 1.3)),
}
# The same for pictures from far away, where the Earth is a disc; and the altitudes of both, km.
FAR_CLASSES = {"far": ((25.0, 80.0), (0.45, 3.0))}
ALTITUDES_KM, FAR_ALTITUDES_KM = (70, 900), (3000, 60000)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


class Waves:
    """A random pattern on the sphere: plane waves of several frequencies."""

    def __init__(self, rng, octaves):
        self.waves = []
        for frequency, count in octaves:
            for _ in range(count):
                wave = unit(rng.normal(size=3)) * frequency * rng.uniform(0.7, 1.4)
                self.waves.append((wave, rng.uniform(0, 2 * math.pi), frequency**-0.45 / math.sqrt(count)))

    def at(self, points):
        total = np.zeros(len(points), np.float32)
        for wave, phase, amplitude in self.waves:
            total += amplitude * np.cos((points @ wave).astype(np.float32) + phase)
        return total


@dataclasses.dataclass
class Lens:
    """A lens in hzn's names: focal length, centre, coefficients, and the image circle in radians (None: no circle)."""

    model: str
    focal_px: float
    centre_px: tuple
    k: list
    field_rad: float
    circle_rad: float | None

    def rays(self):
        """Returns the unit vector of each pixel, and whether the pixel sees anything."""
        u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
        x, y = (u - self.centre_px[0]) / self.focal_px, (v - self.centre_px[1]) / self.focal_px
        if self.model in ("pinhole", "brown-conrady"):
            a, b = x.copy(), y.copy()
            if self.k:
                k1, k2, p1, p2, _ = self.k
                for _ in range(60):
                    r2 = a * a + b * b
                    g = 1 + k1 * r2 + k2 * r2 * r2
                    da, db = 2 * p1 * a * b + p2 * (r2 + 2 * a * a), p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
                    a, b = (x - da) / g, (y - db) / g
            return unit(np.stack([a, b, np.ones_like(a)], -1)), np.ones(x.shape, bool)
        radius = np.hypot(x, y)
        angle = np.linspace(0, math.pi, 40001)
        k1, k2 = (self.k or [0.0, 0.0])[:2]
        image = angle * (1 + k1 * angle**2 + k2 * angle**4)
        falling = np.nonzero(np.diff(image) <= 0)[0]
        end = falling[0] if len(falling) else len(angle) - 1
        theta = np.interp(radius, image[: end + 1], angle[: end + 1], right=math.pi)
        scale = np.where(radius > 1e-9, np.sin(theta) / np.maximum(radius, 1e-9), 1.0)
        seen = theta <= (self.circle_rad or 3.1)
        return np.stack([x * scale, y * scale, np.cos(theta)], -1), seen


def draw_lens(rng):
    model = rng.choice(["pinhole", "brown-conrady", "kannala-brandt", "kannala-brandt", "equidistant"])
    centre = ((WIDTH - 1) / 2 + 0.01 * WIDTH * rng.normal(), (HEIGHT - 1) / 2 + 0.01 * WIDTH * rng.normal())
    if model in ("pinhole", "brown-conrady"):
        field = math.radians(rng.uniform(25, 95))
        edge = math.tan(field / 2)
        k1 = rng.uniform(-0.07, 0.05) * min(1.0, edge**-2)
        k = [k1, 0.0, 3e-4 * rng.normal(), 3e-4 * rng.normal(), 0.0] if model == "brown-conrady" else []
        return Lens(model, WIDTH / 2 / edge, centre, k, field, None)
    field = math.radians(rng.uniform(90, 185))
    # The corner of the picture is up to 1.3 times as far off the axis as its side.
    circle = 0.475 * field if field > 2.2 or rng.random() < 0.5 else None
    k = [rng.uniform(-0.04, 0.02), rng.uniform(-0.002, 0.002), 0.0, 0.0] if model == "kannala-brandt" else []
    return Lens(model, WIDTH / field, centre, k, field, circle)


@dataclasses.dataclass
class World:
    """What all pictures of a flight share."""

    scale_height_km: float
    air: np.ndarray
    clouds: Waves
    continents: Waves
    cover: float
    softness: float
    shade: "ScatteredOnce | None" = None


def draw_world(rng):
    return World(
        scale_height_km=rng.uniform(6.5, 8.5),
        air=np.array([0.55, 0.62, 0.75]) * rng.uniform(0.6, 1.2),
        clouds=Waves(rng, ((8, 6), (25, 10), (80, 14), (250, 18), (700, 20))),
        continents=Waves(rng, ((2, 4), (6, 6), (20, 8), (70, 8))),
        cover=rng.uniform(-0.3, 0.6),
        softness=rng.uniform(0.05, 0.6),
    )


class ScatteredOnce:
    """Light of the limb for air that scatters each ray of the Sun once, relative to thick air under a high Sun.

    A line of sight that touches the Earth has the optical depth x, and air of the density exp(-s^2/2) along it, s in units
    of sqrt(R H). The light that comes from s is weakened by the air before it, and by the Sun's way through the air: the
    depth of a horizontal line times Chapman's function of the Sun's elevation there.
    """

    DEPTHS = np.geomspace(1e-3, 40, 70)
    SINES = np.linspace(-0.15, 0.6, 76)
    AHEAD = np.linspace(-1, 1, 9)

    def __init__(self, scale_height_km):
        self.curve = MEAN_KM / (2 * scale_height_km)
        s = np.linspace(-5, 5, 201)
        density = np.exp(-s * s / 2) / math.sqrt(2 * math.pi)
        before = np.cumsum(density) * (s[1] - s[0])
        turn = s * math.sqrt(scale_height_km / MEAN_KM)
        sine = self.SINES[:, None, None] + turn * self.AHEAD[:, None]
        way = self.way(sine) / math.sqrt(4 * math.pi * self.curve)
        self.light = np.stack([
            (x * density * np.exp(-x * before - x * way * density * math.sqrt(2 * math.pi))).sum(-1) * (s[1] - s[0])
            for x in self.DEPTHS])

    def way(self, sine):
        """The Sun's way through the air in units of the way from the zenith."""
        day = 1 / np.sqrt(sine * sine + 2 / (math.pi * self.curve))
        below = 2 * math.sqrt(math.pi * self.curve / 2) * np.exp(np.minimum(self.curve * sine * sine, 60)) - day
        return np.where(sine >= 0, day, below)

    def at(self, depth, sine, ahead):
        """Light for each depth (points, colours), by the sine of the Sun's elevation and its cosine along the line."""
        def place(grid, values):
            at = np.interp(values, grid, np.arange(len(grid)))
            low = np.minimum(at.astype(int), len(grid) - 2)
            return low, at - low

        axes = [place(np.log(self.DEPTHS), np.log(np.maximum(depth, 1e-12))), place(self.SINES, sine[:, None]),
                place(self.AHEAD, ahead[:, None])]
        total = 0.0
        for corner in np.ndindex(2, 2, 2):
            weight = math.prod(part if up else 1 - part for up, (_, part) in zip(corner, axes))
            total = total + weight * self.light[tuple(low + up for up, (low, _) in zip(corner, axes))]
        # Thinner air than the table's has light in proportion to its depth.
        return total * np.minimum(depth / self.DEPTHS[0], 1)


def radiance(world, rays, rotation, position_km, sun):
    """Returns the light of each pixel (red, green, blue), its tangent height in km, and the sunlight there, 0 to 1."""
    lines = rays.reshape(-1, 3) @ rotation.T
    p, q = position_km / AXES_KM, lines / AXES_KM
    a, b, c = (q * q).sum(1), q @ p, p @ p - 1
    root = b * b - a * c
    hit = (root > 0) & (b < 0)
    nearest = np.maximum(-b / a, 0.0)
    distance = np.where(hit, (-b - np.sqrt(np.maximum(root, 0.0))) / a, nearest)
    tangent_km = np.where(b < 0, (np.linalg.norm(p + q * nearest[:, None], axis=1) - 1) * MEAN_KM, 1e4)
    normal = unit((position_km + lines * distance[:, None]) / AXES_KM**2)
    elevation = normal @ sun
    sunlight = 1 / (1 + np.exp(-(elevation - TERMINATOR) / TWILIGHT))
    slant = math.sqrt(2 * math.pi * MEAN_KM / world.scale_height_km)
    light = np.zeros((len(lines), 3))
    air = ~hit & (tangent_km < 150)
    depth = VERTICAL_DEPTH * slant * np.exp(-np.clip(tangent_km[air], -5, None) / world.scale_height_km)[:, None]
    ahead = lines @ sun
    if world.shade:
        light[air] = world.air * world.shade.at(depth, elevation[air], ahead[air])
    else:
        light[air] = world.air * (1 - np.exp(-depth)) * sunlight[air, None]
    ground = np.nonzero(hit)[0]
    if len(ground):
        places = unit(position_km + lines[ground] * distance[ground, None])
        cloud = np.clip((world.clouds.at(places) - world.cover) / world.softness, 0, 1)[:, None]
        land = (world.continents.at(places) > 0.15)[:, None]
        albedo = np.where(land, [0.28, 0.24, 0.16], [0.03, 0.05, 0.09]) * (1 - cloud) + 0.85 * cloud
        lit = (np.clip(elevation[ground], 0, 1) * sunlight[ground])[:, None]
        upwards = np.clip(-(lines[ground] * normal[ground]).sum(1), 0, 1)
        path = 1 / np.maximum(upwards, 1.6 / slant)
        through = np.exp(-VERTICAL_DEPTH * path[:, None])
        if world.shade:
            lit = lit * np.exp(-VERTICAL_DEPTH * world.shade.way(elevation[ground])[:, None])
            deep = np.broadcast_to(VERTICAL_DEPTH * slant, through.shape)
            share = world.shade.at(deep, elevation[ground], ahead[ground]) / (1 - np.exp(-deep))
        else:
            share = sunlight[ground, None]
        light[ground] = albedo * lit * through + world.air * (1 - through) * share
    shape = rays.shape[:2]
    return light.reshape(*shape, 3), tangent_km.reshape(shape), sunlight.reshape(shape)


def limb_axis(position_km):
    """Returns the axis of the elliptic cone that touches the ellipsoid, raised by the limb's height, in ECEF.

    The lines of sight d that touch it have (d·Mp)² = (d·Md)(p·Mp − 1): the axis is the eigenvector of
    (Mp)(Mp)ᵀ − (p·Mp − 1) M whose eigenvalue has a sign of its own.
    """
    m = np.diag(1 / (AXES_KM + LIMB_KM) ** 2)
    mp = m @ position_km
    values, vectors = np.linalg.eigh(np.outer(mp, mp) - (position_km @ mp - 1) * m)
    axis = vectors[:, np.argmax(values)]
    return -axis if axis @ position_km > 0 else axis


def draw_attitude(rng, position_km, field_rad):
    """Returns the rotation from the camera to ECEF. Most pictures look at the limb, the others anywhere."""
    up = unit(position_km)
    dip = math.acos((MEAN_KM + LIMB_KM) / np.linalg.norm(position_km))
    down = dip + 0.3 * min(field_rad, 2.0) * rng.normal() if rng.random() < 0.88 else rng.uniform(-1.5, 1.5)
    east = unit(np.cross([0.0, 0.0, 1.0], up))
    north = np.cross(up, east)
    azimuth, roll = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi)
    level = math.cos(azimuth) * north + math.sin(azimuth) * east
    z = math.cos(down) * level - math.sin(down) * up
    x = unit(np.cross(z, up))
    y = np.cross(z, x)
    c, s = math.cos(roll), math.sin(roll)
    return np.stack([c * x + s * y, c * y - s * x, z], 1)


@dataclasses.dataclass
class Camera:
    """Optics and electronics of a flight."""

    lens: Lens
    exposure: float
    blur_px: float
    noise: float
    srgb: bool
    colour: bool
    jpeg_quality: int | None
    vignetting: float
    stray: float
    ghosts: bool
    stars: bool

    def expose(self, rng, light, rays, seen, sun_in_camera, sun_is_up):
        """Returns the picture as bytes."""
        image = light * self.exposure
        v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
        angle = np.arccos(np.clip(rays @ sun_in_camera, -1, 1))
        if sun_is_up:
            disc = 40 * np.clip((SUN_RADIUS_RAD - angle) / 0.001 + 0.5, 0, 1)
            image += (disc + 0.02 / (1 + (angle / 0.02) ** 2))[..., None]
            if self.ghosts and angle.min() < 1.2:
                image += self.ghost_images(rng, u, v, np.unravel_index(np.argmin(angle), angle.shape))
        if self.stray:
            towards = unit(rng.normal(size=2))
            slope = (u / WIDTH - 0.5) * towards[0] + (v / HEIGHT - 0.5) * towards[1]
            image += (self.stray * np.clip(0.5 + slope, 0, None))[..., None]
        radius2 = ((u - self.lens.centre_px[0]) ** 2 + (v - self.lens.centre_px[1]) ** 2) / (WIDTH / 2) ** 2
        image *= (1 - self.vignetting * np.clip(radius2 / 1.6, 0, 1))[..., None]
        if self.stars:
            image[rng.integers(0, HEIGHT, 40), rng.integers(0, WIDTH, 40)] += rng.uniform(0.05, 1, (40, 1))
        image[~seen] = 0
        image = cv2.GaussianBlur(image, (0, 0), self.blur_px)
        image += rng.normal(size=image.shape) * self.noise * np.sqrt(1 + 2 * np.clip(image, 0, 1))
        image = np.clip(image, 0, 1)
        if self.srgb:
            image = np.where(image < 0.0031308, 12.92 * image, 1.055 * np.maximum(image, 1e-9) ** (1 / 2.4) - 0.055)
        counts = np.round(image * 255).astype(np.uint8)
        return counts[..., ::-1] if self.colour else np.round(counts.mean(2)).astype(np.uint8)

    def ghost_images(self, rng, u, v, sun_row_column):
        """Discs and rings on the line through the Sun and the centre of the picture."""
        centre, total = np.array(self.lens.centre_px), np.zeros((HEIGHT, WIDTH, 3))
        for _ in range(rng.integers(1, 6)):
            at = centre + (centre - np.array(sun_row_column[::-1])) * rng.uniform(-0.9, 1.6)
            radius, light = rng.uniform(0.01, 0.35) * WIDTH, 10 ** rng.uniform(-2.2, -0.6)
            beyond = np.hypot(u - at[0], v - at[1]) - radius
            ghost = 1 / (1 + np.exp(np.clip(beyond / 1.5, -50, 50)))
            if rng.random() < 0.4:
                ghost *= np.exp(-((beyond / (0.1 * radius + 2)) ** 2))
            total += (light * ghost)[..., None] * rng.uniform(0.5, 1, 3)
        return total


def quaternion_wxyz(rotation):
    """Returns the quaternion of a rotation matrix: the eigenvector of the largest eigenvalue (Bar-Itzhack 2000)."""
    r = rotation
    k = np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]],
        [r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2]],
        [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1]],
    ])
    return np.linalg.eigh(k)[1][:, 3]


def turned(rng, rotation, sigma_deg):
    """Returns the rotation with a random error about each axis of the camera."""
    error = np.radians(sigma_deg) * rng.normal(size=3)
    return rotation @ cv2.Rodrigues(error)[0]


def draw_camera(rng, exposure):
    return Camera(
        lens=draw_lens(rng),
        exposure=math.exp(rng.uniform(*np.log(exposure))),
        blur_px=rng.uniform(0.4, 1.8),
        noise=10 ** rng.uniform(-3, -1.7),
        srgb=rng.random() < 0.5,
        colour=rng.random() < 0.7,
        jpeg_quality=int(rng.integers(60, 96)) if rng.random() < 0.67 else None,
        vignetting=rng.uniform(0, 0.5),
        stray=10 ** rng.uniform(-2.5, -1.2) if rng.random() < 0.3 else 0.0,
        ghosts=rng.random() < 0.35,
        stars=rng.random() < 0.2,
    )


def draw_position(rng, about, altitude_km):
    """Returns a place at this altitude above the ellipsoid, near a direction, in km (ECEF)."""
    n = unit(about + 0.05 * rng.normal(size=3))
    # The point of the ellipsoid with the normal n is A² n / |A n|.
    return AXES_KM**2 * n / np.linalg.norm(AXES_KM * n) + altitude_km * n


def sensor_toml(rng, lens, focal_sigma_percent=0.3, centre_sigma_px=1.0):
    """Returns a sensor.toml with default settings. Its calibration has errors of the sizes that it gives."""
    focal_px = lens.focal_px * (1 + focal_sigma_percent / 100 * rng.normal())
    centre = [c + centre_sigma_px * rng.normal() for c in lens.centre_px]
    lines = [
        "[camera]", f"width = {WIDTH}", f"height = {HEIGHT}", f'model = "{lens.model}"', f"fx_px = {focal_px:.4f}",
        f"fy_px = {focal_px:.4f}", f"cx_px = {centre[0]:.3f}", f"cy_px = {centre[1]:.3f}",
        f"focal_sigma_percent = {focal_sigma_percent}", f"centre_sigma_px = {centre_sigma_px}",
    ]
    if lens.k:
        lines.append(f"k = {[round(float(k), 9) for k in lens.k]}")
    if lens.circle_rad:
        lines.append(f"theta_max_deg = {0.985 * math.degrees(lens.circle_rad):.4f}")
    return "\n".join([*lines, "", "[body]", 'kind = "earth"', ""])


def render_flight(folder, seed, kind, pictures, shade=False):
    """Writes pictures, frames.csv and sensor.toml. Returns the truth per picture.

    frames.csv has positions, directions to the Sun, and attitudes with random errors of ATTITUDE_SIGMA_DEG per axis. With
    `shade` the air scatters light once.

    The truth is the limb axis in the camera, and the number of limb pixels that sunlight reaches.
    """
    classes = CLASSES | FAR_CLASSES
    elevations_deg, exposures = classes[kind]
    rng, errors = (np.random.default_rng([list(classes).index(kind), seed, *more]) for more in ([], [1]))
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    camera, world = draw_camera(rng, exposures), draw_world(rng)
    if shade:
        world.shade = ScatteredOnce(world.scale_height_km)
    rays, seen = camera.lens.rays()
    altitude_km = math.exp(rng.uniform(*np.log(FAR_ALTITUDES_KM if kind in FAR_CLASSES else ALTITUDES_KM)))
    about = unit(rng.normal(size=3))
    sun_elevation, sun_azimuth = math.radians(rng.uniform(*elevations_deg)), rng.uniform(0, 2 * math.pi)
    rows, truth = ["file,x_km,y_km,z_km,sun_x,sun_y,sun_z,qw,qx,qy,qz,attitude_sigma_deg"], {}
    for index in range(pictures):
        position_km = draw_position(rng, about, altitude_km)
        up = unit(position_km)
        east = unit(np.cross([0.0, 0.0, 1.0], up))
        level = math.cos(sun_azimuth) * np.cross(up, east) + math.sin(sun_azimuth) * east
        sun = math.sin(sun_elevation) * up + math.cos(sun_elevation) * level
        rotation = draw_attitude(rng, position_km, camera.lens.field_rad)
        light, tangent_km, sunlight = radiance(world, rays, rotation, position_km, sun)
        dip = math.acos(MEAN_KM / np.linalg.norm(position_km))
        sun_is_up = up @ sun > -math.sin(dip)
        image = camera.expose(rng, light, rays, seen, rotation.T @ sun, sun_is_up)
        name = f"{index:03}.{'jpg' if camera.jpeg_quality else 'png'}"
        quality = [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg_quality] if camera.jpeg_quality else []
        if not cv2.imwrite(str(folder / name), image, quality):
            raise OSError(f"{folder / name} cannot be written")
        inside = tangent_km < LIMB_KM
        beside = np.logical_or.reduce([np.roll(inside, step, axis) for axis in (0, 1) for step in (-1, 1)])
        limb = seen & ~inside & beside
        limb[[0, -1]] = limb[:, [0, -1]] = False
        truth[name] = (rotation.T @ limb_axis(position_km), int((limb & (sunlight > 0.5)).sum()))
        attitude = quaternion_wxyz(turned(errors, rotation, ATTITUDE_SIGMA_DEG))
        numbers = [*position_km, *(rotation.T @ sun), *attitude, ATTITUDE_SIGMA_DEG]
        rows.append(",".join([name, *(f"{n:.9f}" for n in numbers)]))
    (folder / "frames.csv").write_text("\n".join(rows) + "\n")
    (folder / "sensor.toml").write_text(sensor_toml(rng, camera.lens))
    (folder / "tone").write_text("srgb" if camera.srgb else "linear")
    return truth
