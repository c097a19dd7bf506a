"""Decodes telemetry with other libraries: space-packet-parser reads the XTCE dictionary, ccsdspy tables written here.

The dictionary is checked against the schema of XTCE. Its telecommands are encoded here, from the dictionary alone, and
compared with those of `hzn telecommand`.

Usage: check_telemetry.py HZN EXAMPLE FOLDER. EXAMPLE writes packets with random contents and their numbers.
"""

import json
import math
import struct
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import ccsdspy
import numpy as np
import space_packet_parser as spp
from space_packet_parser.xtce.validation import validate_xtce
from spacepackets.ccsds.spacepacket import PacketType, SpacePacketHeader
from telecommands import COMMANDS, MADE_BY_LOAD, bytes_of_hzn, is_same, without_markers


def check_xtce(dictionary: Path, packets: Path, lines: list[dict]) -> int:
    """Compare every number of every packet; return how many there are."""
    definition = spp.load_xtce(dictionary)
    numbers = 0
    with packets.open("rb") as stream:
        for line, raw in zip(lines, spp.ccsds_generator(stream), strict=True):
            packet = definition.parse_bytes(raw)
            names = [name for name in packet if not name.startswith(("packet_", "time_"))]
            assert int(packet["packet_apid"]) == line["apid"]
            seconds, fraction = packet["time_seconds"].raw_value, packet["time_fraction"].raw_value
            us = seconds * 1_000_000 + round(fraction * 1_000_000 / 2**24)
            assert us == line["us"], (us, line["us"])
            values = [getattr(packet[name], "raw_value", packet[name]) for name in names]
            assert len(values) == len(line["values"]), (line["apid"], len(values), len(line["values"]))
            for name, value, written in zip(names, values, line["values"], strict=True):
                assert is_same(value, written), (name, value, written)
            numbers += len(values)
            if line["apid"] == 0x102:
                assert isinstance(packet["event_severity"], str)
                assert packet["event_severity"] in ("information", "warning", "error")
    return numbers


def fields(text: str) -> list[ccsdspy.PacketField]:
    """Return fields from words such as ``u4:pictures``: type, bytes, name."""
    types = {"u": "uint", "f": "float"}
    return [
        ccsdspy.PacketField(name=word[3:], data_type=types[word[0]], bit_length=8 * int(word[1])) for word in text.split()
    ]


TIME = "u1:p_field u4:seconds u3:fraction "
# The tables of book/reference/telemetry.md, by hand.
TABLES = {
    0x100: "u1:mode u1:self_check u1:copy u1:last_status u4:generation u4:pictures u4:answers u4:lost u4:refused "
    "u2:commands u2:rejected u4:last_us u4:longest_us u4:stack u4:version u4:build u4:image_crc u2:starts "
    "u1:watchdog_resets u1:flags u2:repairs u2:last_sequence u4:foreign u4:broken u4:withheld u4:since_lift_off_s "
    "u1:clock u4:decimated u4:stuck",
    0x101: "u4:picture u8:exposure_us u8:done_us u4:calculation_us u1:body f4:altitude_m "
    "u1:status u1:stage u1:looks u2:level u4:followed u4:candidates u4:dropped u4:fallback u4:edge_points u4:draws u4:work "
    "u1:listed u1:solved f4:axis_x f4:axis_y f4:axis_z f4:xx f4:xy f4:xz f4:yy f4:yz f4:zz f4:ecef_x f4:ecef_y f4:ecef_z "
    "f4:body_x f4:body_y f4:body_z f4:half_angle f4:fused f4:alt f4:alt_sigma f4:rms f4:arc u4:inliers u4:candidate",
    0x102: "u2:number u1:severity u4:a u4:b",
    0x103: "u1:function u2:sequence u1:code u2:detail",
    0x104: "u2:number f8:value",
    0x105: "u4:picture u4:candidate u4:stride u2:first u2:total u2:count "
    + " ".join(f"u2:x{i} u2:y{i}" for i in range(64)),
    0x106: "u4:picture u4:number u4:length_px u4:points u4:inliers f4:rms_px u1:verdict",
    0x107: "u4:picture f4:free_x f4:free_y f4:free_z f4:xx f4:xy f4:xz f4:yy f4:yz f4:zz f4:cos f4:var_cos f4:cos_per_px "
    "f4:by_cos_x f4:by_cos_y f4:by_cos_z f4:x f4:y f4:z f4:pxx f4:pxy f4:pxz f4:pyy f4:pyz f4:pzz f4:range f4:range_sigma "
    "f4:body_x f4:body_y f4:body_z",
    0x108: "u4:picture u1:state f4:age_s f4:altitude f4:x f4:y f4:z f4:vx f4:vy f4:vz f4:rate_x f4:rate_y f4:rate_z",
    0x109: "u4:picture u1:state f4:age_s f4:qw f4:qx f4:qy f4:qz f4:sigma f4:sun_x f4:sun_y f4:sun_z",
    0x10A: (
        "u4:epoch u8:exposure_us u1:status u1:outcome u1:expected u1:seen u1:answered u1:used u1:excluded u1:repeated "
        "u2:repairs u4:picture_0 u4:picture_1 u4:picture_2 u4:picture_3 f4:axis_x f4:axis_y f4:axis_z "
        "f4:cov_xx f4:cov_xy f4:cov_xz f4:cov_yy f4:cov_yz f4:cov_zz "
        "f4:common_xx f4:common_xy f4:common_xz f4:common_yy f4:common_yz f4:common_zz "
        "f4:half_angle f4:separation f4:separation_limit f4:protection"
    ),
    0x10B: "u4:picture f4:p_limb f4:protection "
    "f4:common_xx f4:common_xy f4:common_xz f4:common_yy f4:common_yz f4:common_zz",
}


def check_ccsdspy(folder: Path, packets: bytes, lines: list[dict]) -> int:
    """Compare the packets whose tables are here; return how many there are."""
    compared, at, by_apid = 0, 0, {apid: bytearray() for apid in TABLES}
    for line in lines:
        end = at + 6 + int.from_bytes(packets[at + 4 : at + 6], "big") + 1
        by_apid.get(line["apid"], bytearray()).extend(packets[at:end])
        at = end
    for apid, table in TABLES.items():
        file = folder / f"{apid:x}.ccsds"
        file.write_bytes(by_apid[apid])
        decoded = ccsdspy.FixedLength(fields(TIME + table + " u2:crc")).load(str(file))
        names = [word[3:] for word in table.split()]
        written = np.array(
            [[math.nan if x is None else x for x in line["values"]] for line in lines if line["apid"] == apid]
        )
        for column, name in enumerate(names):
            value = decoded[name].astype(float)
            value[~np.isfinite(value)] = math.nan
            assert np.array_equal(value, written[:, column], equal_nan=True), (hex(apid), name)
        compared += len(written)
    return compared


XTCE = "{http://www.omg.org/spec/XTCE/20180204}"


def encode(meta: ElementTree.Element, types: dict[str, ElementTree.Element], values: list) -> bytes:
    """Return the bytes of a command up to its checksum, from the dictionary; a value of None takes the initial value."""
    arguments = meta.findall(f"{XTCE}ArgumentList/{XTCE}Argument")
    assert len(arguments) == len(values), meta.get("name")
    given = {argument.get("name"): (argument, value) for argument, value in zip(arguments, values, strict=True)}
    out = bytearray()
    for entry in meta.findall(f"{XTCE}CommandContainer/{XTCE}EntryList/*"):
        if entry.tag == f"{XTCE}FixedValueEntry":
            piece = bytes.fromhex(entry.get("binaryValue"))
            assert 8 * len(piece) == int(entry.get("sizeInBits"))
        else:
            argument, value = given.pop(entry.get("argumentRef"))
            kind = types[argument.get("argumentTypeRef")]
            if value is None:
                value = float(argument.get("initialValue"))
            encoding = next(child for child in kind if child.tag.endswith("DataEncoding"))
            size = int(encoding.get("sizeInBits")) // 8
            labels = {item.get("label"): int(item.get("value")) for item in kind.iter(f"{XTCE}Enumeration")}
            if encoding.tag == f"{XTCE}FloatDataEncoding":
                piece = struct.pack({4: ">f", 8: ">d"}[size], value)
            else:
                piece = int(labels[value] if labels else value).to_bytes(size, "big")
        out += piece
    assert not given, meta.get("name")
    return bytes(out)


def check_commands(hzn: str, dictionary: Path, folder: Path) -> int:
    """Compare every telecommand of the dictionary with that of `hzn telecommand`; return how many there are."""
    assert validate_xtce(dictionary, level="all", print_results=False, allow_schema_download=False).valid
    root = ElementTree.parse(dictionary).getroot()
    types = {kind.get("name"): kind for kind in root.find(f"{XTCE}CommandMetaData/{XTCE}ArgumentTypeSet")}
    metas = {meta.get("name"): meta for meta in root.iter(f"{XTCE}MetaCommand")}
    containers = {container.get("name"): container for container in root.iter(f"{XTCE}SequenceContainer")}
    assert {words.split()[0] for words in COMMANDS} | MADE_BY_LOAD == set(metas)
    for words, values in COMMANDS.items():
        sent = bytes_of_hzn(hzn, words, folder / "command.bin")
        encoded = encode(metas[words.split()[0]], types, values)
        assert sent[:-2] == encoded, (words, sent.hex(), encoded.hex())
        header = SpacePacketHeader.unpack(encoded)
        assert header.packet_type == PacketType.TC and header.packet_len == len(encoded) + 2, words
        # A command is done, or refused, when its acknowledgement says so.
        verifiers = metas[words.split()[0]].find(f"{XTCE}VerifierSet")
        for verifier in ("CompleteVerifier", "FailedVerifier"):
            answer = containers[verifiers.find(f"{XTCE}{verifier}/{XTCE}ContainerRef").get("containerRef")]
            compared = {item.get("parameterRef"): item.get("value") for item in answer.iter(f"{XTCE}Comparison")}
            assert compared == {"acknowledgement_function": str(encoded[14]), "acknowledgement_code": "0"}, words
    return len(metas)


def main() -> None:
    """Write packets and read them again."""
    hzn, example, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    subprocess.run([example, folder], check=True)
    dictionary = folder / "hzn.xml"
    dictionary.write_bytes(subprocess.run([hzn, "telemetry", "--xtce"], check=True, capture_output=True).stdout)
    packets, apids = without_markers((folder / "packets.bin").read_bytes())
    (folder / "packets.ccsds").write_bytes(packets)
    lines = [json.loads(line) for line in (folder / "values.jsonl").read_text().splitlines()]
    assert apids == [line["apid"] for line in lines] and len(lines) == 10_000
    numbers = check_xtce(dictionary, folder / "packets.ccsds", lines)
    compared = check_ccsdspy(folder, packets, lines)
    print(f"{check_commands(hzn, dictionary, folder)} telecommands of the dictionary are those of hzn")
    print(f"space-packet-parser: {len(lines)} packets, {numbers} numbers equal; ccsdspy: {compared} packets equal")


main()
