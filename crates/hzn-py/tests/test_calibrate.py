"""Calibration from boards and points, compared with OpenCV on pictures that a NumPy script renders."""

import math
import pathlib
import sys
import tomllib

import cv2
import numpy as np
import pytest

import hzn

sys.path.append(str(pathlib.Path(__file__).resolve().parents[3] / "tests" / "python"))
import boards  # noqa: E402

SIZE = (640, 480)


def opencv(views, board, fisheye):
    """The calibration of OpenCV with its own corners: RMS, camera matrix, coefficients, number of boards."""
    corners = []
    for picture, *_ in views:
        found, at = cv2.findChessboardCorners(picture, (boards.COLUMNS, boards.ROWS))
        if found:
            corners.append(cv2.cornerSubPix(picture, at, (5, 5), (-1, -1), (3, 40, 1e-3)))
    if fisheye:
        flags = cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW
        known, seen = [board[None]] * len(corners), [c.reshape(1, -1, 2).astype(np.float64) for c in corners]
        rms, matrix, k, *_ = cv2.fisheye.calibrate(known, seen, SIZE, None, None, flags=flags)
    else:
        rms, matrix, k, *_ = cv2.calibrateCamera([board.astype(np.float32)] * len(corners), corners, SIZE, None, None)
    return rms, matrix, np.ravel(k), len(corners)


@pytest.mark.parametrize("lens", list(boards.LENSES))
def test_boards_against_truth_and_opencv(lens):
    truth, views = boards.render_set(lens, 10, 77, *SIZE)
    board = np.zeros((boards.COLUMNS * boards.ROWS, 3))
    board[:, :2] = np.mgrid[0 : boards.COLUMNS, 0 : boards.ROWS].T.reshape(-1, 2) * boards.SQUARE_MM
    known, seen = [], []
    for picture, at, _, _, _ in views:
        found = hzn.find_corners(picture, (boards.COLUMNS, boards.ROWS))
        assert found is not None
        cells, places = found
        assert cells.dtype == np.uint16 and len(cells) == boards.COLUMNS * boards.ROWS
        # The numbering may begin at the opposite corner.
        error = min(np.abs(places - other).max() for other in (at, at[::-1]))
        assert error < 0.2
        known.append(cells * boards.SQUARE_MM)
        seen.append(places)
    fisheye = truth["model"] == "kannala-brandt"
    ours = hzn.calibrate(known, seen, SIZE, model=truth["model"])
    assert ours.dropped == [None] * 10 and ours.held_out_rms_px < 1.5 * ours.rms_px
    values = dict(zip(ours.names, ours.values))
    sigmas = dict(zip(ours.names, np.sqrt(np.diag(ours.covariance))))
    for name, value in {"fx_px": truth["fx"], "fy_px": truth["fy"], "cx_px": truth["cx"], "cy_px": truth["cy"]}.items():
        assert abs(values[name] - value) < 4 * sigmas[name]
    rms, matrix, _, found = opencv(views, board, fisheye)
    assert found <= 10 and ours.rms_px < rms
    assert abs(values["fx_px"] - truth["fx"]) < abs(matrix[0, 0] - truth["fx"]) + sigmas["fx_px"]
    # OpenCV's own corners and order of points give the same lens with both programs.
    same = hzn.calibrate([board] * len(views), [at[:, None] for _, at, *_ in views], SIZE, model=truth["model"])
    assert math.isclose(same.values[0], truth["fx"], rel_tol=1e-6)


def test_a_calibration_is_a_camera():
    truth, views = boards.render_set("fisheye94", 1, 5, *SIZE)
    rng = np.random.default_rng(3)
    turns = [boards.rotation(rng.normal(0, 0.4, 3)) for _ in range(6)]
    plane = np.stack(np.meshgrid(np.arange(9.0), np.arange(6.0)), -1).reshape(-1, 2)
    seen = []
    for turn in turns:
        points = np.c_[plane - [4, 2.5], np.zeros(54)] @ turn.T + [0, 0, 9]
        x, y = boards.distort(truth["model"], truth["k"], *points.T)
        seen.append(np.stack([x * truth["fx"] + truth["cx"], y * truth["fy"] + truth["cy"]], -1))
    seen = [at + rng.normal(0, 0.05, at.shape) for at in seen]
    seen[2][7] += 30
    found = hzn.calibrate([plane] * 6, seen, SIZE)
    assert found.outliers[2] == [7] and found.outliers[0] == []
    assert found.residuals_px[2].shape == (54, 2) and found.residuals_px[2][7] @ [1, 1] > 50
    assert "fx" in repr(found) and found.camera.model == "kannala-brandt"
    parsed = tomllib.loads(found.to_toml())["camera"]
    assert parsed["covariance"]["order"] == found.names and parsed["fx_px"] == found.values[0]
    assert found.camera.parameters["covariance"]["order"] == found.names
    with pytest.raises(hzn.ConfigError, match="at least 3"):
        hzn.calibrate([plane] * 2, seen[:2], SIZE)
    with pytest.raises(hzn.ConfigError, match="object_points has 6 views, but image_points has 5"):
        hzn.calibrate([plane] * 6, seen[:5], SIZE)
    with pytest.raises(hzn.ConfigError, match="view 0: 54 known points, but 53 image points"):
        hzn.calibrate([plane] * 6, [seen[0][:-1], *seen[1:]], SIZE)
    with pytest.raises(hzn.ConfigError, match="a flat target is expected"):
        hzn.calibrate([np.c_[plane, plane[:, 0]]] * 6, seen, SIZE)
    with pytest.raises(hzn.ConfigError, match="is not a lens model"):
        hzn.calibrate([plane] * 6, seen, SIZE, model="fisheye")
    mirrored = [at * [-1, 1] + [639, 0] for at in seen]
    with pytest.raises(hzn.ConfigError, match="mirror"):
        hzn.calibrate([plane] * 6, mirrored, SIZE)


def test_directions():
    camera = hzn.Camera(width=384, height=288, model="equidistant", fx_px=92, fy_px=92, cx_px=190, cy_px=145,
                        theta_max_deg=90)
    at = np.stack(np.meshgrid(np.arange(10.0, 380, 30), np.arange(10.0, 280, 30)), -1).reshape(-1, 2)
    rays = camera.unproject(at)
    inside = ~np.isnan(rays[:, 0])
    rays = rays[inside] @ boards.rotation(np.array([0.3, -1.0, 2.0])).T
    rng = np.random.default_rng(8)
    found = hzn.calibrate_points([rays], [at[inside] + rng.normal(0, 0.02, (inside.sum(), 2))], (384, 288),
                                 model="equidistant")
    assert np.allclose(found.values, [92, 92, 190, 145], atol=0.05)
    with pytest.raises(hzn.ConfigError, match="azimuth counts to the other side"):
        hzn.calibrate_points([rays * [-1, 1, 1]], [at[inside]], (384, 288), model="equidistant")


def test_no_board():
    assert hzn.find_corners(np.zeros((100, 120), np.uint8), (9, 6)) is None
    with pytest.raises(hzn.ImageError):
        hzn.find_corners(np.zeros((100, 120)), (9, 6))
