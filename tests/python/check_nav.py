"""Reads the attitude files of ``hzn fuse`` with other libraries: SPICE (CK, SCLK, FK), ccsds-ndm and brahe (AEM), mcap.

Usage: check_nav.py HZN EXAMPLE FOLDER. EXAMPLE writes a flight without pictures.

Orekit reads the AEM too, but not without its own data (the history of UTC - TAI), so ccsds-ndm reads it here.
"""

import csv
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import brahe as bh
import numpy as np
import spiceypy as spice
from ccsds_ndm.ndm_io import NdmIo
from mcap.reader import make_reader

sys.path.insert(0, str(Path(__file__).parents[2] / "crates/hzn-py/examples"))
import brahe_aem

SPACECRAFT = -999
UTC = "2019-06-13T04:00:00Z"


def rotation(w: float, x: float, y: float, z: float) -> np.ndarray:
    """Return the matrix of a unit quaternion."""
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def fuse(hzn: str, folder: Path, output: str, *more: str) -> None:
    """Run ``hzn fuse`` on the flight."""
    command = [hzn, "fuse", "--imu", folder / "imu.csv", "--gnss", folder / "gnss.csv", "-o", folder / output]
    for camera in ("left", "right"):
        command += ["--nadir", folder / f"{camera}.csv", "--mount", f"{camera}={folder / camera}.toml"]
    command += ["--utc", UTC, "--aem", folder / "nav.aem", "--ck", folder / "nav.bc", "--force", "--smooth", *more]
    subprocess.run(command, check=True, capture_output=True)


Attitude = Callable[[float], np.ndarray]


def check_truth(name: str, attitude_at: Attitude, folder: Path, rows: list[dict[str, str]]) -> None:
    """Compare an attitude as a library gives it with the truth of the flight: each error, and NEES."""
    with (folder / "vehicle.csv").open() as file:
        vehicle = list(csv.DictReader(file))
    sigmas, nees = brahe_aem.misses(attitude_at, vehicle, rows)
    assert len(nees) > 100, len(nees)
    assert np.abs(sigmas).max() < 3, np.abs(sigmas).max()
    # Rows that follow each other have nearly the same error, so their mean is as uncertain as a few draws. The bounds are
    # the 1 % and 99 % points of one draw: chi-square with three degrees of freedom.
    assert 0.11 < np.mean(nees) < 11.3, np.mean(nees)
    print(f"{name}: {len(nees)} attitudes against the truth; NEES (3 degrees of freedom) {np.mean(nees):.2f}; errors "
          f"at most {np.abs(sigmas).max():.2f} sigmas")


def check_ck(folder: Path, rows: list[dict[str, str]]) -> None:
    """Compare the CK with the CSV and with the truth, as SPICE reads it."""
    for kind in ("tsc", "tf", "bc"):
        spice.furnsh(str(folder / f"nav.{kind}"))
    assert list(spice.ckobj(str(folder / "nav.bc"))) == [1000 * SPACECRAFT]
    assert spice.frmnam(1000 * SPACECRAFT) == "HZN_BODY"
    begin = float(rows[0]["time_s"])

    def attitude_at(time_s: float) -> np.ndarray:
        # SPICE's matrix turns vectors from ITRF93 into the frame of the vehicle.
        return spice.ckgp(1000 * SPACECRAFT, round((time_s - begin) * 1e6), 0.0, "ITRF93")[0].T

    worst = 0.0
    for row in rows:
        fixed_from_vehicle = rotation(*(float(row[name]) for name in ("qw", "qx", "qy", "qz")))
        worst = max(worst, np.abs(attitude_at(float(row["time_s"])) - fixed_from_vehicle).max())
    assert worst < 1e-8, worst
    print(f"CK: {len(rows)} attitudes, differences below {worst:.1e}")
    check_truth("CK in SPICE", attitude_at, folder, rows)


def check_aem(folder: Path, rows: list[dict[str, str]]) -> None:
    """Compare the AEM with the CSV, as ccsds-ndm reads it."""
    message = NdmIo().from_path(folder / "nav.aem")
    (segment,) = message.body.segment
    meta, states = segment.metadata, segment.data.attitude_state
    told = (meta.ref_frame_a, meta.ref_frame_b, meta.time_system)
    assert [str(getattr(x, "value", x)) for x in told] == ["ITRF-97", "SC_BODY_1", "UTC"], told
    worst = 0.0
    by_time = {row["time_s"]: row for row in rows}
    assert len(states) == len(by_time), (len(states), len(by_time))
    for state, row in zip(states, by_time.values(), strict=True):
        q = state.quaternion_state.quaternion
        told = [float(row[name]) for name in ("qw", "qx", "qy", "qz")]
        worst = max(worst, np.abs(np.array([q.qc, q.q1, q.q2, q.q3], float) - told).max())
    assert worst < 1e-11, worst
    assert states[0].quaternion_state.epoch.startswith("2019-06-13T04:0"), states[0].quaternion_state.epoch
    print(f"AEM: {len(states)} attitudes, differences below {worst:.1e}")


def check_brahe(folder: Path, rows: list[dict[str, str]]) -> None:
    """Compare the AEM of version 2.0 with the CSV, as the example with brahe reads it, at and between its times."""
    start = bh.Epoch.from_datetime(2019, 6, 13, 4, 0, 0.0, 0.0, bh.TimeSystem.UTC)
    attitude = brahe_aem.read(folder / "nav.aem")
    times = np.array([float(row["time_s"]) for row in rows])
    truth = np.array([rotation(*(float(row[name]) for name in ("qw", "qx", "qy", "qz"))) for row in rows])
    for time_s, matrix in zip(times, truth, strict=True):
        # The times of the message have microseconds.
        assert angle_deg(brahe_aem.fixed_from_vehicle(attitude, start + time_s), matrix) < 1e-3, time_s
    # A time between two of the message: the turn from the first one is that part of the whole turn.
    i = int(np.argmin(np.abs(np.diff(times) - 1)))
    between = brahe_aem.fixed_from_vehicle(attitude, start + (times[i] + times[i + 1]) / 2)
    whole, part = angle_deg(truth[i], truth[i + 1]), angle_deg(truth[i], between)
    assert whole > 0.01, whole
    assert abs(part - whole / 2) < 0.01 * whole, (part, whole)
    check_truth("AEM in brahe", lambda t: brahe_aem.fixed_from_vehicle(attitude, start + t), folder, rows)


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    """Return the angle of the rotation between two matrices."""
    return 2 * np.degrees(np.arcsin(min(1.0, np.linalg.norm(a - b) / np.sqrt(8))))


def check_mcap(folder: Path) -> None:
    """Read the recording."""
    with (folder / "nav.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        topics = {channel.topic for _, channel, _ in reader.iter_messages()}
        attached = [a.name for a in reader.iter_attachments()]
    expected = {"/nav/state", "/nav/back", "/nav/smoothed", "/nav/pose", "/tf", "/nav/innovation/left/limb"}
    assert expected <= topics, topics
    assert attached == ["fuse.toml"], attached
    print(f"MCAP: {len(topics)} topics")


def main() -> None:
    """Make a flight, fuse it, and read everything."""
    hzn, example, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    subprocess.run([example, folder], check=True)
    fuse(hzn, folder, "nav.mcap")
    fuse(hzn, folder, "nav.csv")
    with (folder / "nav.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["phase"] == "smoothed"]
    # Several measurements can have one time; the last of them counts.
    rows = list({row["time_s"]: row for row in rows}.values())
    check_ck(folder, rows)
    check_aem(folder, rows)
    check_mcap(folder)
    fuse(hzn, folder, "nav.csv", "--aem-version", "2.0")
    check_brahe(folder, rows)


if __name__ == "__main__":
    main()
