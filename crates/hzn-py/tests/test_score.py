"""The scorer of the public photographs, on results of `hzn run` and on a table of another program."""

import re
import subprocess
import sys
from pathlib import Path

PICTURES = Path(__file__).parents[3] / "tests/data/real"
FIRST, SECOND = (f"jupiter-cassini-n{number}.png" for number in (1351122421, 1352037683))


def score(results):
    command = [sys.executable, PICTURES / "score.py", results]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_the_program_is_within_its_sigmas(tmp_path, hzn_program):
    results = tmp_path / "jupiter.csv"
    subprocess.run([hzn_program, "run", PICTURES / "jupiter", "-o", results], check=True, capture_output=True)
    text = score(results)
    ranges = re.findall(r"error ([+-][\d.]+) %, ([+-][\d.]+) sigma", text)
    directions = re.findall(r"direction ([\d.]+) deg off .*, ([\d.]+) sigma", text)
    assert len(ranges) == len(directions) == 2, text
    assert all(abs(float(percent)) < 0.25 and abs(float(sigma)) < 3 for percent, sigma in ranges), text
    assert all(float(deg) < 0.06 and float(sigma) < 3 for deg, sigma in directions), text


def test_a_plain_table_is_scored(tmp_path):
    results = tmp_path / "other.csv"
    results.write_text(
        "file,position_x_km,position_y_km,position_z_km,axis_x,axis_y,axis_z\n"
        f"{FIRST},0,0,63334957.4,,,\n"
        f"some/folder/jupiter/{SECOND},,,,0,0.0174524064,0.9998476952\n"
    )
    text = score(results)
    assert f"jupiter/{FIRST}: range 63334957 km, error +1.000 %\n" in text
    assert f"jupiter/{FIRST}: direction 0.0066 deg off (truth known to 0.02 deg)\n" in text
    assert f"jupiter/{SECOND}: no position\n" in text
    assert f"jupiter/{SECOND}: direction 1.0053 deg off" in text
    assert "iss030e102170-night.jpg: not among the results" in text
