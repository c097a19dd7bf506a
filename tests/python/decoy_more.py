"""More kinds of edges that are no limb, for decoy_pictures.py. They have another look than the first sixteen: light
from one side, relief, spirals, branches. `KINDS` of decoy_pictures.py has them, too."""

import math

import cv2
import numpy as np

import decoy_pictures as decoy
from decoy_pictures import HEIGHT, WIDTH, U, V, arc, ground, pattern, rounded, somewhere, step


def glint(rng, _):
    """The Sun's image on water, ragged by waves, often overexposed."""
    middle, turn = somewhere(rng, 0.2), rng.uniform(0, math.pi)
    long = math.exp(rng.uniform(math.log(0.1), math.log(1.2))) * WIDTH
    wide = long * rng.uniform(0.25, 1)
    x, y = U - middle[0], V - middle[1]
    x, y = (math.cos(turn) * x + math.sin(turn) * y) / long, (math.cos(turn) * y - math.sin(turn) * x) / wide
    waves = np.exp(rng.uniform(0, 0.5) * pattern(rng, rng.uniform(0.1, 0.8), 8))
    peak, tail = 10 ** rng.uniform(-0.3, 0.8), rng.uniform(1, 3)
    return rng.uniform(0.01, 0.08) + peak * waves * np.exp(-((x * x + y * y) ** (tail / 2)))


def cyclone(rng, _):
    """Spiral bands of cloud about an eye."""
    eye = somewhere(rng, 0.4)
    radius, angle = np.hypot(U - eye[0], V - eye[1]) / WIDTH + 1e-3, np.arctan2(V - eye[1], U - eye[0])
    arms, pitch = int(rng.integers(1, 4)), rng.uniform(0.15, 0.6)
    wave = np.sin(arms * (angle + np.log(radius) / pitch) + rng.uniform(0, 2 * math.pi))
    border = wave + rng.uniform(-0.4, 0.6) + rng.uniform(0.05, 0.5) * pattern(rng, rng.uniform(0.4, 1.2), 4)
    return rng.uniform(0.02, 0.1) + rng.uniform(0.4, 0.9) * np.clip(border / rng.uniform(0.05, 1.0), 0, 1)


def tank(rng, _):
    """A sphere or a cylinder of the vehicle, lit from one side and shaded, before the sky or a wall."""
    middle, radius, turn = somewhere(rng, 0.8), rng.uniform(0.15, 1.5) * WIDTH, rng.uniform(0, math.pi)
    x, y = (U - middle[0]) / radius, (V - middle[1]) / radius
    x, y = math.cos(turn) * x + math.sin(turn) * y, math.cos(turn) * y - math.sin(turn) * x
    # A cylinder is a sphere whose second coordinate does not count.
    if rng.random() < 0.4:
        y = y * rng.uniform(0, 0.15)
    beyond = np.hypot(x, y) - 1
    z = np.sqrt(np.clip(1 - x * x - y * y, 0, 1))
    sun = decoy.limb.unit(rng.normal(size=3) + (0, 0, 0.5))
    shade = np.clip(x * sun[0] + y * sun[1] + z * sun[2], 0, 1) + rng.uniform(0, 0.2)
    dark = rng.uniform(0, 0.03) * (1 + rng.uniform(0, 3) * (pattern(rng, 2, 1) > 1))
    return dark + rng.uniform(0.3, 1.2) * shade * step(beyond * radius, rng.uniform(0.4, 2))


def crater(rng, _):
    """Relief with craters under a low light: lit slopes next to shadows."""
    relief = rng.uniform(0.5, 3) * pattern(rng, rng.uniform(1.2, 2))
    for _ in range(rng.integers(1, 6)):
        middle, radius = somewhere(rng), math.exp(rng.uniform(math.log(0.05), math.log(1.0))) * WIDTH
        x = np.hypot(U - middle[0], V - middle[1]) / radius
        rim = np.where(x < 1, 1.2 * x * x - 1, 0.2 * np.exp(-3 * (x - 1)))
        relief += rng.uniform(0.2, 0.6) * radius * rim
    dy, dx = np.gradient(relief)
    towards, low = rng.uniform(0, 2 * math.pi), rng.uniform(0.05, 0.5)
    shade = low + (1 - low) * (dx * math.cos(towards) + dy * math.sin(towards))
    return np.clip(rng.uniform(0.3, 0.9) * shade, 0.005, None)


def foil(rng, _):
    """Crumpled foil with a border before the sky: facets of different brightness between folds."""
    count = int(rng.integers(6, 60))
    at = rng.uniform(-0.1, 1.1, (count, 2)) * (WIDTH, HEIGHT)
    bent = 20 * pattern(rng, 1.5)
    distance = np.stack([np.hypot(U + bent - x, V + bent - y) for x, y in at])
    facets = (rng.uniform(0.05, 1, count) ** 2)[distance.argmin(0)] * (1 + 0.15 * pattern(rng, 2, 1))
    border = rounded(rng, 20, 400) + rng.uniform(0, 15) * pattern(rng, 1.5)
    return rng.uniform(0, 0.02) + np.clip(facets, 0.03, None) * step(border, rng.uniform(0.4, 2))


def plume(rng, _):
    """Smoke or dust that fans out from a place on the ground: sharp at one side, fading at the other."""
    foot, turn, spread = somewhere(rng), rng.uniform(0, 2 * math.pi), rng.uniform(0.1, 0.6)
    x, y = U - foot[0], V - foot[1]
    along, across = math.cos(turn) * x + math.sin(turn) * y, math.cos(turn) * y - math.sin(turn) * x
    across = across - rng.uniform(-1, 1) * along * np.abs(along) / WIDTH + 10 * pattern(rng, 1.2)
    half = 10 + spread * np.clip(along, 0, None)
    side = across / half
    density = step((np.abs(side) - 1) * half, 10 ** rng.uniform(0, 1.2))
    density *= np.exp(-np.clip(side + 1, 0, 3) * rng.uniform(0, 2))
    smoke = density * np.clip(1 + 0.4 * pattern(rng, 0.7), 0, None) * (along > 0)
    light = ground(rng) if rng.random() < 0.5 else rng.uniform(0.02, 0.06)
    return light + rng.uniform(0.3, 0.8) * cv2.GaussianBlur(smoke.astype(np.float32), (0, 0), 1.5)


def river(rng, _):
    """Dark water that winds through bright sand, with arms and islands."""
    x = rng.uniform(0.7, 1.4) * pattern(rng, rng.uniform(1.3, 2.2), int(rng.integers(1, 4)))
    width = rng.uniform(0.05, 0.4) * (1 + 0.2 * pattern(rng, 1))
    # A band about a contour line of a random pattern winds like a river.
    dy, dx = np.gradient(x)
    beyond = (np.abs(x + rng.uniform(-0.5, 0.5)) - width) / np.maximum(np.hypot(dx, dy), 3e-3)
    sand = rng.uniform(0.3, 0.7) * (1 + rng.uniform(0, 0.15) * pattern(rng, 0.8))
    return rng.uniform(0.02, 0.08) + sand * (1 - step(np.clip(beyond, -60, 60), rng.uniform(0.5, 2)))


def cable(rng, _):
    """Tubes and cables of the vehicle: bent cylinders, bright in the middle, before the sky or a wall."""
    light = np.full((HEIGHT, WIDTH), rng.uniform(0, 0.05)) * (1 + rng.uniform(0, 0.5) * pattern(rng, 2, 1))
    for _ in range(rng.integers(1, 5)):
        distance, half = arc(rng, 0.25, 3), math.exp(rng.uniform(math.log(6), math.log(120)))
        across = distance / half + rng.uniform(-0.2, 0.2)
        shade = np.sqrt(np.clip(1 - across * across, 0, 1)) * (1 + rng.uniform(0, 0.8) * across)
        inside = step((np.abs(across) - 1) * half, rng.uniform(0.4, 2))
        light = light * (1 - inside) + rng.uniform(0.2, 0.9) * (shade + 0.1) * inside
    return light


# decoy_pictures.render_flight finds a painter by its name, and takes the seed from its place.
KINDS = {kind.__name__: kind for kind in (glint, cyclone, tank, crater, foil, plume, river, cable)}
decoy.KINDS.update(KINDS)
