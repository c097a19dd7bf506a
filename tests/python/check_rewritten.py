"""Writes a recording of hzn again with the official library of MCAP, and compares what hzn reads of the copies.

usage: check_rewritten.py HZN FOLDER

The script makes FOLDER. Each copy must give the same table, the same pictures and the same answers as the recording:
with every compression of the library, with chunks of each size or none, and without the index. Reports without their
schema cannot be read, which hzn must say. Exits with 1 at the first difference.
"""

import csv
import io
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

PICTURES = 6
SENSOR = """preset = "hzn"
[camera]
width = 320
height = 240
model = "pinhole"
fx_px = 300.0
fy_px = 300.0
cx_px = 159.5
cy_px = 119.5
[body]
kind = "earth-sphere"
altitude_km = 400.0
"""
REPORT = "/hzn/report"


def need(condition, message):
    if not condition:
        raise SystemExit(f"check_rewritten: {message}")


def limb(shift):
    """Return a bright body of half-angle 70 degrees below its limb, as a picture file."""
    y, x = np.mgrid[0:240, 0:320].astype(float)
    s = math.radians(68.0 + 0.05 * shift)
    u, v = (x - 159.5) / 300.0, (y - 119.5) / 300.0
    cos = (v * math.sin(s) + math.cos(s)) / np.sqrt(1 + u * u + v * v)
    px = (math.radians(70.38) - np.arccos(np.clip(cos, -1, 1))) * 300.0
    image = (20 + 180 * np.clip(0.5 + px / 2, 0, 1)).astype(np.uint8)
    return b"P5\n320 240\n255\n" + image.tobytes()


def rewrite(source, target, *, without_schema=False, **options):
    """Write a recording again, message by message."""
    with open(source, "rb") as read, open(target, "wb") as write:
        reader = make_reader(read, validate_crcs=True)
        writer = Writer(write, **options)
        header = reader.get_header()
        writer.start(profile=header.profile, library="a copy")
        for a in reader.iter_attachments():
            writer.add_attachment(a.create_time, a.log_time, a.name, a.media_type, a.data)
        for m in reader.iter_metadata():
            writer.add_metadata(m.name, m.metadata)
        schemas, channels = {}, {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in channels:
                if schema.id not in schemas:
                    schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                own = 0 if without_schema and channel.topic == REPORT else schemas[schema.id]
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, own, channel.metadata
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()


def main(hzn, folder):
    folder.mkdir(parents=True)
    (folder / "in").mkdir()
    (folder / "in/sensor.toml").write_text(SENSOR)
    for i in range(PICTURES):
        (folder / f"in/{i}.pgm").write_bytes(limb(i))

    def run(*args, code=0):
        done = subprocess.run([hzn, *args], cwd=folder, capture_output=True, text=True)
        need(done.returncode == code, f"hzn {' '.join(args)}: {done.returncode} instead of {code}: {done.stderr}")
        return done

    def table(text):
        return [{k: v for k, v in row.items() if k != "elapsed_us"} for row in csv.DictReader(io.StringIO(text))]

    def pictures(of):
        return {path.name: path.read_bytes() for path in sorted((folder / of).iterdir())}

    run("run", "in", "-o", "ours.mcap", "-q")
    run("export", "ours.mcap", "-o", "ours.csv", "--images", "ours")
    ours = (folder / "ours.csv").read_text()
    need(len(table(ours)) == PICTURES, "hzn did not process all pictures")
    kinds = [{"compression": kind, "chunk_size": size} for kind in CompressionType for size in (1, 100_000, 1 << 30)]
    kinds.append({"use_chunking": False})
    bare = {"index_types": IndexType.NONE, "use_statistics": False}
    kinds += [bare, bare | {"use_chunking": False}]
    kinds.append({"enable_crcs": False, "repeat_channels": False, "repeat_schemas": False})
    for options in kinds:
        rewrite(folder / "ours.mcap", folder / "theirs.mcap", **options)
        run("export", "theirs.mcap", "-o", "theirs.csv", "--images", "theirs", "--force")
        need((folder / "theirs.csv").read_text() == ours, f"{options}: another table")
        need(pictures("theirs") == pictures("ours"), f"{options}: other pictures")
        need(table(run("run", "theirs.mcap").stdout) == table(ours), f"{options}: other answers")
        run("recover", "theirs.mcap", "-o", "closed.mcap", "--force")
        run("export", "closed.mcap", "-o", "closed.csv", "--force")
        need((folder / "closed.csv").read_text() == ours, f"{options}: another table after the recovery")
    rewrite(folder / "ours.mcap", folder / "theirs.mcap", without_schema=True)
    told = run("export", "theirs.mcap", "-o", "lost.csv", code=3).stderr
    need("schema" in told, f"reports without a schema: {told}")
    print(f"check_rewritten: {len(kinds)} copies of a recording give the same table, pictures and answers")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(str(Path(sys.argv[1]).resolve()), Path(sys.argv[2]))
