"""Changes the core's code in small ways, one at a time, and counts how many of the changes the tests notice.

    python tests/python/mutants.py --sample 200 --seed 1
    python tests/python/mutants.py --again
    python tests/python/mutants.py --page FILE

cargo-mutants lists the changes (mutants). A sample is drawn with the seed: from each file as many as its part of all
mutants, and at least one. Those that do not compile are replaced by the next of their file. mutant_switch.py weaves
them all into one build of the committed state. One run of each test says which functions it reaches; a mutant is then
tried with the tests that reach it, from the shortest on, until one fails. The limit of a test is processor time, so
that a busy machine makes no timeout.

The state is written after each mutant: the same call continues after a stop. `--again` draws nothing, and tries the
survivors again after a change of the tests. A test that takes longer than `--slowest` seconds is left out, so that a
survivor may be one that a long test would notice.
"""

import argparse
import collections
import concurrent.futures
import hashlib
import io
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tarfile
import tempfile

import mutant_page
import mutant_switch

ROOT = pathlib.Path(__file__).resolve().parents[2]
CORE = "crates/hzn-core"
# Optimisation that makes the sum of compilation and tests shortest, and tests of the core that are built.
BUILD = ["--locked", "--package", "hzn-core", "--all-features", "--config", "profile.dev.package.hzn-core.opt-level=1"]
TESTS = ["--lib", "--test", "core"]
# Processor time that a test may take: so many times what it takes without a mutant, and so many seconds.
LIMIT = 10, 20.0
# Tests below this many seconds run together in one process.
SHORT_S = 0.5


def run(command, **more):
    """Runs a command and returns its output. If it fails, the program ends with its message."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **more)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr[-4000:]}")
    return done.stdout


def list_mutants(under):
    """Returns the mutants of all files below the folders, each with a key that a moved line does not change."""
    globs = [word for folder in under for word in ("--file", f"{folder}/**/*.rs")]
    listed = json.loads(run(["cargo", "mutants", "--list", "--json", "--package", "hzn-core", *globs], cwd=ROOT))
    seen, kept, sources = collections.Counter(), [], {}
    for mutant in listed:
        name = mutant["file"]
        if name not in sources:
            source = (ROOT / name).read_text()
            sources[name] = source, mutant_switch.blank(source)
        begin, end = mutant_switch.offsets(sources[name][0], mutant["span"])
        # The compiler computes constants, also those of a signature, so that nothing can be chosen there.
        if not mutant["function"] or begin < mutant_switch.body(*sources[name], mutant)[1]:
            continue
        mutant["was"] = "" if mutant["genre"] == "FnValue" else " ".join(sources[name][0][begin:end].split())
        change = f"{mutant['function']['function_name']} | {mutant['was']} -> {mutant['replacement']}"
        seen[name, change] += 1
        mutant["key"] = f"{name} | {change} | {seen[name, change]}"
        mutant["name"] = f"{name}:{mutant['span']['start']['line']} {change}"
        kept.append(mutant)
    return kept


def draw(listed, count, seed):
    """Returns the mutants by file, each list in the order of the draw, and how many of each file are wanted."""
    files = collections.defaultdict(list)
    for mutant in listed:
        files[mutant["file"]].append(mutant)
    for own in files.values():
        own.sort(key=lambda mutant: hashlib.sha256(f"{seed} {mutant['key']}".encode()).digest())
    share = {name: count * len(own) / len(listed) for name, own in files.items()}
    wanted = {name: max(1, int(part)) for name, part in share.items()}
    for name in sorted(share, key=lambda name: share[name] % 1, reverse=True):
        if sum(wanted.values()) >= count:
            break
        wanted[name] += 1
    return files, wanted


class Tree:
    """A copy of the committed state, in which the mutants are."""

    def __init__(self, folder):
        self.path, self.build = folder / "tree", folder / "build"
        self.commit = run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT).strip()
        packed = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            self.files = {file.name: archive.extractfile(file).read() for file in archive if file.isfile()}
        self.files[f"{CORE}/src/lib.rs"] += b"\n#[doc(hidden)]\n#[allow(missing_docs)]\npub mod mutant;\n"

    def write(self, changed):
        """Writes the files, with changes. A file that is as it was keeps its time, so that it is not compiled again."""
        for name, content in (self.files | changed).items():
            path = self.path / name
            if not path.exists() or path.read_bytes() != content:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)

    def cargo(self, words):
        # A mutant that always panics does so only where it is chosen.
        environment = os.environ | {"CARGO_TARGET_DIR": str(self.build), "CARGO_INCREMENTAL": "1",
                                    "RUSTFLAGS": "-Aunconditional_panic -Aarithmetic_overflow"}
        done = subprocess.run(["cargo", *words, "--message-format=json"], cwd=self.path, env=environment,
                              capture_output=True, text=True, check=False)
        return done, [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]

    def weave(self, mutants):
        """Writes the sources with these mutants. Returns the arms and functions of each file."""
        woven, changed, first = {}, {}, 0
        files = collections.defaultdict(list)
        for mutant in mutants:
            files[mutant["file"]].append(mutant)
        for name, own in files.items():
            text, arms, reached = mutant_switch.weave(self.files[name].decode(), own, first)
            changed[name] = text.encode()
            woven[name] = arms, reached
            first += len(reached)
        module = mutant_switch.MODULE.replace("FUNCTIONS", str(max(first, 1)))
        self.write(changed | {f"{CORE}/src/mutant.rs": module.encode()})
        return woven

    def without_what_does_not_compile(self, mutants, known, keep):
        """Returns the mutants that compile. Why each of the others does not is known by key for some of them;
        `keep` is called when there are more."""
        refused = {mutant["id"]: known[mutant["key"]] for mutant in mutants if mutant["key"] in known}
        while True:
            left = [mutant for mutant in mutants if mutant["id"] not in refused]
            woven = self.weave(left)
            done, messages = self.cargo(["check", *BUILD])
            if done.returncode == 0:
                return left
            found = {}
            for message in messages:
                report = message.get("message", {})
                if message["reason"] == "compiler-message" and report["level"] == "error":
                    found |= blame(report, woven) or blame_constant(report, left)
            if not found:
                sys.exit(f"the mutants do not compile together:\n{done.stderr[-3000:]}")
            refused |= found
            known |= {mutant["key"]: refused[mutant["id"]] for mutant in left if mutant["id"] in found}
            keep()

    def tests(self):
        """Builds the tests and returns the program of each kind."""
        done, messages = self.cargo(["test", "--no-run", *BUILD, *TESTS])
        if done.returncode:
            sys.exit(done.stderr[-3000:])
        return [message["executable"] for message in messages
                if message["reason"] == "compiler-artifact" and message["profile"]["test"] and message["executable"]]


def blame(report, woven):
    """Returns the mutants that an error of the compiler is about. If it is about none of them, these are all of its
    function: such a function cannot have a choice in it, because it is constant or returns a type without a name."""
    for span in sorted(report["spans"], key=lambda span: not span["is_primary"]):
        arms, reached = woven.get(span["file_name"], ([], []))
        mutant = mutant_switch.arm_at(arms, span["byte_start"])
        if mutant:
            return {mutant: report["message"]}
        for _, own, (begin, end) in reached:
            if begin <= span["byte_start"] < end:
                return {mutant: f"no choice is possible: {report['message']}" for mutant in own}
    return {}


def blame_constant(report, mutants):
    """Returns the mutants of the function that an error names, because a constant needs its value."""
    named = re.match(r"cannot call non-const .*`(?:.*::)?(\w+)` in ", report["message"])
    return {mutant["id"]: f"no choice is possible: {report['message']}" for mutant in mutants
            if named and re.split(r"::", mutant["function"]["function_name"])[-1] == named[1]}


class Tests:
    """The test programs, the time of each test, and the functions that it reaches."""

    def __init__(self, tree, programs, folder, slowest_s):
        self.tree, self.folder, self.slowest_s = tree, folder, slowest_s
        self.found = []
        for program in programs:
            names = run([program, "--list", "--format", "terse"], cwd=tree.path / CORE).splitlines()
            self.found += [(program, name.removesuffix(": test")) for name in names if name.endswith(": test")]

    def call(self, program, names, mutant, limit_s):
        """Runs tests of a program until one fails. Returns the exit code, the processor time, the output, and the
        functions that were reached."""
        bound = f"ulimit -t {int(limit_s) + 1}; ulimit -v {8 << 20}; exec \"$@\""
        words = ["--exact", *names, "--test-threads", "1", "-Z", "unstable-options", "--fail-fast"]
        with tempfile.TemporaryDirectory() as own:
            reached = pathlib.Path(own) / "reached"
            reached.touch()
            environment = os.environ | {"HZN_MUTANT": str(mutant), "HZN_REACHED": str(reached), "RUSTC_BOOTSTRAP": "1"}
            with (pathlib.Path(own) / "output").open("w+", errors="replace") as output:
                child = subprocess.Popen(["bash", "-c", bound, "bash", program, *words], cwd=self.tree.path / CORE,
                                         env=environment, stdout=output, stderr=subprocess.STDOUT)
                _, status, used = os.wait4(child.pid, 0)
                child.returncode = os.waitstatus_to_exitcode(status)
                output.seek(0)
                return (child.returncode, used.ru_utime + used.ru_stime, output.read(),
                        sorted(map(int, reached.read_text().split())))

    def measure(self, pool):
        """Runs each test once. Those that fail, or take too long, are left out. The same programs are not run again."""
        kept = self.folder / "reach.json"
        have = json.loads(kept.read_text()) if kept.exists() else {}
        self.reached, self.time_s, self.left_out = {}, {}, []
        digests = {program: hashlib.sha256(pathlib.Path(program).read_bytes()).hexdigest() for program, _ in self.found}
        keys = {f"{digests[program]} {name}": (program, name) for program, name in self.found}
        running = {pool.submit(self.call, program, [name], "reach", self.slowest_s): key
                   for key, (program, name) in keys.items() if key not in have}
        for future in concurrent.futures.as_completed(running):
            code, used, _, reached = future.result()
            have[running[future]] = code, used, reached
            kept.write_text(json.dumps(have))
        for key, test in keys.items():
            code, used, reached = have[key]
            if code:
                self.left_out.append(test[1])
            else:
                self.time_s[test], self.reached[test] = used, set(reached)

    def try_mutant(self, mutant, function):
        """Returns what becomes of a mutant, and by which test."""
        able = sorted((test for test in self.time_s if function in self.reached[test]), key=self.time_s.get)
        if not able:
            return "survived", "no test reaches the function"
        short = [test for test in able if self.time_s[test] < SHORT_S]
        groups = [(program, [name for one, name in short if one == program]) for program in dict(short)]
        groups += [(program, [name]) for program, name in able if self.time_s[program, name] >= SHORT_S]
        for program, names in groups:
            limit_s = LIMIT[1] + LIMIT[0] * sum(self.time_s[program, name] for name in names)
            code, _, output, _ = self.call(program, names, mutant, limit_s)
            if code in (-signal.SIGXCPU, -signal.SIGKILL):
                return "timeout", names[0] if len(names) == 1 else "one of the short tests"
            if code:
                return "caught", failed(output, names)
        return "survived", f"{len(able)} tests pass"


def failed(output, names):
    """Returns the test that failed. A test that ends the whole program is the one that began last."""
    lines = [line.split() for line in output.splitlines() if line.startswith("test ")]
    return next((words[1] for words in lines if words[-1] == "FAILED"), lines[-1][1] if lines else names[0])


def choose(args, state, listed):
    """Returns the mutants to build: the survivors of the state, or more than are wanted, since some do not compile."""
    if args.again:
        old = {key for key, one in state["mutants"].items() if one["outcome"] == "survived"}
        # Code that is gone cannot be tested: its mutants leave the sample.
        for key in old - {mutant["key"] for mutant in listed}:
            print(f"gone      {key}", flush=True)
            del state["mutants"][key]
        return [mutant for mutant in listed if mutant["key"] in old], None
    files, wanted = draw(listed, args.sample, args.seed)
    return [mutant for name, own in files.items() for mutant in own[:2 + int(1.25 * wanted[name])]], wanted


def campaign(args, state):
    """Builds the mutants and tries those that have no outcome yet."""
    if run(["git", "status", "--porcelain", CORE], cwd=ROOT):
        sys.exit(f"{CORE}: has changes that are not committed; the campaign is about a commit")
    folder = args.folder
    listed = list_mutants(args.under)
    chosen, wanted = choose(args, state, listed)
    for number, mutant in enumerate(chosen, 1):
        mutant["id"] = number
    tree, known = Tree(folder), state.setdefault("refused", {})
    built = tree.without_what_does_not_compile(chosen, known, lambda: write(args.state, state))
    print(f"{len(listed)} mutants, {len(built)} of {len(chosen)} compile", flush=True)
    if wanted:
        taken = collections.Counter()
        kept = []
        for mutant in built:
            if taken[mutant["file"]] < wanted[mutant["file"]]:
                taken[mutant["file"]] += 1
                kept.append(mutant)
        built = kept
        state["all"] = len(listed)
    woven = tree.weave(built)
    functions = {number: function for _, reached in woven.values() for function, own, _ in reached for number in own}
    tests = Tests(tree, tree.tests(), folder, args.slowest)
    pool = concurrent.futures.ThreadPoolExecutor(args.jobs)
    tests.measure(pool)
    print(f"{len(tests.time_s)} tests; left out: {', '.join(tests.left_out) or 'none'}", flush=True)
    state |= {"commit": tree.commit, "tests": len(tests.time_s), "left_out": tests.left_out}
    left = [mutant for mutant in built if args.again or mutant["key"] not in state["mutants"]]
    running = {pool.submit(tests.try_mutant, mutant["id"], functions[mutant["id"]]): mutant for mutant in left}
    for future in concurrent.futures.as_completed(running):
        mutant, (outcome, by) = running[future], future.result()
        state["mutants"][mutant["key"]] = {"file": mutant["file"], "line": mutant["span"]["start"]["line"],
                                           "function": mutant["function"]["function_name"], "was": mutant["was"],
                                           "replacement": mutant["replacement"], "outcome": outcome, "by": by}
        write(args.state, state)
        print(f"{outcome:9} {mutant['name']}  [{by}]", flush=True)


def write(path, state):
    """Writes the state so that a stop leaves the old or the new one."""
    part = path.with_suffix(".part")
    part.write_text(json.dumps(state, indent=1))
    part.replace(path)


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--sample", type=int, default=200, help="mutants that are drawn (200)")
    words.add_argument("--seed", type=int, default=1, help="seed of the draw (1)")
    words.add_argument("--under", nargs="+", default=[f"{CORE}/src/stages", f"{CORE}/src/pipeline"],
                       help="folders of sources whose mutants are drawn")
    words.add_argument("--slowest", type=float, default=10.0, help="processor seconds of the longest test used (10)")
    words.add_argument("--jobs", type=int, default=os.cpu_count(), help="test programs at a time (one a core)")
    words.add_argument("--folder", type=pathlib.Path, default=ROOT / "target/mutants", help="sources, builds and state")
    words.add_argument("--again", action="store_true", help="try the survivors again")
    words.add_argument("--page", type=pathlib.Path, help="only write the section `The sample` of this page")
    args = words.parse_args()
    args.folder = args.folder.resolve()
    args.folder.mkdir(parents=True, exist_ok=True)
    args.state = args.folder / f"state-{args.seed}-{args.sample}.json"
    if not args.state.exists() and (args.again or args.page):
        sys.exit(f"{args.state}: is not there; first run the campaign without --again and --page")
    state = json.loads(args.state.read_text()) if args.state.exists() else {"seed": args.seed, "mutants": {}}
    if args.page:
        mutant_page.write(args.page, state)
        return
    campaign(args, state)
    mutant_page.show(state)


if __name__ == "__main__":
    main()
