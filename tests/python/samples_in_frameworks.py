"""Builds a sample against a mission of the cFS or a project of F´ that is on this machine, and runs it there.

The framework must be built with the sample in it, as book/guide/porting.md says. The sample is compiled again, with the
flags of that build and from the sources of this repository. All that is made goes into another folder.

Usage: samples_in_frameworks.py cfs|fprime FRAMEWORK LIBHZN FOLDER
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

C = Path(__file__).resolve().parents[2] / "firmware/hzn-c"
GUIDE = "build it with the sample as in book/guide/porting.md, section From C"
# A run takes two seconds.
LIMIT_S = 60


def run(command: list, folder: Path, hint: str = "", **variables: str) -> str:
    """Run a command, and return what it prints. If the command fails, end with this and the hint."""
    environment = {**os.environ, **variables}
    try:
        done = subprocess.run(command, cwd=folder, env=environment, timeout=LIMIT_S, text=True, errors="replace",
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    except subprocess.TimeoutExpired as late:
        sys.exit(f"{(late.stdout or b'').decode(errors='replace')}\n{command[0]} did not end in {LIMIT_S} s")
    if done.returncode != 0:
        sys.exit(f"{shlex.join(map(str, command))}\n{done.stdout}\nended with {done.returncode}{hint}")
    return done.stdout


def only(folder: Path, pattern: str) -> Path:
    """Return the newest file of this pattern."""
    found = sorted(folder.glob(pattern), key=lambda path: path.stat().st_mtime)
    if not found:
        sys.exit(f"{folder} has no {pattern}: {GUIDE}")
    return found[-1]


def try_cfs(mission: Path, library: Path, out: Path) -> None:
    """Start the core with the application and one that sends it messages, and with no other."""
    sample = C / "samples/cfs"
    # Of every build of the mission, the folder of the application is six levels below.
    flags_file = only(mission, "build*/*/*/apps/hzn_app/CMakeFiles/hzn_app.dir/flags.make")
    build = flags_file.parents[6]
    core = only(build, "exe/*/core-*")
    table_tool = only(build, "exe/host/elf2cfetbl")
    flags = [f"-I{folder}" for folder in (sample, C / "include", C / "example")]
    for line in flags_file.read_text().splitlines():
        if line.startswith("C_"):
            flags += shlex.split(line.split("=", 1)[1])
    (out / "cf").mkdir(parents=True)
    for name in ("hzn_app.c", "check/hzn_check.c"):
        shared = ["-shared", "-o", out / "cf" / Path(name).with_suffix(".so").name, library, "-lm"]
        run(["cc", *flags, sample / name, *shared], out)
    run(["cc", *flags, "-c", sample / "hzn_app_tbl.c", "-o", out / "hzn_app_tbl.o"], out)
    run([table_tool, out / "hzn_app_tbl.o"], out / "cf")
    shutil.copy(core, out / core.name)
    line = (sample / "cfe_es_startup_line.scr").read_text()
    check = "CFE_APP, hzn_check, HZN_CHECK_Main, HZN_CHECK, 70, 65536, 0x0, 0;\n!\n"
    (out / "cf/cfe_es_startup.scr").write_text(line + check)
    # Only for other users the cFS makes queues shorter.
    hint = "; if a queue was not made, run as another user than root, or raise fs.mqueue.msg_max"
    printed = run([f"./{core.name}"], out, hint)
    print("\n".join(row for row in printed.splitlines() if re.search("HZN|Versions", row)))
    if "HZN_CHECK: passed" not in printed:
        sys.exit(f"{printed}\nthe check did not pass{hint}")


def try_fprime(project: Path, library: Path, out: Path) -> None:
    """Link the unit test of the component again, and run it."""
    sample = C / "samples/fprime"
    build = project / "build-fprime-automatic-native-ut"
    program = only(build, "bin/*/Components_HznSensor_ut_exe")
    model = Path("Components/HznSensor/HznSensor.fpp")
    if (sample / model).read_text() != (project / model).read_text():
        sys.exit(f"{project / model} is not that of the sample: copy it again, and {GUIDE}")
    if shutil.which("ninja") is None:
        sys.exit("needs ninja, with which F´ is built, in PATH")
    out.mkdir(parents=True)
    objects = {}
    for entry in json.loads(run(["ninja", "-t", "compdb"], build)):
        source, made = Path(entry["file"]), entry.get("output", "")
        is_test = "HznSensor_ut_exe" in made
        if source.name in ("HznSensorTester.cpp", "HznSensorTesterHelpers.cpp") and is_test or (
            source.name == "HznSensor.cpp" and made.endswith(".cpp.o")
        ):
            ours = next((sample / "Components").rglob(source.name), source)
            includes = [f"-I{sample}", f"-I{sample / 'Components/HznSensor/test/ut'}", f"-I{C / 'include'}"]
            command = re.sub(r" -M[DTF]( \S+\.o(\.d)?)?(?= )", "", entry["command"])
            command = shlex.split(command.replace(f"-o {made}", f"-o {out / source.stem}.o"))
            command = [*command[:-1], ours] if command[-1] == entry["file"] else command
            run([command[0], *includes, *command[1:]], build)
            objects[made] = out / f"{source.stem}.o"
    link = run(["ninja", "-t", "commands", str(program.relative_to(build))], build).splitlines()[-1]
    words = shlex.split(re.search(r"&& (.*) &&", link)[1])
    words = [str(objects.pop(word, word)) for word in words]
    # What is left is the component, whose object replaces that in its archive.
    words[1:1] = [str(made) for made in objects.values()]
    words[words.index("-o") + 1] = str(out / program.name)
    words = [str(library) if Path(word).name == "libhzn.a" else word for word in words]
    run(words, build)
    # The counters of coverage would go into the project.
    printed = run([out / program.name], out, GCOV_PREFIX=str(out / "coverage"))
    print(printed)
    if not re.search(r"PASSED +\] [1-9]", printed):
        sys.exit("no test passed")


def main() -> None:
    """Try one framework."""
    kind, framework, library, out = sys.argv[1], *map(Path, sys.argv[2:])
    framework, library, out = framework.resolve(), library.resolve(), out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    {"cfs": try_cfs, "fprime": try_fprime}[kind](framework, library, out)


main()
