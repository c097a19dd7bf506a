"""Measures which lines and branches of each crate the tests run, and writes the table into a page.

    python tests/python/line_coverage.py --page book/results/assurance.md

The workspace is built with counters of LLVM in a folder of its own, and `cargo test` runs on it. The packages of others
have no counters. A nightly toolchain counts branches, too; without one the column is empty. Files of tests do not
count, nor do modules named `tests`: a test always runs its own lines. What runs only on the flight computer, in Python
or in the browser is not seen here.
"""

import argparse
import collections
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- coverage: begin -->", "<!-- coverage: end -->"
# Its tests are in Python, whose runs are not counted.
ELSEWHERE = "hzn-py"
# Files that are tests themselves.
TESTS = re.compile(r"/(tests|examples|benches|target)/|/tests\.rs$|/proptest|build\.rs$")


def run(command, **more):
    """Runs a command and returns its output. If it fails, the program ends with its message."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **more)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr[-4000:]}")
    return done.stdout


def toolchain():
    """Returns the first toolchain that has LLVM's tools, the folder of the tools, and whether it counts branches."""
    for name in ("nightly", "stable"):
        found = subprocess.run(["rustup", "run", name, "rustc", "--print", "target-libdir"], capture_output=True,
                               text=True, check=False)
        tools = pathlib.Path(found.stdout.strip()).parent / "bin"
        if found.returncode == 0 and (tools / "llvm-cov").exists():
            return name, tools, name == "nightly"
    sys.exit("needs LLVM's tools: rustup component add llvm-tools (or: rustup component add --toolchain nightly "
             "llvm-tools, which counts branches, too)")


def measure(args):
    """Builds and runs the tests. Returns the program files and the counts."""
    name, tools, branches = toolchain()
    flags = "-Cinstrument-coverage" + (" -Zcoverage-options=branch" if branches else "")
    wrapper = args.folder / "rustc_with_counters"
    wrapper.write_text(f'#!/bin/sh\nexec "$@" {flags}\n')
    wrapper.chmod(0o755)
    profiles = args.folder / "profiles"
    shutil.rmtree(profiles, ignore_errors=True)
    environment = os.environ | {"CARGO_TARGET_DIR": str(args.folder), "RUSTC_WORKSPACE_WRAPPER": str(wrapper),
                                "CARGO_INCREMENTAL": "0",
                                # A few files for each program, in which its runs are added up.
                                "LLVM_PROFILE_FILE": str(profiles / "%4m.profraw")}
    cargo = ["rustup", "run", name, "cargo", "test", "--locked", "--lib", "--bins", "--tests"]
    built = run([*cargo, "--no-run", "--message-format=json"], cwd=ROOT, env=environment)
    messages = [json.loads(line) for line in built.splitlines() if line.startswith("{")]
    programs = sorted({one["executable"] for one in messages if one.get("executable")})
    shutil.rmtree(profiles, ignore_errors=True)  # programs that ran while others were built
    done = subprocess.run([*cargo, "--no-fail-fast"], cwd=ROOT, env=environment, capture_output=True, text=True,
                          check=False)
    failed = re.findall(r"^test (\S+) \.\.\. FAILED", done.stdout, re.MULTILINE)
    passed = len(re.findall(r"^test .* \.\.\. ok$", done.stdout, re.MULTILINE))
    raw = args.folder / "profiles.txt"
    raw.write_text("\n".join(str(path) for path in profiles.glob("*.profraw")))
    merged = args.folder / "merged.profdata"
    # A test that kills a run leaves a profile that is cut; the others count.
    run([tools / "llvm-profdata", "merge", "--sparse", "--failure-mode=all", "-f", raw, "-o", merged])
    objects = [word for program in programs for word in ("--object", program)]
    counts = run([tools / "llvm-cov", "export", "--summary-only", "--instr-profile", merged, *objects])
    return {"toolchain": run(["rustup", "run", name, "rustc", "--version"]).split()[1], "branches": branches,
            "commit": run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT).strip(), "passed": passed,
            "failed": failed, "files": json.loads(counts)["data"][0]["files"]}


def by_crate(files):
    """Returns the sums of lines and branches by crate."""
    crates = collections.defaultdict(lambda: collections.defaultdict(lambda: [0, 0]))
    for file in files:
        path = pathlib.Path(file["filename"])
        if not path.is_relative_to(ROOT) or TESTS.search(f"/{path.relative_to(ROOT)}"):
            continue
        words = path.relative_to(ROOT).parts
        if words[0] in ("crates", "firmware") and "src" in words and words[1] != ELSEWHERE:
            for kind in ("lines", "branches"):
                summary = file["summary"].get(kind, {"covered": 0, "count": 0})
                crates[words[1]][kind][0] += summary["covered"]
                crates[words[1]][kind][1] += summary["count"]
    return crates


def share(covered, count):
    """Returns a share in percent."""
    return f"{100 * covered / count:.1f} %" if count else "–"


def text(state):
    """Returns the table of the page."""
    crates = by_crate(state["files"])
    total = {kind: [sum(one[kind][i] for one in crates.values()) for i in (0, 1)] for kind in ("lines", "branches")}
    rows = [f"| `{crate}` | {own['lines'][1]} | {share(*own['lines'])} | {share(*own['branches'])} |"
            for crate, own in sorted(crates.items())]
    failed = ""
    if state["failed"]:
        failed = f" With the counters these tests fail: {', '.join(f'`{name}`' for name in state['failed'])}."
    return "\n".join([
        f"Commit {state['commit']}, rustc {state['toolchain']}, {state['passed']} tests.{failed}", "",
        "| crate | lines | run by a test | branches run by a test |", "|---|---:|---:|---:|", *rows,
        f"| all | {total['lines'][1]} | {share(*total['lines'])} | {share(*total['branches'])} |"])


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--folder", type=pathlib.Path, default=ROOT / "target/coverage", help="builds and counts")
    words.add_argument("--page", type=pathlib.Path, help="write the table between the two marks of this page")
    words.add_argument("--again", action="store_true", help="take the counts of the last run")
    args = words.parse_args()
    args.folder = args.folder.resolve()
    args.folder.mkdir(parents=True, exist_ok=True)
    kept = args.folder / "counts.json"
    if not args.again:
        kept.write_text(json.dumps(measure(args)))
    elif not kept.exists():
        sys.exit(f"{kept}: is not there; first run without --again")
    state = json.loads(kept.read_text())
    table = text(state)
    print(table)
    for name in state["failed"]:
        print(f"failed: {name}")
    if args.page:
        page = args.page.read_text()
        if page.count(BEGIN) != 1 or page.count(END) != 1:
            sys.exit(f"{args.page}: needs the lines {BEGIN} and {END}; the table comes between them")
        head, rest = page.split(BEGIN)
        args.page.write_text(f"{head}{BEGIN}\n\n{table}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
