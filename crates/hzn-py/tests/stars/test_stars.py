"""Stars and limb in one picture, with cedar-solve: attitude, focal length and limb are right within their sigmas."""

import sys
from pathlib import Path

import numpy as np
import pytest
from tetra3 import Tetra3

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import stars_and_limb


@pytest.fixture(scope="module")
def solver():
    return Tetra3()


@pytest.mark.timeout(900)
def test_stars_and_limb_agree_with_the_truth(solver, capsys):
    """Ten pictures whose numbers were not used when the example was written."""
    nees, limbs, sigmas, focal = [], [], [], []
    for seed in range(100, 110):
        image, position_km, rotation = stars_and_limb.simulate(seed, solver.star_table)
        found = stars_and_limb.solve(solver, image, position_km)
        assert found is not None and found["report"], seed
        four, limb_deg = stars_and_limb.misses(found, position_km, rotation)
        nees.append(four @ np.linalg.solve(found["covariance"], four))
        limbs.append(limb_deg / found["report"].sigma_max_deg)
        sigmas.append(np.sqrt(np.diag(found["covariance"])))
        focal.append(four[3])
    with capsys.disabled():
        *turn, length = np.mean(sigmas, axis=0)
        across, _, about = np.degrees(turn) * 3600
        rms = np.sqrt(np.mean(np.square(focal)))
        print(f"\n1 sigma: {across:.1f} arcsec across, {about:.1f} about the axis, focal length {length:.2f} px (RMS error {rms:.2f});")
        print(f"NEES (4 degrees of freedom) {np.mean(nees):.2f}; limb against stars at most {max(limbs):.2f} sigma")
    # 18.5 is the 99.9 % point of chi-square with four degrees of freedom; 6.8 that of the mean of ten.
    assert max(nees) < 18.5 and np.mean(nees) < 6.8, nees
    assert max(limbs) < 3, limbs
    # The data sheet is 50 px off.
    assert np.abs(focal).max() < 2, focal


def test_a_picture_without_stars_names_none(solver):
    position_km, rotation = stars_and_limb.pose(np.random.default_rng(7))
    image = stars_and_limb.add_stars(
        stars_and_limb.hzn.render(
            stars_and_limb.sensor(stars_and_limb.FOCAL_PX),
            position_km,
            stars_and_limb.quaternion(rotation),
            stars_and_limb.START_S,
            world=stars_and_limb.overexposed_world(),
        ),
        solver.star_table[:0],
        rotation.T,
        np.random.default_rng(7),
    )
    assert stars_and_limb.solve(solver, image, position_km) is None
