"""Writes telecommands with mixed damage, built with the spacepackets library, for the test `damage` of hzn-flight.

Usage: damaged_packets.py FILE COUNT SEED

Good telecommands (ping, report) count their sequence. Everything else carries the function `mode`, which no good one has,
or repeats a good one: a computer that acknowledges it as done has taken something that it must not take.

A record of FILE: kind (1 byte, index in KINDS; 0 is good), pause after it in ms (1), number of bytes (2, big-endian), bytes.
"""

import binascii
import random
import struct
import sys
from pathlib import Path

from spacepackets.ccsds.spacepacket import PacketType, SequenceFlags, SpacePacketHeader

SYNC = bytes.fromhex("1acffc1d")
COMMAND_APID = 0x1C0
SET_MODE, PING, REPORT = 1, 11, 12
KINDS = [
    "good",
    "one to three flipped bits",
    "burst of up to 16 bits",
    "lost bytes",
    "added bytes",
    "cut off",
    "wrong checksum",
    "wrong length",
    "type telemetry",
    "segment",
    "foreign APID",
    "other version",
    "replay",
    "inside a foreign packet",
    "inside a damaged packet",
    "noise",
    "several bytes replaced",
]


def packet(
    sequence: int,
    user: bytes,
    apid: int = COMMAND_APID,
    kind: PacketType = PacketType.TC,
    flags: SequenceFlags = SequenceFlags.UNSEGMENTED,
    version: int = 0,
) -> bytes:
    """Return a packet with marker, empty time field and checksum."""
    header = SpacePacketHeader(kind, apid, sequence, 8 + len(user) + 2 - 1, True, flags, version)
    body = bytes(header.pack()) + bytes(8) + user
    return SYNC + body + struct.pack(">H", binascii.crc_hqx(body, 0xFFFF))


class Line:
    """Makes what comes over the line."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.sequence = 0
        self.good: list[bytes] = []
        # The last telecommand that was damaged.
        self.whole = b"none"

    def noise(self, most: int) -> bytes:
        return self.random.randbytes(self.random.randint(1, most))

    def make_good(self) -> bytes:
        self.sequence = (self.sequence + 1) % 16384
        good = packet(self.sequence, bytes([self.random.choice([PING, PING, REPORT])]))
        self.good = [*self.good[-20:], good]
        return good

    def forbidden(self, **header: object) -> bytes:
        """Return an undamaged telecommand that would be new for the computer and must not be taken."""
        ahead = (self.sequence + self.random.randint(1, 50)) % 16384
        return packet(ahead, bytes([SET_MODE, 2]), **header)

    def flipped(self, whole: bytes, bits: list[int]) -> bytes:
        number = int.from_bytes(whole, "big")
        for bit in bits:
            number ^= 1 << bit
        return number.to_bytes(len(whole), "big")

    def around(self, inside: bytes, apid: int) -> bytes:
        return packet(self.random.randrange(16384), self.noise(60) + inside + self.noise(60), apid=apid)

    def foreign_apid(self) -> int:
        return self.random.choice([n for n in (0x055, 0x0FF, 0x100, 0x1C1, 0x1D0, 0x3C0, 0x7FF) if n != COMMAND_APID])

    def damage(self, kind: str, whole: bytes) -> bytes:
        draw = self.random
        bits = 8 * len(whole)
        match kind:
            case "one to three flipped bits":
                return self.flipped(whole, draw.sample(range(bits), draw.randint(1, 3)))
            case "burst of up to 16 bits":
                start = draw.randrange(bits - 16)
                return self.flipped(whole, [start, *[start + n for n in range(1, 16) if draw.random() < 0.5]])
            case "lost bytes":
                at = draw.randrange(len(whole))
                return whole[:at] + whole[at + draw.randint(1, 3) :]
            case "added bytes":
                at = draw.randrange(1, len(whole))
                return whole[:at] + self.noise(3) + whole[at:]
            case "cut off":
                return whole[: draw.randrange(1, len(whole))]
            case "wrong checksum":
                return self.flipped(whole, [n for n in range(16) if draw.random() < 0.5] or [3])
            case "wrong length":
                length = struct.pack(">H", draw.choice([draw.randrange(2000), draw.randrange(65536)]))
                return whole[:8] + length + whole[10:]
            case "type telemetry":
                return self.forbidden(kind=PacketType.TM, apid=draw.choice([COMMAND_APID, *range(0x100, 0x10B)]))
            case "segment":
                flags = [SequenceFlags.FIRST_SEGMENT, SequenceFlags.CONTINUATION_SEGMENT, SequenceFlags.LAST_SEGMENT]
                return self.forbidden(flags=draw.choice(flags))
            case "foreign APID":
                return self.forbidden(apid=self.foreign_apid())
            case "other version":
                return self.forbidden(version=draw.randint(1, 7))
            case "replay":
                return draw.choice(self.good) if self.good else self.noise(9)
            case "inside a foreign packet":
                return self.around(whole, self.foreign_apid())
            case "inside a damaged packet":
                outer = self.around(whole, draw.choice([COMMAND_APID, self.foreign_apid()]))
                return self.flipped(outer, draw.sample(range(8 * len(outer)), draw.randint(1, 3)))
            case "noise":
                return self.noise(80)
            case "several bytes replaced":
                return bytes(draw.randrange(256) if draw.random() < 0.3 else byte for byte in whole)
        raise ValueError(kind)

    def damaged(self, kind: str, before: bytes) -> bytes:
        """Return damage that the bytes around it do not mend by chance: noise can be the byte that was lost."""
        while True:
            whole, last = self.forbidden(), self.whole
            sent = self.damage(kind, whole)
            is_mended = whole in before[-3:] + sent + SYNC[:3] or (last not in before and last in before + sent)
            if kind in UNTOUCHED or kind == "inside a damaged packet" or not is_mended:
                self.whole = whole
                return sent


# Kinds whose packet is whole and must be refused for what it says.
UNTOUCHED = {"type telemetry", "segment", "foreign APID", "other version", "replay", "inside a foreign packet"}


def main() -> None:
    path, count, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    line = Line(seed)
    sent = b""
    with path.open("wb") as file:
        for _ in range(count):
            kind = 0 if line.random.random() < 0.2 else line.random.randrange(1, len(KINDS))
            sent = line.damaged(KINDS[kind], sent) if kind else line.make_good()
            # A sender pauses after a good telecommand. Only some of the damaged ones have a pause after them.
            pause = line.random.choice([100, 120, 150]) if kind == 0 else line.random.choice([0, 0, 0, 0, 3, 40, 110])
            file.write(struct.pack(">BBH", kind, pause, len(sent)) + sent)


main()
