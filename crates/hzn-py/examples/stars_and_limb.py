"""Stars and limb in one picture: the whole attitude of the camera, its focal length, and the direction to the Earth.

    pip install hzn-sensor cedar-solve
    python stars_and_limb.py

A long exposure shows stars beside a limb that is far overexposed. hzn finds the limb and its mask; cedar-solve, a solver that
needs no attitude to begin with, names the stars that are left. Stars and limb then check each other: the stars turn the limb's
direction into inertial axes, and there it must be opposite to the position.

Three traps: a star is where its light falls, so the mask must be removed before stars are searched; cedar-solve counts pixels from
the corner of the picture, hzn from the middle of the first pixel; and its catalogue has the axes of J2000, which precession has
turned by a third of a degree since. Nutation, polar motion and aberration together are below 0.01 degrees and left out.
"""

import numpy as np
from tetra3 import Tetra3, get_centroids_from_image

import hzn

SIZE = (1024, 768)
FOCAL_PX = 2050.0  # the true one; 28 degrees over the width
TOLD_PX = 2000.0  # the one of the data sheet
GAIN = 30.0  # exposure, compared with one that shows the lit Earth without overexposure
FULL = 4095  # 12 bits
PSF_PX = 1.2
MIDDLE = np.array([SIZE[0] / 2 - 0.5, SIZE[1] / 2 - 0.5])
SUN = np.array([-0.93, -0.02, 0.37])  # at this time
START_S = 1_626_307_200.0  # 2021-07-15T00:00:00Z


def camera(focal_px, **keys):
    cx_px, cy_px = SIZE[0] / 2 - 0.5, SIZE[1] / 2 - 0.5
    return dict(width=SIZE[0], height=SIZE[1], model="pinhole", fx_px=focal_px, fy_px=focal_px, cx_px=cx_px, cy_px=cy_px, **keys)


def sensor(focal_px, focal_sigma_percent=0.0):
    """Return a sensor that knows by how much the exposure raises the limb: 7.5 km times the logarithm of the gain."""
    body = {"kind": "earth", "clipped_height_km": 7.5 * np.log(GAIN), "clipped_sigma_km": 8.0}
    return hzn.Sensor(camera=camera(focal_px, focal_sigma_percent=focal_sigma_percent), body=body, input={"tone": "linear"})


def turn(axis, angle):
    """Return the matrix of a rotation of the axes about x (0), y (1) or z (2)."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = np.eye(3)
    out[i, i], out[j, j], out[i, j], out[j, i] = c, c, s, -s
    return out


def fixed_from_j2000(time_s):
    """Return the matrix from J2000 to ECEF: precession (Lieske 1977) and mean sidereal time."""
    days = (time_s - 946_728_000.0) / 86_400
    t = days / 36_525
    zeta, z, theta = np.radians(np.array([2306.2181 * t, 2306.2181 * t, 2004.3109 * t]) / 3600)
    sidereal = np.radians((280.460_618_37 + 360.985_647_366_29 * days) % 360)
    return turn(2, sidereal) @ turn(2, -z) @ turn(1, theta) @ turn(2, -zeta)


def quaternion(rotation):
    """Return the unit quaternion (w, x, y, z) of a rotation matrix, by the largest eigenvector of Bar-Itzhack's matrix."""
    r = rotation
    k = np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [0, r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2]],
        [0, 0, r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2]],
        [0, 0, 0, r[2, 2] - r[0, 0] - r[1, 1]],
    ])  # fmt: skip
    return np.linalg.eigh(k, UPLO="U")[1][:, -1]


def pose(rng, depression_deg=18.0, altitude_km=600.0):
    """Return a position above the lit side of the Earth (ECEF, km), and the rotation from the camera to ECEF."""
    up = SUN + 0.3 * rng.normal(size=3)
    up /= np.linalg.norm(up)
    side = np.cross(up, rng.normal(size=3))
    side /= np.linalg.norm(side)
    d = np.radians(depression_deg)
    forward = np.cos(d) * side - np.sin(d) * up
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return (6378.137 + altitude_km) * up, np.column_stack([right, np.cross(forward, right), forward])


def overexposed_world():
    """Return a scene of the lit Earth, exposed for stars, with a global shutter and without stars of its own."""
    world = hzn.simulate("rocket-clean", frames=1).parameters
    world["world"]["visible"]["stars"] = 0
    world["exposure"] = {"gain": GAIN}
    world["detector"] |= {"bits": 12, "read_noise": 0.002, "psf_sigma_px": PSF_PX}
    world["shutter"] = {}
    del world["mount"]
    return world


def add_stars(image, catalogue, camera_from_j2000, rng):
    """Return a picture of the Earth with the stars that it does not hide. One of magnitude 5 has a peak of 80 counts."""
    out = image.astype(float)
    rays = catalogue[:, 2:5] @ camera_from_j2000.T
    seen = rays[:, 2] > 0.9
    places = FOCAL_PX * rays[seen, :2] / rays[seen, 2:] + MIDDLE
    v, u = np.mgrid[-8:9, -8:9]
    for (x, y), magnitude in zip(places, catalogue[seen, 5], strict=True):
        i, j = round(y), round(x)
        part = np.s_[i - 8 : i + 9, j - 8 : j + 9]
        if 8 <= i < SIZE[1] - 8 and 8 <= j < SIZE[0] - 8 and image[part].mean() < 0.05 * FULL:
            off2 = (u + j - x) ** 2 + (v + i - y) ** 2
            out[part] += 80 * 10 ** (-0.4 * (magnitude - 5)) * np.exp(-off2 / (2 * PSF_PX**2))
    return np.clip(np.round(out + rng.normal(0, 8, out.shape)), 0, FULL).astype(np.uint16)


def simulate(seed, catalogue):
    """Return a picture with its position and its true rotation from the camera to ECEF."""
    rng = np.random.default_rng(seed)
    position_km, rotation = pose(rng)
    world = overexposed_world()
    image = hzn.render(sensor(FOCAL_PX), position_km, quaternion(rotation), START_S, world=world, seed=seed)
    return add_stars(image, catalogue, rotation.T @ fixed_from_j2000(START_S), rng), position_km, rotation


def find_stars(image, mask):
    """Return the places (x, y) of the stars outside of the mask, the brightest first, in hzn's pixels."""
    sky = np.where(mask > 0, np.median(image[mask == 0]), image)
    found = get_centroids_from_image(sky, sigma=4, min_area=3, max_area=200, max_returned=60)
    return found[:, ::-1] - 0.5


def fit(points, stars, focal_px):
    """Fit the rotation (J2000 to camera) and the focal length to named stars. Return both, and the covariance of the four."""
    rays = np.c_[points - MIDDLE, np.full(len(points), focal_px)]
    u, _, vt = np.linalg.svd((rays / np.linalg.norm(rays, axis=1)[:, None]).T @ stars)
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    for _ in range(5):
        x, y, z = (stars @ rotation.T).T
        miss = points - MIDDLE - focal_px * np.c_[x / z, y / z]
        a, b, zero = x / z, y / z, np.zeros(len(x))
        # A small turn w moves a ray by w x ray.
        by = focal_px * np.stack([np.c_[-a * b, 1 + a * a, -b], np.c_[-1 - b * b, a * b, a]], axis=1)
        rows = np.concatenate([by, np.stack([a, b], axis=1)[:, :, None]], axis=2).reshape(-1, 4)
        step = np.linalg.lstsq(rows, miss.ravel(), rcond=None)[0]
        angle = np.linalg.norm(step[:3])
        k = np.cross(np.eye(3), step[:3] / angle) if angle > 0 else np.zeros((3, 3))
        rotation = (np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k) @ rotation
        focal_px += step[3]
    left = miss.ravel() - rows @ step
    return rotation, focal_px, np.linalg.inv(rows.T @ rows) * (left @ left) / (len(left) - 4)


def solve(solver, image, position_km):
    """Return what one picture says: a dictionary, with the report of the limb at the end; None if no star is named."""
    first = sensor(TOLD_PX, focal_sigma_percent=3.0).process(image, position_km=position_km, bits=12)
    if not first:
        return None
    points = find_stars(image, first.mask(margin_deg=1.0))
    width_deg = 2 * np.degrees(np.arctan(SIZE[0] / 2 / TOLD_PX))
    # Rows come first there, and the middle of the first pixel is at 0.5.
    named = solver.solve_from_centroids(
        points[:, ::-1] + 0.5, SIZE[::-1], fov_estimate=width_deg, fov_max_error=1.5, distortion=0, return_matches=True
    )
    if named["FOV"] is None:
        return None
    ra, dec = np.radians(np.array(named["matched_stars"])[:, :2].T)
    stars = np.c_[np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)]
    rotation, focal_px, covariance = fit(np.array(named["matched_centroids"])[:, ::-1] - 0.5, stars, TOLD_PX)
    report = sensor(focal_px).process(image, position_km=position_km, bits=12)
    return dict(stars=len(stars), camera_from_j2000=rotation, focal_px=focal_px, covariance=covariance, first=first, report=report)


def angle_deg(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def misses(found, position_km, rotation):
    """Return the errors of attitude (rad, about x, y, z of the camera) and focal length, and that of the limb's axis, deg.

    The limb's axis is turned into ECEF by the stars, and compared with the direction in which the Earth is from there.
    """
    truth = rotation.T @ fixed_from_j2000(START_S)
    error = found["camera_from_j2000"] @ truth.T
    turned = np.array([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]]) / 2
    four = np.append(turned, found["focal_px"] - FOCAL_PX)
    report = found["report"]
    if not report:
        return four, None
    fixed = fixed_from_j2000(START_S) @ found["camera_from_j2000"].T @ report.axis
    return four, angle_deg(fixed, report.axis_fixed)


def main():
    solver = Tetra3()
    for seed in range(6):
        image, position_km, rotation = simulate(seed, solver.star_table)
        found = solve(solver, image, position_km)
        if found is None:
            print(f"{seed}: no star is named")
            continue
        four, limb = misses(found, position_km, rotation)
        sigmas = np.sqrt(np.diag(found["covariance"]))
        turn, of_turn = np.degrees([four[:3], sigmas[:3]]) * 3600
        print(
            f"{seed}: {found['stars']} stars; attitude off by {np.round(turn, 1)} arcsec (1 sigma {np.round(of_turn, 1)}), focal length by "
            f"{four[3]:.2f} px ({sigmas[3]:.2f}), limb against stars {limb:.3f} deg (1 sigma {found['report'].sigma_max_deg:.3f})"
        )


if __name__ == "__main__":
    main()
