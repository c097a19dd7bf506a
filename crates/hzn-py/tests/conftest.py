import os
import subprocess

import numpy as np
import pytest

import hzn

CAMERA = dict(width=320, height=240, model="pinhole", fx_px=300.0, fy_px=300.0, cx_px=159.5, cy_px=119.5)
PARAMETERS = {"camera": CAMERA, "body": {"kind": "earth-sphere", "altitude_km": 400.0}}


def limb(shift=0.0):
    """Return a picture of a bright body: half-angle 70 degrees, centre 68 degrees below the optical axis."""
    y, x = np.mgrid[0:240, 0:320]
    u, v = (x - 159.5) / 300.0, (y - 119.5) / 300.0
    s = np.radians(68.0 + 0.05 * shift)
    cos = (v * np.sin(s) + np.cos(s)) / np.sqrt(1 + u * u + v * v)
    px = (np.radians(70.38) - np.arccos(np.clip(cos, -1, 1))) * 300.0
    return (20 + 180 * np.clip(0.5 + px / 2, 0, 1)).astype(np.uint8)


def pgm(image):
    """Return the contents of a picture file."""
    height, width = image.shape
    return b"P5\n%d %d\n255\n" % (width, height) + image.tobytes()


@pytest.fixture
def sensor():
    return hzn.Sensor(**PARAMETERS)


@pytest.fixture
def hzn_program():
    """Return the path of the command `hzn` of the same build, which cargo xtask test sets."""
    return os.environ["HZN_PROGRAM"]


@pytest.fixture
def folder(tmp_path):
    """Return a folder of fifty pictures with their sensor.toml."""
    for i in range(50):
        (tmp_path / f"{i:02}.pgm").write_bytes(pgm(limb(i)))
    lines = ["[camera]"] + [f"{k} = {v!r}".replace("'", '"') for k, v in CAMERA.items()]
    lines += ["[body]", 'kind = "earth-sphere"', "altitude_km = 400.0"]
    (tmp_path / "sensor.toml").write_text("\n".join(lines) + "\n")
    return tmp_path


@pytest.fixture
def recording(folder, hzn_program):
    """Return the recording that `hzn run` makes of the folder."""
    out = folder / "out.mcap"
    subprocess.run([hzn_program, "run", "-q", folder, "-o", out], check=True)
    return out
