"""Renders pictures of chessboards with known truth, with NumPy alone.

The lens equations and their inversion are written here a second time, independently of the Rust code:

    python boards.py OUT --lens fisheye94 --views 12 --seed 1

writes view-00.png ... and truth.json (camera, poses, corners). `render_set` does the same for other programs.
"""

import argparse
import json
import math
import pathlib

import numpy as np

COLUMNS, ROWS, SQUARE_MM = 9, 6, 30.0  # inner corners

# Name: (model, horizontal field of view in degrees, coefficients).
LENSES = {
    "pinhole60": ("brown-conrady", 60.0, [-0.21, 0.08, 0.0006, -0.0004, -0.01]),
    "fisheye94": ("kannala-brandt", 94.0, [-0.055, 0.011, -0.0035, 0.0002]),
    "fisheye150": ("kannala-brandt", 150.0, [0.012, -0.018, 0.004, -0.0006]),
}


def distort(model, k, x, y, z):
    """Image point in focal lengths of directions of any length; NaN where the lens has none."""
    if model == "kannala-brandt":
        h = np.hypot(x, y)
        t = np.arctan2(h, z)
        r = t * (1 + k[0] * t**2 + k[1] * t**4 + k[2] * t**6 + k[3] * t**8)
        s = np.where(h > 1e-12, r / np.maximum(h, 1e-12), 1.0 / np.where(z == 0, 1, z))
        return x * s, y * s
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = np.where(z > 0, x / z, np.nan), np.where(z > 0, y / z, np.nan)
    q = a * a + b * b
    f = 1 + k[0] * q + k[1] * q**2 + k[4] * q**3
    return a * f + 2 * k[2] * a * b + k[3] * (q + 2 * a * a), b * f + k[2] * (q + 2 * b * b) + 2 * k[3] * a * b


def rays(camera, u, v):
    """Unit rays of image points, by Newton's method on the equations above."""
    x, y = (u - camera["cx"]) / camera["fx"], (v - camera["cy"]) / camera["fy"]
    k = camera["k"]
    if camera["model"] == "kannala-brandt":
        rho = np.hypot(x, y)
        t = rho.copy()
        for _ in range(9):
            value = t * (1 + k[0] * t**2 + k[1] * t**4 + k[2] * t**6 + k[3] * t**8) - rho
            slope = 1 + 3 * k[0] * t**2 + 5 * k[1] * t**4 + 7 * k[2] * t**6 + 9 * k[3] * t**8
            t = t - value / slope
        s = np.where(rho > 0, np.sin(t) / np.maximum(rho, 1e-12), 1.0)
        return np.stack([x * s, y * s, np.cos(t)], axis=-1)
    a, b = x.copy(), y.copy()
    for _ in range(25):
        da, db = distort("brown-conrady", k, a, b, np.ones_like(a))
        a, b = a + (x - da), b + (y - db)
    n = np.sqrt(a * a + b * b + 1)
    return np.stack([a / n, b / n, 1 / n], axis=-1)


def make_camera(name, width, height, rng):
    model, fov_deg, k = LENSES[name]
    half = math.radians(fov_deg) / 2
    x, _ = distort(model, k, np.array([math.sin(half)]), np.array([0.0]), np.array([math.cos(half)]))
    f = (width / 2) / float(x[0])
    jitter = rng.uniform(-1, 1, 3)
    return {
        "model": model, "width": width, "height": height, "fx": f, "fy": f * (1 + 0.003 * jitter[0]),
        "cx": (width - 1) / 2 + 0.01 * width * jitter[1], "cy": (height - 1) / 2 + 0.01 * width * jitter[2],
        "k": list(k),
    }


def rotation(axis_angle):
    angle = np.linalg.norm(axis_angle)
    if angle == 0:
        return np.eye(3)
    x, y, z = axis_angle / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def corners_px(camera, turn, shift):
    """Image points of all corners, row by row."""
    column, row = np.meshgrid(np.arange(COLUMNS), np.arange(ROWS))
    places = np.stack([column.ravel() * SQUARE_MM, row.ravel() * SQUARE_MM, np.zeros(COLUMNS * ROWS)])
    x, y, z = turn @ places + shift[:, None]
    a, b = distort(camera["model"], camera["k"], x, y, z)
    return np.stack([a * camera["fx"] + camera["cx"], b * camera["fy"] + camera["cy"]], axis=-1)


def pose(camera, rng, partial):
    """A board somewhere in the picture, turned and tilted; all corners in the picture unless `partial`."""
    width, height = camera["width"], camera["height"]
    for _ in range(2000):
        u, v = rng.uniform(0.1, 0.9) * width, rng.uniform(0.1, 0.9) * height
        ray = rays(camera, np.array([u]), np.array([v]))[0]
        if ray[2] < 0.05:
            continue
        z = np.array([0.0, 0.0, 1.0])
        facing = rotation(np.cross(z, ray) / max(np.linalg.norm(np.cross(z, ray)), 1e-12) * math.acos(ray[2]))
        tilt = math.radians(rng.uniform(0, 60)) * rotation(np.array([0, 0, rng.uniform(0, 2 * math.pi)])) @ [1, 0, 0]
        turn = facing @ rotation(tilt) @ rotation(np.array([0, 0, rng.uniform(-0.5, 0.5)]))
        distance = COLUMNS * SQUARE_MM * camera["fx"] / (width * rng.uniform(0.3, 0.75))
        middle = np.array([(COLUMNS - 1) / 2 * SQUARE_MM, (ROWS - 1) / 2 * SQUARE_MM, 0.0])
        shift = ray * distance - turn @ middle
        at = corners_px(camera, turn, shift)
        border = 6.0
        inside = ((at > border) & (at < [width - 1 - border, height - 1 - border])).all(axis=1)
        near = np.linalg.norm(np.diff(at.reshape(ROWS, COLUMNS, 2), axis=1), axis=-1).min()
        near = min(near, np.linalg.norm(np.diff(at.reshape(ROWS, COLUMNS, 2), axis=0), axis=-1).min())
        if near < 10 or not np.isfinite(at).all():
            continue
        if inside.all() if not partial else (0.6 < inside.mean() < 1.0):
            return turn, shift, at, inside
    raise RuntimeError("no pose found")


def blur(picture, sigma):
    if sigma <= 0:
        return picture
    reach = int(math.ceil(4 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(picture, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        size = picture.shape[axis]
        slices = [np.take(padded, range(i, i + size), axis=axis) * w for i, w in enumerate(kernel)]
        picture = np.sum(slices, axis=0)
    return picture


def sample_rays(camera, over):
    """Rays of `over` x `over` samples a pixel; the same for all views of a camera."""
    width, height = camera["width"], camera["height"]
    u = (np.arange(width * over) + 0.5) / over - 0.5
    v = (np.arange(height * over) + 0.5) / over - 0.5
    return rays(camera, *np.meshgrid(u, v)).astype(np.float32)


def square_wave(a, width):
    """The mean of a wave that is +1 in even squares and -1 in odd ones, over `width` squares about `a`."""
    def integral(x):
        x = np.mod(x, 2.0)
        return np.where(x < 1, x, 2 - x)

    width = np.clip(width, 1e-4, 1.0)
    return (integral(a + width / 2) - integral(a - width / 2)) / width


def make_cover(at, rng):
    """A disc that hides some of the corners in front of the board: (u, v, radius) in pixels."""
    middle = at[rng.integers(len(at))]
    size = np.linalg.norm(at.max(axis=0) - at.min(axis=0))
    return (*(middle + rng.normal(0, 0.1 * size, 2)), size * rng.uniform(0.08, 0.2))


def hidden_by(cover, at):
    """Which corners the disc hides, with a margin of 3 pixels: an edge so near disturbs a corner too."""
    u, v, radius = cover
    return np.hypot(at[:, 0] - u, at[:, 1] - v) < radius + 3.0


def render(camera, samples, over, turn, shift, rng, psf, noise, cover=None):
    """An 8-bit picture of the board on a grey, uneven wall."""
    width, height = camera["width"], camera["height"]
    normal = turn[:, 2]
    depth = float(normal @ shift)
    along = samples @ normal.astype(np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(along > 1e-6, depth / along, np.nan).astype(np.float32)
    place = (samples * distance[..., None] - shift.astype(np.float32)) @ turn.astype(np.float32)
    a, b = place[..., 0] / SQUARE_MM + 1, place[..., 1] / SQUARE_MM + 1  # squares from the board's first square
    dark, bright, wall = rng.uniform(0.05, 0.15), rng.uniform(0.7, 0.95), rng.uniform(0.3, 0.6)
    with np.errstate(invalid="ignore"):
        # A sample is the mean over its own width, so that edges lie where they should to far below a sample.
        width_a, width_b = (np.hypot(*np.gradient(x)) for x in (a, b))
        white = 0.5 - 0.5 * square_wave(a, width_a) * square_wave(b, width_b)
        on_board = (a >= 0) & (b >= 0) & (a < COLUMNS + 1) & (b < ROWS + 1)
        paper = (a >= -0.7) & (b >= -0.7) & (a < COLUMNS + 1.7) & (b < ROWS + 1.7)
    light = np.where(on_board, dark + (bright - dark) * white, np.where(paper, bright, wall)).astype(np.float32)
    if cover is not None:
        u, v = ((np.arange(n * over) + 0.5) / over - 0.5 for n in (width, height))
        light[np.hypot(u[None, :] - cover[0], v[:, None] - cover[1]) < cover[2]] = rng.uniform(0.2, 0.9)
    light = light.reshape(height, over, width, over).mean(axis=(1, 3)).astype(np.float64)
    y, x = np.mgrid[0:height, 0:width]
    slope = rng.uniform(-0.3, 0.3, 2)
    light *= 1 + slope[0] * (x / width - 0.5) + slope[1] * (y / height - 0.5)
    light = blur(light, psf) + rng.normal(0, noise, light.shape)
    return np.clip(np.round(light * 255), 0, 255).astype(np.uint8)


def render_set(name, views, seed, width=800, height=600, over=2, psf=0.8, noise=0.01, partial=0.0, covered=0.0):
    """Returns (camera, list of (picture, corners (54, 2), visible (54,), rotation, translation)).

    `partial` is the share of boards that the border of the picture cuts, `covered` the share of boards that something
    in front of them hides in part.
    """
    rng = np.random.default_rng(seed)
    camera = make_camera(name, width, height, rng)
    samples = sample_rays(camera, over)
    out = []
    for n in range(views):
        turn, shift, at, visible = pose(camera, rng, n < partial * views)
        cover = make_cover(at, rng) if n >= (1 - covered) * views else None
        picture = render(camera, samples, over, turn, shift, rng, psf * rng.uniform(0.7, 1.5), noise, cover)
        if cover is not None:
            visible = visible & ~hidden_by(cover, at)
        out.append((picture, at, visible, turn, shift))
    return camera, out


def main():
    from PIL import Image

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--lens", choices=LENSES, default="fisheye94")
    parser.add_argument("--views", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", default="800x600")
    parser.add_argument("--psf", type=float, default=0.8, help="blur in pixels, varied by the factor 0.7 to 1.5")
    parser.add_argument("--noise", type=float, default=0.01, help="as a part of full scale")
    parser.add_argument("--partial", type=float, default=0.0, help="share of boards that the picture's border cuts")
    parser.add_argument("--covered", type=float, default=0.0, help="share of boards that something hides in part")
    args = parser.parse_args()
    width, height = map(int, args.size.split("x"))
    camera, views = render_set(args.lens, args.views, args.seed, width, height, psf=args.psf, noise=args.noise,
                               partial=args.partial, covered=args.covered)
    args.out.mkdir(parents=True, exist_ok=True)
    truth = {"camera": camera, "board": [COLUMNS, ROWS, SQUARE_MM], "views": []}
    for n, (picture, at, visible, turn, shift) in enumerate(views):
        file = f"view-{n:02}.png"
        Image.fromarray(picture).save(args.out / file, optimize=True)
        truth["views"].append({"file": file, "corners_px": at.round(3).tolist(), "visible": visible.tolist(),
                               "rotation": turn.tolist(), "translation_mm": shift.tolist()})
    (args.out / "truth.json").write_text(json.dumps(truth) + "\n")


if __name__ == "__main__":
    main()
