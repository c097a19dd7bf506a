"""`hzn.nav` against SciPy, and a flight through the filter."""

import csv

import numpy as np
import pytest

import hzn


def rotation(rng):
    """A random rotation matrix."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def unit(v):
    return v / np.linalg.norm(v)


def test_triad_and_wahba_find_a_rotation():
    rng = np.random.default_rng(3)
    for _ in range(20):
        truth = rotation(rng)
        body = np.array([unit(rng.normal(size=3)) for _ in range(4)])
        reference = body @ truth.T
        found = hzn.nav.triad((body[0], reference[0]), (body[1], reference[1]))
        assert np.allclose(found, truth, atol=1e-12)
        attitude, covariance, chi2 = hzn.nav.wahba(body, reference, np.full(4, 1e-3))
        assert np.allclose(attitude, truth, atol=1e-9) and chi2 < 1e-6
        # Four directions of 1 mrad: the variance is some 1e-6/4 to 1e-6.
        assert 5e-8 < np.trace(covariance) / 3 < 1e-5
    assert hzn.nav.triad((body[0], reference[0]), (body[0], reference[0])) is None
    assert hzn.nav.wahba(body[:1], reference[:1], [1e-3]) is None
    with pytest.raises(hzn.ConfigError, match=r"body: the shape is \(2, 3\)"):
        hzn.nav.wahba(body[:2], reference, np.full(4, 1e-3))


def test_the_sun_is_an_astronomical_unit_away_and_the_moon_is_near():
    assert 1.47e11 < np.linalg.norm(hzn.nav.sun(1.56e9)) < 1.53e11
    assert 3.5e8 < np.linalg.norm(hzn.nav.moon(1.56e9)) < 4.1e8


def test_a_filter_at_rest_learns_its_attitude():
    rng = np.random.default_rng(5)
    truth = rotation(rng)
    position = np.array([3.2e6, 1.1e6, 5.4e6])
    rate = np.array([0, 0, 7.292115e-5])
    down, sun = -unit(position), unit(np.array([0.3, -0.8, 0.5]))
    error = 0.02 * unit(rng.normal(size=3))
    skew = np.array([[0, -error[2], error[1]], [error[2], 0, -error[0]], [-error[1], error[0], 0]])
    start, _ = np.linalg.qr((np.eye(3) + skew) @ truth)
    start *= np.sign(np.diag(start.T @ truth))
    settings = {"camera": {"misalignment_deg": {"mode": "off", "sigma": 0.0}, "white_rad": 1e-3}}
    mounts = [np.eye(3), np.eye(3)]
    nav = hzn.nav.Filter(0.0, start, np.zeros(3), position, mounts=mounts, settings=settings)
    covariance = 1e-8 * np.eye(3)
    # The weight is balanced: gravity points almost to the centre, and positions hold the rest.
    for step in range(200):
        time_s = 0.1 * step
        assert nav.predict(time_s, truth.T @ rate, truth.T @ (-9.8 * down)) == ("taken" if step else "first")
        for camera, reference in enumerate((down, sun)):
            # Half of the covariance of the limb is common; the Sun does not tell it.
            common = 0.5 * covariance if camera == 0 else None
            innovation = nav.update_direction(camera, truth.T @ reference, reference, covariance, common=common)
            assert innovation.taken and innovation.value.shape == (2,)
        assert nav.update_position(position, 5.0).taken
        nav.update_velocity(np.zeros(3), 0.1)
    angle = np.arccos(np.clip((np.trace(nav.attitude.T @ truth) - 1) / 2, -1, 1))
    assert angle < 3e-3, angle
    assert nav.covariance.shape[0] >= 9 and np.allclose(nav.covariance, nav.covariance.T)
    assert nav.update_direction(7, down, down, covariance) is None
    with pytest.raises(hzn.ConfigError, match="common"):
        nav.update_direction(0, truth.T @ down, down, covariance, common=np.zeros(3))
    assert nav.predict(5.0, np.zeros(3), np.zeros(3)) == "out-of-order"
    with pytest.raises(hzn.ConfigError, match="a rotation matrix is expected"):
        hzn.nav.Filter(0.0, -truth, np.zeros(3), position)
    with pytest.raises(hzn.ConfigError, match="white_rad"):
        hzn.nav.Filter(0.0, truth, np.zeros(3), position, settings={"camera": {"white_rad": -1.0}})


def write_flight(folder, truth, position):
    """Files of a vehicle at rest that sees limb and Sun for 30 s."""
    rate, down, sun = np.array([0, 0, 7.292115e-5]), -unit(position), unit(np.array([0.3, -0.8, 0.5]))
    gyro, accel = truth.T @ rate, truth.T @ (-9.8 * down)
    with (folder / "imu.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["time_s", *(f"gyro_{a}_radps" for a in "xyz"), *(f"accel_{a}_mps2" for a in "xyz")])
        out.writerows([0.1 * k, *gyro, *accel] for k in range(301))
    with (folder / "gnss.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["time_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"])
        out.writerows([t, *position, 0, 0, 0] for t in range(31))
    with (folder / "cam.csv").open("w", newline="") as file:
        out = csv.writer(file)
        cov = [f"cov_{c}" for c in ("xx", "xy", "xz", "yy", "yz", "zz")]
        axes = [f"axis_{a}" for a in "xyz"], [f"axis_e_{a}" for a in "xyz"]
        out.writerow(["index", "file", "time_s", "body", "status", *axes[0], *cov, *axes[1], "detail"])
        for t in range(1, 30):
            for body, reference in (("earth", down), ("sun", sun)):
                axis = truth.T @ reference
                p = 1e-6 * (np.eye(3) - np.outer(axis, axis))
                out.writerow([t, f"{t}.png", t, body, "ok", *axis, *p[np.triu_indices(3)], *reference, ""])


def test_fuse_gives_attitudes(tmp_path):
    truth, position = rotation(np.random.default_rng(7)), np.array([3.2e6, 1.1e6, 5.4e6])
    write_flight(tmp_path, truth, position)
    files = {"imu": tmp_path / "imu.csv", "gnss": tmp_path / "gnss.csv"}
    result = hzn.nav.fuse([tmp_path / "cam.csv"], mounts={"cam": np.eye(3)}, smooth=True, **files)
    assert result["cameras"] == ["cam"] and result["start_s"] == 1.0 and result["restarts"] == 0
    assert result["verdict"] in ("consistent", "doubtful", "contradicts")
    assert len(result["states"][0]["position_cov_m2"]) == 6
    assert all({"level", "source", "what"} == set(finding) for finding in result["findings"])
    last = [state for state in result["states"] if state["phase"] == "filter"][-1]
    w, x, y, z = (last[name] for name in ("qw", "qx", "qy", "qz"))
    column = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
    # The mount is only known to a degree, and the vehicle does not turn.
    assert np.allclose(column, truth[:, 0], atol=0.05)
    assert {state["phase"] for state in result["states"]} == {"back", "filter", "smoothed"}
    assert all(i["taken"] for i in result["innovations"] if i["kind"] in ("limb", "sun"))
    with pytest.raises(hzn.ConfigError, match="cam: nobody says how the camera is mounted"):
        hzn.nav.fuse([tmp_path / "cam.csv"], **files)
    with pytest.raises(hzn.ConfigError, match="there is no camera 'came'|there is no camera \"came\""):
        hzn.nav.fuse([tmp_path / "cam.csv"], mounts={"came": np.eye(3)}, **files)
    with pytest.raises(hzn.ConfigError, match="no such file"):
        hzn.nav.fuse([tmp_path / "none.csv"], **files)


def test_solve_takes_the_whole_flight_at_once(tmp_path):
    truth, position = rotation(np.random.default_rng(11)), np.array([3.2e6, 1.1e6, 5.4e6])
    write_flight(tmp_path, truth, position)
    files = {"imu": tmp_path / "imu.csv", "gnss": tmp_path / "gnss.csv", "mounts": {"cam": np.eye(3)}}
    assert hzn.nav.fuse([tmp_path / "cam.csv"], **files)["solved"] is None
    result = hzn.nav.solve([tmp_path / "cam.csv"], **files)
    solved = result["solved"]
    assert solved["is_converged"] and solved["knots"] > 20 and solved["cost"][1] <= solved["cost"][0]
    values = {entry["name"]: entry for entry in solved["determined"]}
    assert values and all(np.all(np.array(v["sigma"]) <= np.array(v["before"]) * 1.001) for v in values.values())
    assert all({"time_s", "camera", "kind", "sigmas", "weight"} == set(entry) for entry in solved["lowered"])
    last = [state for state in result["states"] if state["phase"] == "smoothed"][-1]
    w, x, y, z = (last[name] for name in ("qw", "qx", "qy", "qz"))
    column = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
    assert np.allclose(column, truth[:, 0], atol=0.05)


def write_orbit(folder, radius, pictures, step_s):
    """Files of a satellite on a circular orbit over the equator that sees the limb straight below, for two orbits."""
    spin, ratio = 7.292115e-5, 6378137.0 / radius
    zonal = 1 + 1.5 * 1.08262668e-3 * ratio**2 + 15 / 8 * 1.61962e-6 * ratio**4
    mean_motion = np.sqrt(3.986004418e14 / radius**3 * zonal)
    places = []
    with (folder / "stars.csv").open("w", newline="") as stars, (folder / "cam.csv").open("w", newline="") as file:
        attitudes, rows = csv.writer(stars), csv.writer(file)
        attitudes.writerow(["time_s", "qw", "qx", "qy", "qz", "sigma_deg"])
        cov = [f"cov_{c}" for c in ("xx", "xy", "xz", "yy", "yz", "zz")]
        rows.writerow(["index", "file", "time_s", "body", "status", "axis_x", "axis_y", "axis_z", *cov, "altitude_km", "detail"])
        for k in range(pictures):
            t = k * step_s
            angle = (mean_motion - spin) * t
            places.append(radius * np.array([np.cos(angle), np.sin(angle), 0.0]))
            # The vehicle looks down along z and flies along x; at time 0 it is above (1, 0, 0).
            c, s = np.cos(angle / 2), np.sin(angle / 2)
            w, x, y, z = 0.5, -0.5, -0.5, 0.5
            attitudes.writerow([t, c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w, 0.003])
            rows.writerow([k, f"{k}.png", t, "earth", "ok", 0, 0, 1, 1e-7, 0, 0, 1e-7, 0, 0, (radius - 6378137.0) / 1e3, ""])
    return places


def test_solve_finds_an_orbit_without_an_inertial_unit(tmp_path):
    radius = 6_878_137.0
    places = write_orbit(tmp_path, radius, 190, 60.0)
    off = {"mode": "off", "sigma": 0.0}
    settings = {"camera": {"misalignment_deg": off, "clock_s": off}}
    files = {"attitude": tmp_path / "stars.csv", "mounts": {"cam": np.eye(3)}, "settings": settings}
    result = hzn.nav.solve([tmp_path / "cam.csv"], **files)
    orbit = result["solved"]["orbit"]
    assert abs(orbit["semi_axis_m"] - radius) < 2e4 and orbit["eccentricity"] < 0.01 and orbit["inclination_rad"] < 0.01
    assert all(0 < bound <= 1.01 * sigma < 2e4 for bound, sigma in zip(orbit["bound_m"], orbit["sigma_m"], strict=True))
    last = [state for state in result["states"] if state["phase"] == "smoothed"][-1]
    assert np.linalg.norm(np.array([last["x_m"], last["y_m"], last["z_m"]]) - places[-1]) < 5e3
    with pytest.raises(hzn.ConfigError, match="a receiver needs the samples of an inertial unit"):
        (tmp_path / "gnss.csv").write_text("time_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n0,7e6,0,0,0,7e3,0\n1,7e6,7e3,0,0,7e3,0\n")
        hzn.nav.solve([tmp_path / "cam.csv"], gnss=tmp_path / "gnss.csv", **files)
