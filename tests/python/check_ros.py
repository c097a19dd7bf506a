"""Writes bags with other libraries, processes them with hzn, and reads the answers of hzn with these libraries.
The programs in book/guide/ros.md run as they are printed there, over a flight whose truth is known.

usage: check_ros.py HZN FOLDER

The script makes FOLDER. `rosbags` writes a bag with the limb of a planet in each encoding of sensor_msgs/Image, and a
bag in SQLite; `mcap-ros2-support` writes a recording of sensor_msgs/CompressedImage. Each picture must have the answer of
the grey picture. Both libraries then read what `hzn run --ros` has written. `hzn init` takes the calibration of one of two
cameras. Exits with 1 at the first difference.
"""

import contextlib
import csv
import io
import math
import re
import struct
import subprocess
import sys
import tomllib
import zlib
from pathlib import Path

import numpy as np
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer as Mcap
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader, ReaderError, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

W, H, F = 320, 240, 300.0
SENSOR = f"""preset = "hzn"
[camera]
width = {W}
height = {H}
model = "pinhole"
fx_px = {F}
fy_px = {F}
cx_px = 159.5
cy_px = 119.5
[body]
kind = "earth-sphere"
altitude_km = 400.0
limb = "height"
# The encodings show one picture again and again.
[gates]
fixed_edge = "off"
"""
IMAGE, COMPRESSED, INFO = (f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo"))
# The centre of the body of `limb()`.
TRUTH = np.array([0.0, math.sin(math.radians(68.0)), math.cos(math.radians(68.0))])
BOOK = Path(__file__).parents[2] / "book/guide/ros.md"
# A number of seconds in double precision cannot hold these nanoseconds.
BASE_NS = 1_700_000_000_000_000_487


def need(condition, message):
    if not condition:
        raise SystemExit(f"check_ros: {message}")


def limb():
    """A bright body of half-angle 70 degrees below its limb, as numbers from 20 to 200."""
    y, x = np.mgrid[0:H, 0:W].astype(float)
    s = math.radians(68.0)
    u, v = (x - 159.5) / F, (y - 119.5) / F
    cos = (v * math.sin(s) + math.cos(s)) / np.sqrt(1 + u * u + v * v)
    px = (math.radians(70.38) - np.arccos(np.clip(cos, -1, 1))) * F
    return 20 + 180 * np.clip(0.5 + px / 2, 0, 1)


def encodings(grey):
    """Returns the bytes and the row length of the picture in each encoding."""
    byte = np.rint(grey).astype(np.uint8)
    word = (byte.astype(np.uint16) * 257).astype("<u2")
    stack = lambda a, n: np.repeat(a[:, :, None], n, axis=2)
    neutral = np.full_like(byte, 128)
    plane = np.full(H * W // 2, 128, np.uint8).tobytes()
    yield "mono8", byte.tobytes(), W, 0
    padded = np.hstack([byte, np.zeros((H, 12), np.uint8)])
    yield "8UC1", padded.tobytes(), W + 12, 0
    yield "mono16", word.tobytes(), 2 * W, 0
    yield "16UC1", word.astype(">u2").tobytes(), 2 * W, 1
    for name, n in [("rgb8", 3), ("bgr8", 3), ("8UC3", 3), ("rgba8", 4), ("bgra8", 4), ("8UC4", 4)]:
        yield name, stack(byte, n).tobytes(), n * W, 0
    for name, n in [("rgb16", 3), ("bgr16", 3), ("rgba16", 4), ("bgra16", 4), ("16UC3", 3)]:
        yield name, stack(word, n).tobytes(), 2 * n * W, 0
    for pattern in ("rggb", "bggr", "gbrg", "grbg"):
        yield f"bayer_{pattern}8", byte.tobytes(), W, 0
        yield f"bayer_{pattern}16", word.tobytes(), 2 * W, 0
    yield "yuv422", np.dstack([neutral, byte]).tobytes(), 2 * W, 0
    yield "yuv422_yuy2", np.dstack([byte, neutral]).tobytes(), 2 * W, 0
    yield "nv21", byte.tobytes() + plane, W, 0
    yield "32FC1", (250 + byte.astype("<f4") / 5).tobytes(), 4 * W, 0


def png(grey):
    """Returns an 8-bit grey PNG."""
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + row.tobytes() for row in np.rint(grey).astype(np.uint8))
    head = struct.pack(">IIBBBBB", W, H, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def write_bag(folder, store, plugin, pictures):
    header, time, image = (store.types[n] for n in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", IMAGE))
    with Writer(folder, version=9, storage_plugin=plugin) as bag:
        topic = bag.add_connection("/camera/image_raw", IMAGE, typestore=store)
        for i, (encoding, data, step, big_endian) in enumerate(pictures):
            ns = BASE_NS + i * 500_000_000
            stamp = time(sec=ns // 10**9, nanosec=ns % 10**9)
            message = image(header=header(stamp=stamp, frame_id="camera_optical_frame"), height=H, width=W,
                            encoding=encoding, is_bigendian=big_endian, step=step,
                            data=np.frombuffer(data, np.uint8))
            bag.write(topic, ns + 7, store.serialize_cdr(message, IMAGE))


def hzn(*arguments, code=0):
    done = subprocess.run([HZN, *map(str, arguments)], capture_output=True, text=True)
    need(done.returncode == code, f"hzn {' '.join(map(str, arguments))}: {done.returncode}: {done.stderr}")
    return done


def angle_deg(a, b):
    return math.degrees(math.asin(min(1.0, float(np.linalg.norm(np.cross(a, b))))))


def axis(row):
    return np.array([float(row[f"axis_{k}"]) for k in "xyz"])


def check_encodings(folder, store):
    pictures = list(encodings(limb()))
    write_bag(folder / "bag", store, StoragePlugin.MCAP, pictures)
    (folder / "sensor.toml").write_text(SENSOR)
    answers = folder / "answers.mcap"
    # The sensor is found above the bag.
    hzn("run", folder / "bag", "-o", answers, "-o", folder / "answers.csv", "--ros")
    rows = list(csv.DictReader(open(folder / "answers.csv", newline="")))
    need(len(rows) == len(pictures), f"{len(rows)} rows of {len(pictures)} pictures")
    first = rows[0]
    for row, (encoding, *_), i in zip(rows, pictures, range(len(rows))):
        need(row["status"] == "ok", f"{encoding}: {row['status']} {row['detail']}")
        need(abs(float(row["time_s"]) - BASE_NS * 1e-9 - 0.5 * i) < 1e-6, f"{encoding}: time {row['time_s']}")
        # A mosaic becomes a little softer; everything else has the same counts but for their rounding.
        off = angle_deg(axis(row), axis(first))
        need(off < (0.02 if "bayer" in encoding else 0.002), f"{encoding}: {off} degrees from the grey picture")
        # The picture has no noise, and all rows are of one picture, so there is no NEES.
        error, sigma = angle_deg(axis(row), TRUTH), float(row["sigma_max_deg"])
        need(error < 3 * sigma, f"{encoding}: the error of {error} degrees is above three sigmas of {sigma} degrees")
    return answers, rows


def check_answers(answers, rows):
    """Reads the messages of ROS in a recording of hzn with mcap-ros2-support."""
    vectors, matrices = [], []
    with open(answers, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        topics = ["/hzn/axis_vector", "/hzn/axis_covariance"]
        for schema, channel, message, ros in reader.iter_decoded_messages(topics=topics):
            if channel.topic == topics[0]:
                need(schema.name == "geometry_msgs/msg/Vector3Stamped", schema.name)
                need(ros.header.frame_id == "camera_optical_frame", ros.header.frame_id)
                stamp = ros.header.stamp.sec * 10**9 + ros.header.stamp.nanosec
                need(message.log_time == stamp, f"log time {message.log_time}, stamp {stamp}")
                vectors.append((stamp, np.array([ros.vector.x, ros.vector.y, ros.vector.z])))
            else:
                need([d.size for d in ros.layout.dim] == [3, 3], "layout of the covariance")
                matrices.append(np.array(list(ros.data)).reshape(3, 3))
    need(len(vectors) == len(matrices) == len(rows), f"{len(vectors)} vectors, {len(matrices)} matrices")
    for i, ((stamp, vector), matrix, row) in enumerate(zip(vectors, matrices, rows)):
        need(stamp == BASE_NS + i * 500_000_000, f"stamp {stamp}")
        need(np.array_equal(vector, axis(row)), "axis")
        names = [["xx", "xy", "xz"], ["xy", "yy", "yz"], ["xz", "yz", "zz"]]
        expected = np.array([[float(row[f"cov_{name}"]) for name in line] for line in names])
        need(np.array_equal(matrix, expected), "covariance")


def check_bytes_of_rosbags(answers, store, rows):
    """Reads the same bytes with rosbags, whose reader is another program."""
    with open(answers, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=["/hzn/axis_vector"]):
            vector = store.deserialize_cdr(message.data, "geometry_msgs/msg/Vector3Stamped").vector
            need(np.array_equal([vector.x, vector.y, vector.z], axis(rows[0])), "axis, read by rosbags")
            return


def check_flight(folder, store):
    """Runs the programs of the book over a simulated flight, and compares the messages of ROS with the truth."""
    flight = folder / "flight"
    hzn("simulate", "leo-infrared", "--frames", "12", "-o", flight, "-q")
    hzn("run", flight, "--ros", "-o", folder / "ros.mcap", "-o", folder / "flight.csv")
    hzn("run", flight, "-o", folder / "flight.mcap")
    vectors, matrices = {}, {}
    with open(folder / "ros.mcap", "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        topics = ["/hzn/axis_vector", "/hzn/axis_covariance"]
        for _, channel, message, ros in reader.iter_decoded_messages(topics=topics):
            if channel.topic == topics[0]:
                vectors[message.log_time] = np.array([ros.vector.x, ros.vector.y, ros.vector.z])
            else:
                matrices[message.log_time] = np.array(list(ros.data)).reshape(3, 3)
    truth = {round(float(r["time_s"]) * 1e9): axis(r) for r in csv.DictReader(open(flight / "truth.csv", newline=""))}
    need(vectors.keys() == matrices.keys() == truth.keys() and len(truth) == 12, f"{len(vectors)} of {len(truth)}")
    misses = {at: vector - truth[at] for at, vector in vectors.items()}
    nees = [miss @ np.linalg.pinv(matrices[at], rcond=1e-6) @ miss for at, miss in misses.items()]
    # The 99.7 % points of chi-square with two degrees of freedom, and of the mean of twelve.
    need(max(nees) < 11.8 and np.mean(nees) < 3.95, f"NEES {nees}")
    print(f"bag of a flight: 12 answers, NEES (2 degrees of freedom) {np.mean(nees):.2f}, at most {max(nees):.2f}")
    programs = re.findall(r"(?s)```python\n(.*?)```", BOOK.read_text())
    printed = []
    with contextlib.chdir(folder):
        for program in programs:
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(program, str(BOOK), "exec"), {})
            printed.append(out.getvalue())
    # The first and the last print a line for each picture; the others write a copy and a bag.
    need([len(text.splitlines()) for text in printed] == [12, 0, 0, 12], f"lines of the programs: {printed}")
    check_profile(folder, store, vectors)
    rows = {round(float(r["time_s"]) * 1e9): axis(r) for r in csv.DictReader(open(folder / "flight.csv", newline=""))}
    with Reader(folder / "nadir") as bag:
        read = {at: store.deserialize_cdr(data, topic.msgtype).vector for topic, at, data in bag.messages()}
    need(read.keys() == rows.keys(), f"times of the bag: {sorted(read)}")
    for at, vector in read.items():
        need(np.array_equal([vector.x, vector.y, vector.z], rows[at]), "axis in the bag of the book")


def check_profile(folder, store, vectors):
    """Compares the profiles with what MCAP's registry asks of them, and reads the copy of the book with rosbags."""
    kinds = {}
    for name in ("ros.mcap", "axes.mcap"):
        with open(folder / name, "rb") as file:
            reader = make_reader(file)
            summary = reader.get_summary()
            kinds[name] = reader.get_header().profile, {
                (channel.message_encoding, summary.schemas[channel.schema_id].encoding)
                for channel in summary.channels.values()
            }
    mixed = {("cdr", "ros2msg"), ("json", "jsonschema"), ("protobuf", "protobuf")}
    need(kinds == {"ros.mcap": ("", mixed), "axes.mcap": ("ros2", {("cdr", "ros2msg")})}, f"profiles: {kinds}")
    try:
        Reader(folder / "ros.mcap").open()
        need(False, "rosbags reads a recording without a profile: the book says that it does not")
    except ReaderError as error:
        need("rofile is not ros2" in str(error), f"rosbags: {error}")
    with Reader(folder / "axes.mcap") as bag:
        read = [(topic.topic, at, store.deserialize_cdr(data, topic.msgtype)) for topic, at, data in bag.messages()]
    axes = {at: message.vector for topic, at, message in read if topic == "/hzn/axis_vector"}
    need(len(read) == 2 * len(vectors) and axes.keys() == vectors.keys(), f"messages of the copy: {len(read)}")
    for at, vector in axes.items():
        need(np.array_equal([vector.x, vector.y, vector.z], vectors[at]), "axis in the copy of the book")


def check_compressed(folder):
    definition = "std_msgs/Header header\nstring format\nuint8[] data\n" + "=" * 80 + (
        "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + "=" * 80
        + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n")
    path = folder / "compressed.mcap"
    with open(path, "wb") as file:
        writer = Mcap(file)
        schema = writer.register_msgdef(COMPRESSED, definition)
        for i in range(2):
            header = {"stamp": {"sec": 5 + i, "nanosec": 250_000_000}, "frame_id": "camera"}
            message = {"header": header, "format": "mono8; png compressed mono8", "data": png(limb())}
            writer.write_message("/camera/image/compressed", schema, message, log_time=9 * 10**9 + i)
        writer.finish()
    rows = list(csv.DictReader(io.StringIO(hzn("run", path, "-q").stdout)))
    need([(r["status"], r["time_s"]) for r in rows] == [("ok", "5.25"), ("ok", "6.25")], f"compressed: {rows}")


def check_cameras(folder, store):
    """Starts a sensor for one of two cameras, whose CameraInfo has binning and a window, as rosbags encodes it."""
    header, time, image, info, roi = (store.types[n] for n in (
        "std_msgs/msg/Header", "builtin_interfaces/msg/Time", IMAGE, INFO, "sensor_msgs/msg/RegionOfInterest"))
    # The window begins in column 40 and row 20, and two by two pixels become one.
    k = np.array([2 * F, 0, 2 * 159.5 + 40, 0, 2 * F + 1, 2 * 119.5 + 20, 0, 0, 1])
    window = roi(x_offset=40, y_offset=20, height=2 * H, width=2 * W, do_rectify=False)
    with Writer(folder / "cameras", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for name, scale in (("front", 3.0), ("rear", 1.0)):
            head = header(stamp=time(sec=5, nanosec=0), frame_id=name)
            lens = info(header=head, height=2 * H + 60, width=2 * W + 80, distortion_model="plumb_bob",
                        d=np.array([-0.1, 0.01, 0, 0, 0]), k=k * np.array([scale, 1, 1, 1, scale, 1, 1, 1, 1]),
                        r=np.eye(3).ravel(), p=np.zeros(12), binning_x=2, binning_y=2, roi=window)
            picture = image(header=head, height=H, width=W, encoding="mono8", is_bigendian=0, step=W,
                            data=np.rint(limb()).astype(np.uint8).ravel())
            for topic, message, kind in (("camera_info", lens, INFO), ("image_raw", picture, IMAGE)):
                connection = bag.add_connection(f"/{name}/{topic}", kind, typestore=store)
                bag.write(connection, 7 * 10**9, store.serialize_cdr(message, kind))
    sensor = folder / "rear.toml"
    said = hzn("init", folder / "cameras", "--topic", "/rear/image_raw", "--altitude", 400, "-o", sensor)
    need("/rear/camera_info" in said.stderr and "/front" not in said.stderr, said.stderr)
    # A note names the other camera only if none was asked for.
    said = hzn("init", folder / "cameras", "--altitude", 400, "-o", folder / "front.toml")
    need("/front/camera_info" in said.stderr and "/rear/image_raw" in said.stderr, said.stderr)
    camera = tomllib.loads(sensor.read_text())["camera"]
    expected = {"width": W, "height": H, "fx_px": F, "fy_px": F + 0.5, "cx_px": 159.5, "cy_px": 119.5}
    need({name: camera[name] for name in expected} == expected, f"camera: {camera}")
    need(camera["k"][:2] == [-0.1, 0.01], f"camera: {camera}")
    said = hzn("init", folder / "cameras", "--topic", "/left", "-o", folder / "left.toml", code=2).stderr
    need("there are some on /front/image_raw, /rear/image_raw" in said, said)


def check_refused(folder, store):
    write_bag(folder / "sqlite", store, StoragePlugin.SQLITE3, list(encodings(limb()))[:1])
    for path in [folder / "sqlite", next((folder / "sqlite").glob("*.db3"))]:
        said = hzn("run", path, code=2).stderr
        need("rosbags-convert --src" in said, said)
    # The command that the message names works.
    program = Path(sys.executable).with_name("rosbags-convert")
    source, target = folder / "sqlite", folder / "converted"
    subprocess.run([program, "--src", source, "--dst", target, "--dst-storage", "mcap"], check=True, capture_output=True)
    rows = list(csv.DictReader(io.StringIO(hzn("run", target, "-q").stdout)))
    need([r["status"] for r in rows] == ["ok"], f"converted bag: {rows}")


def main():
    folder = Path(sys.argv[2])
    folder.mkdir(parents=True)
    store = get_typestore(Stores.ROS2_HUMBLE)
    answers, rows = check_encodings(folder, store)
    check_answers(answers, rows)
    check_bytes_of_rosbags(answers, store, rows)
    check_flight(folder, store)
    check_compressed(folder)
    check_cameras(folder, store)
    check_refused(folder, store)
    print(f"check_ros: {len(rows)} encodings, 2 compressed pictures, and the answers as messages of ROS are right")


if __name__ == "__main__":
    HZN = sys.argv[1]
    main()
