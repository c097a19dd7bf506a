"""How much the lenses of public calibrations differ from an ideal fisheye or pinhole.

`hzn init` writes the sigmas of k1, k2, p1 and p2 of a lens that nobody calibrated. This script measures them again:

    git clone --depth 1 https://github.com/gyroflow/lens_profiles
    git clone --depth 1 https://github.com/rpng/open_vins
    git clone --depth 1 https://github.com/HKUST-Aerial-Robotics/VINS-Fusion
    git clone --depth 1 https://github.com/MIT-SPARK/Kimera-VIO
    python tests/python/lens_shapes.py lens_profiles open_vins VINS-Fusion Kimera-VIO

The shape is r(θ)/r(edge) in units of the edge, u + b1 (u³ − u) + b2 u (u² − 1)(u² − 1/3), where u is the radius in the
ideal lens. b1 is k1 edge², and b2 is k2 edge⁴ with the places u = 1 and u = 1/√3 fixed. A lens counts as a fisheye if its
radius at half the angle of the edge is nearer to that of an equidistant lens than to that of a pinhole.
"""

import json
import math
import pathlib
import re
import sys

NUMBER = r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?"


def radius(k, theta):
    """Returns the radius of OpenCV's fisheye, in focal lengths."""
    q = theta * theta
    return theta * (1 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3]))))


def edge_angle(k, edge):
    """Returns the angle of a radius; None if the lens ends before it."""
    theta, last = 0.0, 0.0
    while theta < 0.75 * math.pi:
        theta += 0.002
        here = radius(k, theta)
        if here < last:
            return None
        if here >= edge:
            return theta
        last = here
    return None


def profiles(folder):
    """Yields the best calibration of each camera with its lens: angle of the edge and coefficients."""
    best = {}
    for path in pathlib.Path(folder).rglob("*.json"):
        try:
            data = json.loads(path.read_text(errors="replace"))
            fisheye = data["fisheye_params"]
            k, matrix, rms = fisheye["distortion_coeffs"], fisheye["camera_matrix"], fisheye["RMS_error"]
            width, height = data["calib_dimension"]["w"], data["calib_dimension"]["h"]
        except (ValueError, KeyError, TypeError):
            continue
        known = data.get("use_opencv_fisheye") and len(k) == 4 and abs(k[0]) > 1e-9 and rms and 0 < rms < 1
        if not known or (data.get("num_images") or 0) < 10:
            continue
        off = math.hypot(matrix[0][2] - width / 2, matrix[1][2] - height / 2) / width
        theta = edge_angle(k, 0.5 * width / matrix[0][0])
        name = (data.get("camera_brand"), data.get("camera_model"), data.get("lens_model"))
        if off < 0.1 and theta and (name not in best or rms < best[name][0]):
            best[name] = (rms, theta, k)
    return [(theta, k) for _, theta, k in best.values()]


def modes(theta, k, ideal):
    """Fits b1 and b2 by least squares over the area of the picture."""
    edge, r_edge = ideal(theta), radius(k, theta)
    sums = [0.0] * 5
    for i in range(1, 61):
        part = theta * i / 60
        u, s = ideal(part) / edge, radius(k, part) / r_edge
        a, b = u**3 - u, u * (u * u - 1) * (u * u - 1 / 3)
        for n, x in enumerate((a * a, a * b, b * b, a * (s - u), b * (s - u))):
            sums[n] += u * x
    aa, ab, bb, ar, br = sums
    det = aa * bb - ab * ab
    return (bb * ar - ab * br) / det, (aa * br - ab * ar) / det


def rms(values):
    """Returns the RMS without the largest 3 %."""
    kept = sorted(abs(v) for v in values)[: math.ceil(0.97 * len(values))]
    return math.sqrt(sum(v * v for v in kept) / len(kept))


def decentring(folder):
    """Yields p1 and p2 of the calibrations in the YAML files of Kalibr's, ASL's and camodocal's format."""
    for path in sorted(p for p in pathlib.Path(folder).rglob("*") if p.suffix in (".yaml", ".yml")):
        text = "\n".join(x for x in path.read_text(errors="replace").splitlines() if not x.lstrip().startswith("#"))
        for block in re.split(r"\n(?=cam\d+:)", text):
            if re.search("equidistant|kannala|mei|omni", block, re.IGNORECASE):
                continue
            found = re.search(r"distortion_coeff\w*:\s*\[([^\]]*)\]", block)
            named = [re.search(rf"(?m)^\s*{name}:\s*({NUMBER})", block) for name in ("k1", "k2", "p1", "p2")]
            k = [float(x) for x in re.findall(NUMBER, found[1])] if found else [float(x[1]) for x in named if x]
            if len(k) >= 4 and abs(k[0]) > 1e-6 and any(abs(p) > 1e-9 for p in k[2:4]):
                yield round(k[0], 3), (k[2], k[3])


def main():
    shapes, *others = sys.argv[1:]
    lenses = [(theta, k) for theta, k in profiles(shapes) if 20 < 2 * math.degrees(theta) < 170]
    for name, ideal in (("fisheye", lambda t: t), ("pinhole", math.tan)):
        every = []
        for low, high in ((20, 50), (50, 70), (70, 90), (90, 110), (110, 170)):
            found = []
            for theta, k in lenses:
                fov = 2 * math.degrees(theta)
                middle = radius(k, theta / 2) / radius(k, theta)
                flat = math.tan(theta / 2) / math.tan(theta) if theta < 1.4 else 0.0
                is_fisheye = (flat - middle) / (flat - 0.5) > 0.5
                if low <= fov < high and is_fisheye == (name == "fisheye") and (is_fisheye or fov < 110):
                    found.append(modes(theta, k, ideal))
            if len(found) < 8:
                continue
            b1, b2 = zip(*found)
            both = sum(x * y for x, y in found) / math.sqrt(sum(x * x for x in b1) * sum(x * x for x in b2))
            print(f"{name} {low}-{high} deg: {len(found)} cameras, RMS b1 {rms(b1):.3f}, b2 {rms(b2):.3f}, "
                  f"correlation {both:.2f}")
            every += b2
        print(f"{name}: {len(every)} cameras, RMS b2 {rms(every):.3f}")
    cameras = dict(pair for folder in others for pair in decentring(folder))
    # TUM RGB-D, from ORB-SLAM2's TUM1.yaml and TUM2.yaml.
    cameras.update({0.262: (-0.005358, 0.002628), 0.231: (-0.003257, -0.000105)})
    values = [p for pair in cameras.values() for p in pair]
    print(f"p1, p2: {len(cameras)} cameras, RMS {math.sqrt(sum(p * p for p in values) / len(values)):.4f}, "
          f"largest {max(map(abs, values)):.4f}")


main()
