"""Reads hzn recordings with the reference reader and checks what hzn promises about them.

usage: check_mcap.py FILE.mcap...

Checks every CRC and decodes every message. Prints one line per file; exits with 1 at the first broken promise.
"""

import importlib
import json
import sys
import tomllib
from collections import Counter

from google.protobuf.descriptor_pb2 import DescriptorProto, FileDescriptorSet
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment, Chunk, DataEnd
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

SCHEMAS = {
    "/hzn/report": {"hzn.Report"},
    "/camera/image": {"foxglove.CompressedImage", "foxglove.RawImage"},
    "/camera/calibration": {"foxglove.CameraCalibration"},
    "/camera/annotations": {"foxglove.ImageAnnotations"},
    "/hzn/axis": {"foxglove.PoseInFrame"},
    "/tf": {"foxglove.FrameTransform"},
    "/log": {"foxglove.Log"},
}
FRAMES = {"/tf": ("fixed", "camera")}
SIGNATURES = {"png": b"\x89PNG\r\n\x1a\n", "jpeg": b"\xff\xd8\xff"}


def need(condition, message):
    if not condition:
        raise SystemExit(f"check_mcap: {message}")


def check_layout(path):
    """Checks that the attachment is first, the compression is a known one, and the data section's CRC is right."""
    with open(path, "rb") as f:
        records = list(StreamReader(f, validate_crcs=True, emit_chunks=True).records)
    kinds = [type(r) for r in records]
    need(Attachment in kinds, "the file has no attachment")
    if Chunk in kinds:
        need(kinds.index(Attachment) < kinds.index(Chunk), "the attachment sensor.toml is not the first record")
    need(DataEnd in kinds, "the record DataEnd is missing")
    need({r.compression for r in records if isinstance(r, Chunk)} <= {"", "zstd"}, "a chunk has an unknown compression")


def fields(message):
    return {f.number: (f.name, f.type, f.label, f.type_name) for f in message.field}


def check_schema(schema):
    """Checks that every message of an embedded schema is the one that Foxglove publishes."""
    for file in FileDescriptorSet.FromString(schema.data).file:
        if file.package != "foxglove":
            continue
        for message in file.message_type:
            module = importlib.import_module(f"foxglove_schemas_protobuf.{message.name}_pb2")
            official = DescriptorProto()
            module.DESCRIPTOR.message_types_by_name[message.name].CopyToProto(official)
            need(fields(message) == fields(official), f"foxglove.{message.name} is not Foxglove's own")
            for nested, published in zip(message.enum_type, official.enum_type):
                values = [[(v.name, v.number) for v in e.value] for e in (nested, published)]
                need(values[0] == values[1], f"foxglove.{message.name}.{nested.name} is not Foxglove's own")


def check_stamp(topic, message, log_time):
    """Checks that the message's own time is the log time, and that its frame is right."""
    stamp = message.timestamp
    need(stamp.seconds * 10**9 + stamp.nanos == log_time, f"{topic}: the time in the message differs from the log time")
    for p in getattr(message, "points", []):
        need(p.timestamp == stamp, f"{topic}: an annotation and its picture have different times")
    if hasattr(message, "frame_id"):
        need(message.frame_id == "camera", f"{topic}: the frame is {message.frame_id}, not camera")
    if topic in FRAMES:
        need((message.parent_frame_id, message.child_frame_id) == FRAMES[topic], f"{topic}: the frames are not {FRAMES[topic]}")


def distance_to_line(point, line):
    """Returns the distance of a point from a polyline."""
    best = float("inf")
    for a, b in zip(line, line[1:]):
        dx, dy = b.x - a.x, b.y - a.y
        t = ((point.x - a.x) * dx + (point.y - a.y) * dy) / ((dx * dx + dy * dy) or 1.0)
        t = min(1.0, max(0.0, t))
        best = min(best, ((a.x + t * dx - point.x) ** 2 + (a.y + t * dy - point.y) ** 2) ** 0.5)
    return best


def check_annotations(message):
    """Returns the median distance of the inliers from the drawn limb; both have the same offset of half a pixel."""
    by_kind = {}
    for p in message.points:
        kind = next((m.value for m in p.metadata if m.key == "kind"), None)
        need(kind in {"edge", "limb", "inlier", "rejected", "axis"}, f"an annotation has the unknown kind {kind}")
        by_kind.setdefault(kind, []).append(list(p.points))
    inliers = [q for points in by_kind.get("inlier", []) for q in points]
    limbs = by_kind.get("limb", [])
    if not inliers or not limbs:
        return None
    step = max(1, len(inliers) // 50)
    distances = sorted(min(distance_to_line(q, line) for line in limbs) for q in inliers[::step])
    return distances[len(distances) // 2]


def check(path):
    check_layout(path)
    counts, times, reports, worst, schemas = Counter(), {}, [], 0.0, set()
    with open(path, "rb") as f:
        reader = make_reader(f, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        need(summary is not None and summary.statistics is not None, "the file has no summary")
        for attachment in reader.iter_attachments():
            if attachment.name == "sensor.toml":
                tomllib.loads(attachment.data.decode())
                break
        else:
            need(False, "sensor.toml is not attached")
        need([m.name for m in reader.iter_metadata()][:1] == ["hzn"], "the first metadata record is not hzn")
        for schema, channel, message in reader.iter_messages():
            need(schema.name in SCHEMAS.get(channel.topic, set()), f"{channel.topic} has schema {schema.name}")
            if schema.encoding == "protobuf":
                if schema.id not in schemas:
                    check_schema(schema)
                    schemas.add(schema.id)
                decoded = DecoderFactory().decoder_for("protobuf", schema)(message.data)
            else:
                decoded = json.loads(message.data)
            if schema.encoding == "protobuf":
                check_stamp(channel.topic, decoded, message.log_time)
            counts[channel.topic] += 1
            times.setdefault(channel.topic, set()).add(message.log_time)
            if channel.topic == "/hzn/report":
                allowed = json.loads(schema.data)["properties"]
                need(set(decoded) <= set(allowed), f"a report has unknown columns: {set(decoded) - set(allowed)}")
                need(("axis_x" in decoded) == (decoded["status"] == "ok"),
                     "a report must have an axis if and only if its status is ok")
                reports.append(decoded)
            elif schema.name == "foxglove.CompressedImage":
                signature = SIGNATURES.get(decoded.format)
                signed = signature is not None and decoded.data.startswith(signature)
                need(signed, f"the data of a picture are not {decoded.format}")
            elif schema.name == "foxglove.RawImage":
                need(len(decoded.data) == decoded.step * decoded.height, "a raw picture has the wrong number of bytes")
            elif channel.topic == "/camera/annotations":
                worst = max(worst, check_annotations(decoded) or 0.0)
    need(sum(counts.values()) == summary.statistics.message_count, "the statistics are wrong")
    need(times.get("/camera/image", set()) <= times.get("/camera/annotations", set()), "a picture has no annotations")
    need(worst < 3.0, f"half of the inliers are more than {worst:.1f} px off the drawn limb")
    with open(path, "rb") as f:
        streamed = sum(1 for _ in NonSeekingReader(f, validate_crcs=True).iter_messages(log_time_order=False))
    need(streamed == summary.statistics.message_count, "the index and the stream have different numbers of messages")
    print(f"{path}: {len(reports)} reports, {counts['/camera/image']} pictures, {streamed} messages, all CRCs right")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    for name in sys.argv[1:]:
        check(name)
