"""Checks files of the repository, and wrong ones, with the JSON schemas that `hzn schema` prints.

usage: check_schemas.py HZN FOLDER

The script makes FOLDER. Two programs that share no code with hzn judge: jsonschema, and taplo, which is what editors of
TOML use. Both must accept each scene and each sensor that hzn accepts, and each frames.csv. Both must refuse what hzn
refuses for one key. Exits with 1 at the first difference.
"""

import csv
import datetime
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema

ROOT = Path(__file__).parents[2]
# Changes of the scene `rocket-clean` and of the sensor of the demo, each wrong in one key.
WRONG_SCENES = [
    ("frames = ", "frame = "),  # no such key
    ("frames = 200", 'frames = "120"'),  # another type
    ("frames = 200", "frames = 0"),  # below the limit
    ("[trajectory.rocket]", "[trajectory.rockets]"),  # no such trajectory
    ("[camera]", '[camera]\nmodel = "fish"\n[unknown]'),  # no such section
    ("[capture]", "[capture]\njpeg_quality = 101"),  # above the limit
]
WRONG_SENSORS = [
    ("model = ", "modell = "),
    ("width = ", 'kind = "earth"\nwidth = '),
    ("[camera]", "[gates]\nmax_rms_px = -1.0\n[camera]"),
    ("[camera]", '[consensus]\nmethod = "best"\n[camera]'),
]


def need(condition, message):
    if not condition:
        raise SystemExit(f"check_schemas: {message}")


def plain(value):
    """Returns a value of TOML as one of JSON: a date is a text."""
    if isinstance(value, dict):
        return {key: plain(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [plain(inner) for inner in value]
    return value.isoformat() if isinstance(value, datetime.datetime | datetime.date | datetime.time) else value


class Judge:
    def __init__(self, hzn, folder, name):
        text = subprocess.run([hzn, "schema", name], check=True, capture_output=True, text=True).stdout
        self.path = folder / f"{name.split('.')[0]}.schema.json"
        self.path.write_text(text)
        book = ROOT / "book/reference" / self.path.name
        need(json.loads(text) == json.loads(book.read_text()), f"{book} is not what `hzn schema {name}` prints")
        schema = json.loads(text)
        jsonschema.Draft202012Validator.check_schema(schema)
        self.validator = jsonschema.Draft202012Validator(schema)
        self.folder = folder

    def by_library(self, text):
        try:
            return next((error.message[:200] for error in self.validator.iter_errors(plain(tomllib.loads(text)))), None)
        except tomllib.TOMLDecodeError as error:
            return str(error)

    def by_editor(self, text):
        path = self.folder / "judged.toml"
        path.write_text(f"#:schema ./{self.path.name}\n{text}")
        ran = subprocess.run([TAPLO, "lint", "--no-auto-config", path], capture_output=True, text=True)
        return None if ran.returncode == 0 else ran.stderr[-400:]

    def accepts(self, what, text):
        need(self.by_library(text) is None, f"{what}: jsonschema refuses it: {self.by_library(text)}")
        need(self.by_editor(text) is None, f"{what}: taplo refuses it: {self.by_editor(text)}")

    def refuses(self, what, text):
        need(self.by_library(text) is not None, f"{what}: jsonschema accepts it")
        need(self.by_editor(text) is not None, f"{what}: taplo accepts it")


def changed(text, change):
    old, new = change
    need(old in text, f"{old!r} is not in the file that is changed")
    return text.replace(old, new, 1)


def check_scenes(hzn, folder):
    judge = Judge(hzn, folder, "scene.toml")
    output = lambda *args: subprocess.run([hzn, *args], check=True, capture_output=True, text=True).stdout
    names = [line.split()[0] for line in output("simulate", "--list").splitlines() if line.strip()]
    need(len(names) == 16, f"scenes: {names}")
    for name in names:
        judge.accepts(name, output("simulate", name, "--show"))
    clean = output("simulate", "rocket-clean", "--show")
    for change in WRONG_SCENES:
        text = changed(clean, change)
        wrong = folder / "wrong.toml"
        wrong.write_text(text)
        ran = subprocess.run([hzn, "simulate", wrong, "-o", folder / "never"], capture_output=True)
        need(ran.returncode == 2, f"hzn does not refuse {change}")
        judge.refuses(str(change), text)
    # The scene with every value written out, as hzn writes it next to the pictures.
    subprocess.run([hzn, "simulate", "thermal-array", "-o", folder / "array", "--frames", "1", "-q"], check=True)
    judge.accepts("scene.toml of hzn simulate", (folder / "array/scene.toml").read_text())
    return folder / "array"


def check_sensors(hzn, folder, simulated):
    judge = Judge(hzn, folder, "sensor.toml")
    found = [*ROOT.glob("tests/data/**/sensor.toml"), *ROOT.glob("crates/hzn-cli/assets/*.toml"), simulated / "sensor.toml"]
    need(len(found) >= 3, f"sensors: {found}")
    for path in found:
        judge.accepts(path, path.read_text())
    iss = (ROOT / "crates/hzn-cli/assets/iss.toml").read_text()
    for change in WRONG_SENSORS:
        text = changed(iss, change)
        (folder / "wrong.toml").write_text(text)
        ran = subprocess.run([hzn, "camera", "show", folder / "wrong.toml"], capture_output=True)
        need(ran.returncode == 2, f"hzn does not refuse {change}")
        judge.refuses(str(change), text)


def check_frames(hzn, folder, simulated):
    judge = Judge(hzn, folder, "frames.csv")

    def row(cells):
        number = lambda text: None if text == "" else float(text)
        return {key: cell or None if key in ("file", "utc") else number(cell) for key, cell in cells.items()}

    count = 0
    for path in [*ROOT.glob("tests/data/**/frames.csv"), simulated / "frames.csv"]:
        with path.open(newline="") as file:
            for cells in csv.DictReader(line for line in file if not line.startswith("#")):
                errors = [error.message for error in judge.validator.iter_errors(row(cells))]
                need(not errors, f"{path}: {errors}")
                count += 1
    need(count > 1, "no row of a frames.csv")
    right = {"file": "a.png", "altitude_km": 400.0, "q_enceladus_w": 1.0}
    need(judge.validator.is_valid(right), "a right row")
    for wrong in [{"file": None}, {"altitude": 1.0}, {"x_km": 1.0}, {"altitude_km": -2.0}, {"qw": 3.0}]:
        need(not judge.validator.is_valid({**right, **wrong}), f"frames.csv: {wrong} is accepted")


hzn, folder = sys.argv[1], Path(sys.argv[2])
TAPLO = str(Path(sys.executable).with_name("taplo"))
folder.mkdir(parents=True)
simulated = check_scenes(hzn, folder)
check_sensors(hzn, folder, simulated)
check_frames(hzn, folder, simulated)
print("check_schemas: the files agree with their schemas")
