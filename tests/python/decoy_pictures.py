"""Renders pictures with an edge that is no limb. This program shares no code with hzn and its simulator.

Each kind of `KINDS` is a function that paints light on a picture of 640x480. The ground of a picture that looks down is
a random pattern of several sizes. A flight has three pictures of one camera at one altitude; its lens is drawn from
27 to 120 degrees, its altitude from 75 to 900 km (airglow: 15 to 65 degrees, 300 to 500 km). `frames.csv` has a
position, and an attitude with errors of 5 degrees per axis. limb_pictures.py draws position and attitude.
"""

import dataclasses
import math
import pathlib

import cv2
import numpy as np

import limb_pictures as limb

WIDTH, HEIGHT = 640, 480
PICTURES = 3
# The pictures with a limb that belong to this campaign have the same size.
limb.WIDTH, limb.HEIGHT = WIDTH, HEIGHT
V, U = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)


def pattern(rng, slope, coarsest=2):
    """Returns a random pattern with mean 0 and sigma 1. Each finer octave is weaker by 2^-slope."""
    total, cells, weight = np.zeros((HEIGHT, WIDTH), np.float32), coarsest, 1.0
    while cells < WIDTH:
        grid = rng.normal(size=(max(2, cells * HEIGHT // WIDTH) + 3, cells + 3)).astype(np.float32)
        shift = rng.uniform(0, 1, 2)
        across = cv2.resize(grid, (WIDTH * 2, HEIGHT * 2), interpolation=cv2.INTER_CUBIC)
        y, x = (shift * (HEIGHT, WIDTH)).astype(int)
        total += weight * across[y : y + HEIGHT, x : x + WIDTH]
        cells, weight = cells * 2, weight * 2**-slope
    return (total - total.mean()) / max(total.std(), 1e-6)


def step(distance_px, softness_px):
    """Returns a step from 1 (inside, negative) to 0: a Gaussian error function with this sigma."""
    x = np.clip(distance_px / (softness_px * math.sqrt(2)), -4, 4)
    # Abramowitz and Stegun 7.1.26, error below 2e-7.
    t = 1 / (1 + 0.3275911 * np.abs(x))
    series = 0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))
    tail = t * series * np.exp(-x * x)
    return np.where(x > 0, tail / 2, 1 - tail / 2)


def ground(rng, dark=(0.02, 0.12), bright=(0.1, 0.35)):
    """Returns the light of ground without clouds."""
    low, high = rng.uniform(*dark), rng.uniform(*bright)
    return low + (high - low) * np.clip(0.5 + 0.3 * pattern(rng, rng.uniform(0.5, 1.3)), 0, 1)


def somewhere(rng, margin=0.3):
    return rng.uniform(-margin, 1 + margin, 2) * (WIDTH, HEIGHT)


def arc(rng, least, most):
    """Returns the signed distance of each pixel from a large circle that crosses the picture, negative inside."""
    radius = math.exp(rng.uniform(math.log(least), math.log(most))) * WIDTH
    through, angle = rng.uniform(0.15, 0.85, 2) * (WIDTH, HEIGHT), rng.uniform(0, 2 * math.pi)
    return np.hypot(U - through[0] - radius * math.cos(angle), V - through[1] - radius * math.sin(angle)) - radius


def ice(rng, _):
    """The edge of ice on water: bright, with a smooth border and few details."""
    border = pattern(rng, rng.uniform(1.3, 2.3), int(rng.integers(1, 3)))
    beyond = (border + rng.uniform(-0.7, 0.7)) * rng.uniform(30, 200)
    white = rng.uniform(0.4, 0.9) * (1 + rng.uniform(0, 0.12) * pattern(rng, 0.8))
    return rng.uniform(0.02, 0.08) + white * step(beyond, rng.uniform(0.4, 3))


def coast(rng, _):
    """A coast, with a rough border and texture on both sides."""
    beyond = (pattern(rng, rng.uniform(0.9, 1.7)) + rng.uniform(-0.7, 0.7)) * 100
    land = ground(rng, (0.08, 0.2), (0.2, 0.5))
    clouds = np.clip(pattern(rng, 0.8) - rng.uniform(1, 3), 0, 1) * rng.uniform(0, 0.8)
    return rng.uniform(0.02, 0.08) + land * step(beyond, 1) + clouds


def contrails(rng, _):
    """Condensation trails: narrow bright arcs over ground."""
    light = ground(rng)
    for _ in range(rng.integers(1, 6)):
        width = rng.uniform(1, 15)
        ragged = 1 + rng.uniform(0, 0.3) * pattern(rng, 0.5)
        light += rng.uniform(0.2, 0.8) * np.exp(-((arc(rng, 0.5, 6) / width) ** 2)) * ragged
    return light


def bands(rng, _):
    """Curved bands, wide and with edges of any softness, over the dark or over ground."""
    light = ground(rng) if rng.random() < 0.5 else np.full((HEIGHT, WIDTH), rng.uniform(0.0, 0.05))
    for _ in range(rng.integers(1, 4)):
        distance, width = arc(rng, 0.4, 4), rng.uniform(20, 250)
        inner, outer = (step(sign * distance - width / 2, 10 ** rng.uniform(-0.4, 1)) for sign in (-1, 1))
        light += rng.uniform(0.15, 0.8) * inner * outer
    return light


def rounded(rng, least, most):
    """Returns the signed distance from a rectangle with rounded corners, negative inside."""
    half, angle = rng.uniform(0.2, 0.8, 2) * (WIDTH, HEIGHT), rng.uniform(-0.5, 0.5) + rng.choice([0, math.pi / 2])
    corner = min(rng.uniform(least, most), half.min())
    middle = rng.uniform(-0.2, 1.2, 2) * (WIDTH, HEIGHT)
    x, y = U - middle[0], V - middle[1]
    x, y = np.abs(math.cos(angle) * x + math.sin(angle) * y), np.abs(math.cos(angle) * y - math.sin(angle) * x)
    dx, dy = x - half[0] + corner, y - half[1] + corner
    return np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)) + np.minimum(np.maximum(dx, dy), 0) - corner


def window(rng, _):
    """A window with rounded corners: dark in a lit wall, or lit in a dark wall."""
    inside = step(rounded(rng, 20, 400), 10 ** rng.uniform(-0.4, 0.8))
    wall = rng.uniform(0.2, 0.9) * (1 + rng.uniform(0, 0.4) * pattern(rng, 2.5, 1))
    return rng.uniform(0, 0.03) + np.clip(wall, 0, None) * (1 - inside if rng.random() < 0.7 else inside)


def circle(rng, _):
    """The image circle of the lens, with stray light inside. The sensor does not know the circle."""
    centre, radius = (0.5 + 0.06 * rng.normal(size=2)) * (WIDTH, HEIGHT), rng.uniform(0.33, 0.7) * WIDTH
    stray = rng.uniform(0.1, 0.7) * (1 + rng.uniform(0, 0.5) * pattern(rng, 2.5, 1))
    return np.clip(stray, 0.02, None) * step(np.hypot(U - centre[0], V - centre[1]) - radius, rng.uniform(0.5, 3))


def ghost(rng, scene):
    """A ghost disc that matches the limb: the circle in the picture that fits the expected limb best."""
    angle = limb_angle(scene.rays, scene.rotation, scene.position_km)
    rows, columns = np.nonzero(np.abs(angle) < 1 / scene.lens.focal_px)
    # Kasa's circle, about the centre of the picture.
    x, y = (columns - WIDTH / 2) / WIDTH, (rows - HEIGHT / 2) / WIDTH
    a, b, c = np.linalg.lstsq(np.stack([2 * x, 2 * y, np.ones_like(x)], 1), x * x + y * y, rcond=None)[0]
    radius = math.sqrt(max(c + a * a + b * b, 1e-9))
    beyond = np.hypot((U - WIDTH / 2) / WIDTH - a, (V - HEIGHT / 2) / WIDTH - b) - radius
    # The body is inside, or outside of a circle that is curved the other way.
    inside = np.sign(np.sum(beyond * angle)) or 1.0
    scene.softness_px = math.exp(rng.uniform(math.log(0.5), math.log(5)))
    return rng.uniform(0.0, 0.03) + rng.uniform(0.2, 0.9) * step(inside * beyond * WIDTH, scene.softness_px)


def other_disc(rng, _):
    """A ghost disc of any size."""
    centre, radius = somewhere(rng), rng.uniform(0.1, 1.5) * WIDTH
    return rng.uniform(0, 0.03) + rng.uniform(0.2, 0.9) * step(np.hypot(U - centre[0], V - centre[1]) - radius,
                                                             10 ** rng.uniform(-0.3, 0.7))


def chapman(rng, thickness=1.0):
    """Draws one layer of airglow: its part of the light, peak and scale height, km. `thickness` multiplies the latter."""
    return [(1.0, rng.uniform(85, 105), rng.uniform(3, 12) * thickness)]


# Draws the layers of airglow of a picture.
LAYERS = chapman


def airglow(rng, scene):
    """The night side: layers of airglow (Chapman) above ground that is dark, lit by the Moon, or by cities."""
    lines = scene.rays.reshape(-1, 3) @ scene.rotation.T
    p, q = scene.position_km / limb.AXES_KM, lines / limb.AXES_KM
    a, b, c = (q * q).sum(1), q @ p, p @ p - 1
    hit = (b * b > a * c) & (b < 0)
    nearest = np.maximum(-b / a, 0)
    tangent = np.where(b < 0, (np.linalg.norm(p + q * nearest[:, None], axis=1) - 1) * limb.MEAN_KM, 1e4)
    layers = LAYERS(rng)
    heights = np.linspace(-600, 160, 761)
    # The integral along a line of sight with this tangent height, in steps of 0.5 km of height.
    level = np.arange(min(p - 4 * h for _, p, h in layers), max(p + 8 * h for _, p, h in layers), 0.5)
    emission = np.zeros_like(level)
    for part, peak, thick in layers:
        z = (level - peak) / thick
        emission += part * np.exp(1 - z - np.exp(-z))
    brightness = np.zeros_like(heights)
    for i, h in enumerate(heights):
        above = level > h
        path = np.sqrt(2 * limb.MEAN_KM * np.maximum(level[above] - h, 0.1))
        brightness[i] = (emission[above] * limb.MEAN_KM / path).sum()
    glow = np.interp(tangent, heights, brightness / brightness.max())
    glow = np.where(hit, glow * 0.5, glow) * rng.uniform(0.15, 0.7)
    kind = rng.integers(3)
    surface = [0.01, rng.uniform(0.05, 0.3), 0.02][kind] * np.clip(1 + 0.4 * pattern(rng, 1.0), 0.1, None)
    if kind == 2:
        surface += rng.uniform(0.2, 1) * np.clip(pattern(rng, 0.4) - 2.2, 0, 1)
    moon = kind == 1
    lower = np.where(hit, 1.0, np.exp(-np.clip(tangent, 0, None) / 7.5) if moon else 0.0).reshape(HEIGHT, WIDTH)
    return glow.reshape(HEIGHT, WIDTH) + surface * lower


def dish(rng, _):
    """The rim of an antenna or a tank: an ellipse, lit from one side, before the sky."""
    middle, angle = somewhere(rng, 0.6), rng.uniform(0, math.pi)
    large = rng.uniform(0.3, 1.6) * WIDTH
    small = large * rng.uniform(0.3, 1)
    x, y = U - middle[0], V - middle[1]
    x, y = (math.cos(angle) * x + math.sin(angle) * y) / large, (math.cos(angle) * y - math.sin(angle) * x) / small
    beyond = (np.hypot(x, y) - 1) * small
    towards = rng.uniform(0, 2 * math.pi)
    shade = np.clip(0.6 + rng.uniform(0, 0.6) * (x * math.cos(towards) + y * math.sin(towards)), 0.05, None)
    return rng.uniform(0, 0.02) + rng.uniform(0.3, 1) * shade * step(beyond, rng.uniform(0.4, 2))


def terminator(rng, _):
    """The terminator on the ground and on clouds, seen from above: the light fades along a smooth curve."""
    clouds = np.clip(pattern(rng, rng.uniform(0.5, 1)) + rng.uniform(-1, 1), 0, 1)
    fading = step(arc(rng, 1.5, 8), math.exp(rng.uniform(math.log(8), math.log(120))))
    return 0.005 + fading * (ground(rng) + rng.uniform(0.2, 0.7) * clouds)


def aurora(rng, _):
    """Curtains of aurora: sharp below, fading above, with rays."""
    light = np.full((HEIGHT, WIDTH), rng.uniform(0.0, 0.04))
    for _ in range(rng.integers(1, 4)):
        distance = arc(rng, 0.3, 3)
        rays = np.clip(1 + rng.uniform(0, 0.6) * pattern(rng, 0.6), 0.1, None)
        fade = np.exp(-np.clip(-distance, 0, None) / rng.uniform(15, 200))
        light += rng.uniform(0.2, 0.9) * rays * fade * step(distance, 10 ** rng.uniform(0, 0.9))
    return light


def iris(rng, _):
    """Images of the iris: polygons with curved sides."""
    light = np.full((HEIGHT, WIDTH), rng.uniform(0.0, 0.03))
    for _ in range(rng.integers(1, 5)):
        middle, radius, sides = somewhere(rng), rng.uniform(0.1, 1.2) * WIDTH, int(rng.integers(5, 9))
        turn, bulge = rng.uniform(0, 2 * math.pi), rng.uniform(0, 0.15)
        angle = (np.arctan2(V - middle[1], U - middle[0]) + turn) % (2 * math.pi / sides) - math.pi / sides
        beyond = np.hypot(U - middle[0], V - middle[1]) * np.cos(angle * (1 - bulge * 4)) - radius
        light += 10 ** rng.uniform(-1, -0.2) * step(beyond, rng.uniform(0.5, 4))
    return light


def frost(rng, _):
    """Frost or water on a window, lit from behind: a smooth border, and light that fades inwards."""
    beyond = (pattern(rng, rng.uniform(1.6, 2.6), 1) + rng.uniform(-1, 1)) * rng.uniform(40, 200)
    fade = np.exp(-np.clip(-beyond, 0, None) / rng.uniform(30, 300))
    return rng.uniform(0, 0.05) + rng.uniform(0.3, 0.9) * fade * step(beyond, rng.uniform(0.5, 5))


def deck(rng, _):
    """The border of a deck of clouds over dark water."""
    beyond = (pattern(rng, rng.uniform(1.0, 1.6), 1) + rng.uniform(-1, 1)) * 120
    cells = 1 + rng.uniform(0.05, 0.3) * pattern(rng, 0.3)
    return rng.uniform(0.02, 0.06) + rng.uniform(0.4, 0.8) * cells * step(beyond, rng.uniform(0.7, 8))


def shadow(rng, _):
    """The round shadow of a part of the vehicle on a lit panel."""
    panel = rng.uniform(0.3, 0.9) * (1 + rng.uniform(0, 0.2) * pattern(rng, 2, 1))
    return np.clip(panel, 0, None) * (1 - 0.97 * step(arc(rng, 0.3, 3), 10 ** rng.uniform(-0.2, 1.2)))


KINDS = {kind.__name__.replace("_", " "): kind for kind in (
    ice, coast, contrails, bands, window, circle, ghost, airglow,
    other_disc, dish, terminator, aurora, iris, frost, deck, shadow)}


@dataclasses.dataclass
class Scene:
    """What a picture is painted from."""

    lens: limb.Lens
    rays: np.ndarray
    rotation: np.ndarray
    position_km: np.ndarray
    # Softness of the edge of a ghost, pixels.
    softness_px: float = 0.0


def draw_lens(rng, fields_deg):
    """Returns a lens whose field of view is in this range."""
    field = math.radians(rng.uniform(*fields_deg))
    centre = ((WIDTH - 1) / 2 + 0.01 * WIDTH * rng.normal(), (HEIGHT - 1) / 2 + 0.01 * WIDTH * rng.normal())
    model = str(rng.choice(["pinhole", "equidistant", "kannala-brandt"]))
    if model == "pinhole":
        return limb.Lens(model, WIDTH / 2 / math.tan(field / 2), centre, [], field, None)
    k = [rng.uniform(-0.04, 0.02), rng.uniform(-0.002, 0.002), 0.0, 0.0] if model == "kannala-brandt" else []
    return limb.Lens(model, WIDTH / field, centre, k, field, None)


def towards_limb(rng, position_km, lens, rays, in_view):
    """Returns an attitude. If the limb must be in view, at least a quarter of the picture's width lies along it."""
    while True:
        rotation = limb.draw_attitude(rng, position_km, lens.field_rad)
        angle = limb_angle(rays, rotation, position_km)
        if not in_view or (np.abs(angle) < 1 / lens.focal_px).sum() > WIDTH // 2:
            return rotation


def limb_angle(rays, rotation, position_km):
    """Returns how far each pixel is above the limb of a spherical Earth, in radians."""
    axis = limb.unit(rotation.T @ -position_km)
    half_angle = math.asin((limb.MEAN_KM + limb.LIMB_KM) / np.linalg.norm(position_km))
    return np.arccos(np.clip(rays @ axis, -1, 1)) - half_angle


def develop(rng, light, blur_px, noise, srgb):
    """Returns the picture of this light as bytes: blurred, with noise, clipped at full scale."""
    image = cv2.GaussianBlur(light.astype(np.float32), (0, 0), blur_px)
    image += rng.standard_normal(image.shape, np.float32) * noise * np.sqrt(1 + 2 * np.clip(image, 0, 1))
    image = np.clip(image, 0, 1)
    if srgb:
        image = np.where(image < 0.0031308, 12.92 * image, 1.055 * np.maximum(image, 1e-9) ** (1 / 2.4) - 0.055)
    return np.round(image * 255).astype(np.uint8)


def render_flight(folder, seed, kind, pictures=PICTURES):
    """Writes pictures, frames.csv and sensor.toml. Returns per picture: the limb's axis in the camera, the softness of
    the edge in pixels (0: none of its own) and the scale height of the air at the limb, in pixels."""
    night = kind == "airglow"
    rng, errors = (np.random.default_rng([101 + list(KINDS).index(kind), seed, *more]) for more in ([], [1]))
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    lens = draw_lens(rng, (15, 65) if night else (27, 120))
    altitude_km = math.exp(rng.uniform(*np.log((300, 500) if night else (75, 900))))
    about, exposure = limb.unit(rng.normal(size=3)), math.exp(rng.uniform(-0.3, 0.4))
    blur_px, noise, srgb = rng.uniform(0.4, 1.8), 10 ** rng.uniform(-3, -1.7), rng.random() < 0.5
    jpeg = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 96))] if rng.random() < 0.5 else []
    rays, _ = lens.rays()
    rows, truth = ["file,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg"], {}
    for index in range(pictures):
        position_km = limb.draw_position(rng, about, altitude_km)
        rotation = towards_limb(rng, position_km, lens, rays, kind in ("ghost", "airglow"))
        scene = Scene(lens, rays, rotation, position_km)
        light = KINDS[kind](rng, scene)
        name = f"{index:03}.{'jpg' if jpeg else 'pgm'}"
        if not cv2.imwrite(str(folder / name), develop(rng, light * exposure, blur_px, noise, srgb), jpeg):
            raise OSError(f"{folder / name} cannot be written")
        distance_km = math.sqrt(np.linalg.norm(position_km) ** 2 - limb.MEAN_KM**2)
        truth[name] = (rotation.T @ limb.limb_axis(position_km), scene.softness_px, 7.5 * lens.focal_px / distance_km)
        # An attitude says where the limb is. If it is not in view, nothing contradicts the edge but the attitude.
        attitude = limb.quaternion_wxyz(limb.turned(errors, rotation, limb.ATTITUDE_SIGMA_DEG))
        numbers = [*position_km, *attitude, limb.ATTITUDE_SIGMA_DEG]
        rows.append(",".join([name, *(f"{n:.9f}" for n in numbers)]))
    (folder / "frames.csv").write_text("\n".join(rows) + "\n")
    (folder / "sensor.toml").write_text(limb.sensor_toml(rng, lens))
    (folder / "tone").write_text("srgb" if srgb else "linear")
    return truth
