"""Telecommands for the checks of other ground systems, and packets as `hzn` writes them."""

import math
import subprocess
from pathlib import Path

MARKER = bytes.fromhex("1acffc1d")
TIME_OF_TEST = "2026-11-24T12:00:00Z"
# The words of `hzn telecommand`, and the same values as arguments of the dictionary, in their order. 2174212837 is the
# time of the test in seconds since 1958, TAI.
COMMANDS = {
    "mode flight": ["flight"],
    "set body.altitude_km 231.5": ["body.altitude_km", 231.5],
    "read gates.max_attitude_sigma": ["gates.max_attitude_sigma"],
    "process-once": [],
    "dump-edges": [],
    "reset-counters": [],
    "known 231 6608 -20 3.5 0.1 -0.2 0.3": [231e3, 6608e3, -20e3, 3500.0, 0.1, -0.2, 0.3],
    "try threshold.level 90": ["threshold.level", 90.0],
    "ping": [],
    "report": [],
    "arm": [],
    "navigate 5 60 NaN 6608 0 0 0 7300 -1": [5_000_000, 60.0, None, 6608e3, 0.0, 0.0, 0.0, 7300.0, -1.0, None, None, None],
    f"time {TIME_OF_TEST} pulse": [2174212837, 0, "last pulse"],
    "attitude 5 60 0.6 0 0.8 0 3 0 0 1": [5_000_000, 60.0, 0.6, 0.0, 0.8, 0.0, math.radians(3), 0.0, 0.0, 1.0],
}
# These two are made by `load`, which sends more than one packet.
MADE_BY_LOAD = {"stage", "commit"}


def is_same(decoded: float, written: float | None) -> bool:
    """Return whether a number is the one that was written; None stands for NaN and infinity."""
    return not math.isfinite(decoded) if written is None else float(decoded) == written


def without_markers(stream: bytes) -> tuple[bytes, list[int]]:
    """Return the packets one after another, and their APIDs."""
    packets, apids, at = bytearray(), [], 0
    while at < len(stream):
        assert stream[at : at + 4] == MARKER, at
        end = at + 4 + 6 + int.from_bytes(stream[at + 8 : at + 10], "big") + 1
        packets += stream[at + 4 : end]
        apids.append(int.from_bytes(stream[at + 4 : at + 6], "big") & 0x7FF)
        at = end
    return bytes(packets), apids


def bytes_of_hzn(hzn: str, words: str, file: Path) -> bytes:
    """Return the packet that `hzn telecommand` writes, with its checksum and without the sync marker."""
    subprocess.run([hzn, "telecommand", words, "-o", file, "--force"], check=True, capture_output=True)
    sent = file.read_bytes()
    assert sent[:4] == MARKER, words
    return sent[4:]
