"""Weaves many mutants into one build, so that an environment variable chooses one of them while the tests run.

cargo-mutants names the mutants: a place in a file, and the text that replaces what is there. It would compile the crate
again for each of them. Here, the body of a function with mutants becomes

    match crate::mutant::active(FUNCTION) { 7u32 => { BODY OF MUTANT 7 } _ => { BODY } }

so that one build has all of them. `FUNCTION` is a number that tells which tests reach the function.
"""

import bisect
import functools
import re

# The module that the crate gets. `HZN_MUTANT` is the number of a mutant, or `reach`: then the file `HZN_REACHED` gets
# the number of each function that is called.
MODULE = """//! Chooses a mutant.
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

const UNKNOWN: u32 = u32::MAX;
const REACH: u32 = u32::MAX - 1;
static CHOSEN: AtomicU32 = AtomicU32::new(UNKNOWN);
static REACHED: [AtomicBool; FUNCTIONS] = [const { AtomicBool::new(false) }; FUNCTIONS];

/// Returns the number of the chosen mutant.
#[inline(always)]
pub fn active(function: usize) -> u32 {
    let chosen = CHOSEN.load(Relaxed);
    if chosen < REACH { chosen } else { look(function) }
}

#[cold]
fn look(function: usize) -> u32 {
    let word = std::env::var("HZN_MUTANT").unwrap_or_default();
    if word != "reach" {
        let chosen = word.parse().unwrap_or(0);
        CHOSEN.store(chosen, Relaxed);
        return chosen;
    }
    CHOSEN.store(REACH, Relaxed);
    if !REACHED[function].swap(true, Relaxed) {
        let file = std::env::var("HZN_REACHED").unwrap();
        let mut file = std::fs::OpenOptions::new().append(true).create(true).open(file).unwrap();
        file.write_all(std::format!("{function}\\n").as_bytes()).unwrap();
    }
    0
}
"""
LITERAL = re.compile(r"""//[^\n]*|/\*.*?\*/|b?r(#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?'(?:\\[^\n]*?|[^\\'\n])'""", re.DOTALL)


def blank(source):
    """Returns the source with spaces in place of comments and literals, so that each brace is one of the code."""
    return LITERAL.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), source)


@functools.lru_cache(maxsize=4)
def line_starts(source):
    """Returns where each line of the source begins."""
    return [0] + [found.end() for found in re.finditer("\n", source)]


def offsets(source, span):
    """Returns where a span of cargo-mutants begins and ends in the source. It counts lines and columns from 1."""
    starts = line_starts(source)
    return tuple(starts[span[end]["line"] - 1] + span[end]["column"] - 1 for end in ("start", "end"))


def body(source, blanked, mutant):
    """Returns where the signature and the body of the mutant's function begin, and where the body ends."""
    name = re.split(r"::|\s", mutant["function"]["function_name"])[-1]
    return body_between(source, blanked, name, *offsets(source, mutant["function"]["span"]))


@functools.lru_cache(maxsize=64)
def body_between(source, blanked, name, begin, end):
    """Returns the same for the function of this name that is at this place."""
    signature = re.compile(rf"\bfn\s+{re.escape(name)}\b").search(blanked, begin, end).start()
    depth = 0
    for at in range(signature, end):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(blanked[at], 0)
        if blanked[at] == "{" and depth == 0:
            break
    opened, braces = at, 0
    for at in range(opened, len(blanked)):
        braces += {"{": 1, "}": -1}.get(blanked[at], 0)
        if braces == 0:
            return signature, opened + 1, at
    raise ValueError(f"the function {name} has no end")


def functions(source, mutants):
    """Returns the outermost functions that have mutants: where each begins, its body's range, and its mutants."""
    blanked = blank(source)
    found = []
    for mutant in mutants:
        signature, begin, end = body(source, blanked, mutant)
        found.append([signature, begin, end, [mutant]])
    found.sort(key=lambda one: (one[1], -one[2]))
    outer = []
    for one in found:
        if outer and one[2] <= outer[-1][2]:
            outer[-1][3] += one[3]
        else:
            outer.append(one)
    return outer


def weave(source, mutants, first_function):
    """Returns the source with all mutants, the byte ranges of their arms by number, and the mutants of each function.

    Each mutant has a number `id`. A constant function becomes an ordinary one, because only that can look at a
    variable.
    """
    text, arms, reached = [], [], []
    done, size = 0, 0

    def add(piece):
        nonlocal size
        text.append(piece)
        size += len(piece.encode())

    for at, (signature, begin, end, own) in enumerate(functions(source, mutants)):
        head = source[done:begin]
        before = source[done:signature]
        plain = re.sub(r"\bconst\s+$", "", before)
        add(plain + head[len(before):])
        function = first_function + at
        add(f" match crate::mutant::active({function}) {{")
        whole = size
        for mutant in own:
            start, stop = offsets(source, mutant["span"])
            changed = source[begin:start] + mutant["replacement"] + source[stop:end]
            opened = size
            add(f" {mutant['id']}u32 => {{{changed}\n}}")
            arms.append((opened, size, mutant["id"]))
        add(f" _ => {{{source[begin:end]}\n}} }} ")
        reached.append((function, [mutant["id"] for mutant in own], (whole, size)))
        done = end
    add(source[done:])
    return "".join(text), arms, reached


def arm_at(arms, byte):
    """Returns the mutant whose arm has this byte, or None."""
    place = bisect.bisect_right([arm[0] for arm in arms], byte) - 1
    return arms[place][2] if place >= 0 and byte < arms[place][1] else None
