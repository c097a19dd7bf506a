"""Prints how accurate the joint answer of several heads is, by linear propagation.

The tables are those of the guide "How many heads, and where?".

    python rig_design.py

Each head looks at the limb and sees an arc of it. Unknown are the axis, the common height of the limb, a height of
each head's own, and the mounts. An edge point is wrong by 0.3 px, correlated over 25 of 600 points. Printed is the RMS
of the two-dimensional error of the axis in degrees.
"""

import math

import numpy as np

RADIUS_KM = 6371.0 + 25.0
POINTS, CORRELATION, SIGMA_PX, FOCAL_PX = 600, 25.0, 0.3, 554.0
RIGS = [("one", [0]), ("two opposite", [0, 180]), ("two adjacent", [0, 90]), ("three", [0, 120, 240]),
        ("four", [0, 90, 180, 270])]


def half_angle(altitude_km):
    return math.asin(RADIUS_KM / (6371.0 + altitude_km))


def arc(alpha, field_of_view_deg):
    """Returns half of the azimuths that a camera sees whose axis is on the limb."""
    steps = np.linspace(0.0, math.pi, 20001)
    x, z = math.sin(alpha) * np.sin(steps), math.sin(alpha) ** 2 * np.cos(steps) + math.cos(alpha) ** 2
    inside = np.arctan2(x, z) < math.radians(field_of_view_deg / 2)
    return steps[np.argmin(inside) - 1] if not inside.all() else math.pi


def rms_deg(azimuths_deg, altitude_km=500.0, field_of_view_deg=60.0, mount_deg=0.0, tilt_km=0.0, own_km=1.5,
            common_km=10.0):
    alpha = half_angle(altitude_km)
    by_km = math.tan(alpha) / RADIUS_KM
    heads = len(azimuths_deg)
    # Two components of the axis, the common height, and for each head its own height and three rotations of its mount.
    size = 3 + 4 * heads
    information = np.zeros((size, size))
    noise = (SIGMA_PX / FOCAL_PX) ** 2 * np.exp(-np.abs(np.subtract.outer(*[np.arange(POINTS)] * 2)) / CORRELATION)
    weight = np.linalg.inv(noise)
    half = arc(alpha, field_of_view_deg)
    for k, azimuth in enumerate(azimuths_deg):
        psi = math.radians(azimuth) + np.linspace(-half, half, POINTS)
        sin, cos = math.sin(alpha), math.cos(alpha)
        ray = np.column_stack([sin * np.cos(psi), sin * np.sin(psi), np.full(POINTS, cos)])
        outward = np.column_stack([cos * np.cos(psi), cos * np.sin(psi), np.full(POINTS, -sin)])
        rows = np.zeros((POINTS, size))
        # An axis that moves along x moves the edge at the azimuth 0 outward.
        rows[:, 0], rows[:, 1], rows[:, 2] = np.cos(psi), np.sin(psi), by_km
        rows[:, 3 + 4 * k] = by_km
        rows[:, 4 + 4 * k : 7 + 4 * k] = np.cross(ray, outward)
        information += rows.T @ weight @ rows
    priors = [0.0, 0.0, common_km] + [own_km, *[math.radians(mount_deg)] * 3] * heads
    for i, sigma in enumerate(priors):
        if i > 1:
            information[i, i] += 1.0 / max(sigma, 1e-9) ** 2
    covariance = np.linalg.inv(information)[:2, :2]
    return math.degrees(math.sqrt(np.trace(covariance) + 2 * (tilt_km * by_km) ** 2))


def bound_deg(azimuths_deg, sigma_px, weather_km=0.0, length_km=1000.0, correlation_px=2.0, points=100):
    """Returns the smallest error that an unbiased estimate can have at 500 km: the Cramer-Rao bound of axis and height.

    The common height is known to 10 km. The weather of the limb is a random field with a Gaussian correlation, whose
    covariance the estimate knows for all pairs of edge points of all heads.
    """
    alpha, radius = half_angle(500.0), RADIUS_KM
    by_km, half = math.tan(alpha) / radius, arc(alpha, 60.0)
    psi = np.concatenate([math.radians(azimuth) + np.linspace(-half, half, points) for azimuth in azimuths_deg])
    head = np.repeat(np.arange(len(azimuths_deg)), points)
    rows = np.column_stack([np.cos(psi), np.sin(psi), np.full(psi.size, by_km)])
    # A point stands for POINTS / points neighbours.
    step_px = POINTS / points
    along = np.abs(np.subtract.outer(*[np.arange(psi.size)] * 2)) * step_px
    share = (1.0 + 2.0 * sum(math.exp(-k / correlation_px) for k in range(1, POINTS))) / step_px
    near = np.exp(-along / correlation_px) if correlation_px > step_px else np.eye(psi.size) * max(share, 1.0 / step_px)
    noise = (sigma_px / FOCAL_PX) ** 2 * near * (head[:, None] == head)
    # The limb is a circle with the radius of the body times the cosine of the half-angle.
    circle = radius * math.cos(alpha) * np.column_stack([np.cos(psi), np.sin(psi)])
    apart = np.linalg.norm(circle[:, None] - circle, axis=2)
    noise = noise + (by_km * weather_km) ** 2 * np.exp(-0.5 * (apart / length_km) ** 2)
    information = rows.T @ np.linalg.solve(noise + 1e-18 * np.eye(psi.size), rows)
    information[2, 2] += 1.0 / 10.0**2
    return math.degrees(math.sqrt(np.trace(np.linalg.inv(information)[:2, :2])))


def table(title, columns):
    print(f"| {title} | " + " | ".join(name for name, _ in columns) + " |\n|---|" + "---:|" * len(columns))
    for name, azimuths in RIGS:
        print(f"| {name} | " + " | ".join(f"{rms_deg(azimuths, **keys):.3f}" for _, keys in columns) + " |")
    print()


def main():
    free = {"common_km": 1e6}
    table("heads of 60° at 500 km", [
        ("height ± 10 km", {}), ("height unknown", free), ("and mounts ± 0.02°", {"mount_deg": 0.02, **free}),
        ("mounts ± 0.05°", {"mount_deg": 0.05, **free}), ("tilt of the limb 0.78 km", {"tilt_km": 0.78, **free}),
        ("own heights 0", {"own_km": 0.0, **free})])
    table("altitude, height unknown", [(f"{h} km", {"altitude_km": h, **free}) for h in (100.0, 230.0, 500.0, 1000.0)])
    table("field of view at 500 km, height unknown",
          [(f"{f}°", {"field_of_view_deg": f, **free}) for f in (20.0, 40.0, 60.0, 90.0)])
    print("| angle between two heads of 60° at 500 km, height unknown | RMS |\n|---:|---:|")
    for angle in (30, 60, 90, 120, 150, 180):
        print(f"| {angle}° | {rms_deg([0, angle], **free):.3f} |")
    print("\n| one camera at 500 km that sees the whole limb, by own height | RMS |\n|---:|---:|")
    for own in (0.0, 1.5):
        # Four arcs of 90 degrees of azimuth are the whole limb; here they are arcs of one mount.
        print(f"| {own} km | {whole_deg(own):.3f} |")


def whole_deg(own_km):
    """Returns the error of one camera with the whole limb in view, each quarter of which has a height of its own."""
    alpha = half_angle(500.0)
    by_km = math.tan(alpha) / RADIUS_KM
    psi = np.linspace(0.0, 2 * math.pi, POINTS, endpoint=False)
    rows = np.column_stack([np.cos(psi), np.sin(psi), np.full(POINTS, by_km)] +
                           [by_km * ((psi // (math.pi / 2)) == k) for k in range(4)])
    # The lens of the whole limb has fewer pixels for each degree: 640 px for 2 alpha.
    px_rad = 2 * alpha / 640.0
    noise = (SIGMA_PX * px_rad) ** 2 * np.exp(-np.abs(np.subtract.outer(*[np.arange(POINTS)] * 2)) / CORRELATION)
    information = rows.T @ np.linalg.inv(noise) @ rows
    information[2, 2] += 1e-12
    for k in range(3, 7):
        information[k, k] += 1.0 / max(own_km, 1e-9) ** 2
    return math.degrees(math.sqrt(np.trace(np.linalg.inv(information)[:2, :2])))


if __name__ == "__main__":
    main()
