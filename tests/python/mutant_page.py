"""Shows the figures of the campaign mutants.py, and writes them as the last section of a page."""

import collections
import math
import pathlib
import sys
import tomllib

# Reasons why a mutant behaves as the code does, or why no test of hzn should notice it.
EXPLAINED = pathlib.Path(__file__).with_name("mutants_explained.toml")
BEGIN = "## The sample"


def wilson(found, of):
    """Returns the 95 % interval of a share by Wilson."""
    if of == 0:
        return 0.0, 1.0
    z, share = 1.959964, found / of
    middle = share + z * z / (2 * of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return (middle - half) / (1 + z * z / of), (middle + half) / (1 + z * z / of)


def explained():
    """Returns the reasons by the key of their mutant."""
    return {one["mutant"]: one["reason"] for one in tomllib.loads(EXPLAINED.read_text())["explained"]}


def count(mutants):
    """Returns how many were caught, ended by the limit of time, and survived."""
    outcomes = collections.Counter(one["outcome"] for one in mutants)
    return [outcomes[name] for name in ("caught", "timeout", "survived")]


def score(mutants):
    """Returns the share of noticed mutants in words."""
    caught, timeout, survived = count(mutants)
    found, of = caught + timeout, caught + timeout + survived
    low, high = wilson(found, of)
    return f"{found} of {of}: {100 * found / max(of, 1):.1f} % ({100 * low:.1f} to {100 * high:.1f} %)"


def stage(file):
    """Returns the folder below src, which is a stage or a part of the pipeline."""
    words = file.split("/src/")[1].split("/")
    return "/".join(words[:2]) if words[0] == "stages" else words[0]


def name(one):
    """Returns a mutant in words."""
    file = one["file"].split("/src/")[1]
    was = f"`{one['was']}` becomes `{one['replacement']}`" if one["was"] else f"the body becomes `{one['replacement']}`"
    if one["was"] and not one["replacement"]:
        was = f"`{one['was']}` is left out"
    return f"`{file}`, `{one['function']}`: {was}"


def text(state):
    """Returns the section of the page."""
    mutants, reasons = state["mutants"], explained()
    stages = collections.defaultdict(list)
    for one in mutants.values():
        stages[stage(one["file"])].append(one)
    rows = []
    for folder, own in sorted(stages.items()):
        caught, timeout, survived = count(own)
        rows.append(f"| `{folder}` | {len(own)} | {caught} | {timeout} | {survived} |")
    survivors = [(key, one) for key, one in sorted(mutants.items()) if one["outcome"] == "survived"]
    unclear = [one for key, one in survivors if key not in reasons]
    left_out = ", ".join(f"`{test}`" for test in state["left_out"]) or "none"
    lines = [
        f"Seed {state['seed']}, commit {state['commit']}, {state['all']} mutants in all files. The tests notice "
        f"**{score(mutants.values())}**. {len(state['refused'])} further mutants do not compile and do not count. "
        f"{len(survivors) - len(unclear)} of the survivors are explained below; without these, the tests notice "
        f"{score([one for key, one in mutants.items() if key not in reasons or one['outcome'] != 'survived'])}.",
        "", f"{state['tests']} tests took part. Left out, because they take too long or need what a copy of the "
        f"sources does not have: {left_out}.",
        "", "| part | mutants | caught | ended by the limit of time | survived |", "|---|---:|---:|---:|---:|", *rows,
        "", "| survivor | why |", "|---|---|",
        *(f"| {name(one)} | {reasons.get(key, 'not explained: ' + one['by'])} |" for key, one in survivors),
    ]
    ended = [f"| {name(one)} | `{one['by']}` |" for _, one in sorted(mutants.items()) if one["outcome"] == "timeout"]
    if ended:
        lines += ["", "| ended by the limit of time | in |", "|---|---|", *ended]
    return "\n".join(line.replace("||", "\\|\\|") if line.startswith("| `") and " becomes " in line else line
                     for line in lines)


def show(state):
    """Prints the figures."""
    print(score(state["mutants"].values()))
    for one in state["mutants"].values():
        if one["outcome"] == "survived":
            print(f"survived: {name(one)} (line {one['line']}; {one['by']})")


def write(page, state):
    """Puts the figures into the page."""
    before, heading, _ = page.read_text().partition(BEGIN + "\n")
    if not heading:
        sys.exit(f"{page}: has no line {BEGIN!r}; the figures come after it")
    page.write_text(f"{before}{BEGIN}\n\n{text(state)}\n")
    show(state)
