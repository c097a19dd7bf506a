"""Messages of ROS 2 in CDR, and recordings of them (MCAP), for the tests."""

import struct

MAGIC = b"\x89MCAP0\r\n"


class Message(bytearray):
    """A message of ROS 2: encapsulation, then fields that begin at multiples of their size."""

    def __init__(self, stamp, frame="cam"):
        super().__init__(b"\0\1\0\0")
        self.words(*stamp).text(frame)

    def align(self, size):
        self.extend(bytes(-(len(self) - 4) % size))
        return self

    def words(self, *words):
        self.align(4).extend(struct.pack(f"<{len(words)}I", *words))
        return self

    def numbers(self, numbers):
        self.align(8).extend(struct.pack(f"<{len(numbers)}d", *numbers))
        return self

    def text(self, text):
        return self.blob(text.encode() + b"\0")

    def blob(self, data):
        self.words(len(data)).extend(data)
        return self


def image(picture, stamp=(5, 0)):
    """Return a `sensor_msgs/msg/Image` of a grey picture."""
    height, width = picture.shape
    message = Message(stamp).words(height, width).text("mono8")
    message.append(0)
    return message.words(width).blob(picture.tobytes())


def camera_info(width, height, focal_px, zeros=False):
    """Return a `sensor_msgs/msg/CameraInfo`; with `zeros` that of a camera that is not calibrated."""
    matrix = [0] * 9 if zeros else [focal_px, 0, (width - 1) / 2, 0, focal_px, (height - 1) / 2, 0, 0, 1]
    message = Message((5, 0)).words(height, width).text("plumb_bob").words(5).numbers([0] * 5).numbers(matrix)
    message.numbers([1, 0, 0, 0, 1, 0, 0, 0, 1]).numbers([0] * 12).words(0, 0, 0, 0, 0, 0)
    message.append(0)
    return message


def write(path, messages):
    """Write messages as (topic, type, message), one nanosecond apart, as a recording without chunks.

    The summary at its end names the topics.
    """

    def text(value):
        return struct.pack("<I", len(value)) + value.encode()

    def record(op, content):
        return struct.pack("<BQ", op, len(content)) + content

    out, summary, channels = [MAGIC, record(1, text("ros2") + text("test"))], [], {}
    for n, (topic, kind, message) in enumerate(messages, 1):
        if topic not in channels:
            channels[topic] = number = len(channels) + 1
            schema = struct.pack("<H", number) + text(f"sensor_msgs/msg/{kind}") + text("ros2msg") + text("")
            channel = struct.pack("<HH", number, number) + text(topic) + text("cdr") + struct.pack("<I", 0)
            declared = [record(3, schema), record(4, channel)]
            out += declared
            summary += declared
        out.append(record(5, struct.pack("<HIQQ", channels[topic], n, n, n) + bytes(message)))
    counts = b"".join(struct.pack("<HQ", number, 1) for number in channels.values())
    summary.append(record(11, struct.pack("<QHIIIIQQI", n, n, n, 0, 0, 0, 1, n, len(counts)) + counts))
    out.append(record(15, bytes(4)))
    footer = record(2, struct.pack("<QQI", len(b"".join(out)), 0, 0))
    path.write_bytes(b"".join([*out, *summary, footer, MAGIC]))
    return path
