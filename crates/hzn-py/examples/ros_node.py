"""A node of ROS 2 that finds the limb in each picture: sensor_msgs/Image in, direction and covariance out.

    pip install hzn-sensor                                  # into the Python of ROS
    python ros_node.py --ros-args -p sensor:=sensor.toml    # without the parameter, from sensor.toml of this folder

It subscribes to `image`, and to `fix` (sensor_msgs/NavSatFix) for the altitude above WGS 84; without fixes, sensor.toml must
have it. It publishes `axis` (geometry_msgs/Vector3Stamped, a unit vector to the body) and `axis_covariance`
(std_msgs/Float64MultiArray, 3 x 3, rad², row by row, in the frame of the axis). Both have the stamp of the picture; a picture
without an answer publishes nothing, and the reason goes to the log. The frame of the axis is the camera's optical frame, as
ROS and hzn both define it: x right, y down, z forward.

`Limbs` needs no ROS: it takes and makes messages by their fields.
"""

from types import SimpleNamespace

import numpy as np

import hzn

# Bytes of a sample and samples of a pixel, for each encoding.
ENCODINGS = {
    "mono8": ("u1", 1), "8UC1": ("u1", 1), "mono16": ("u2", 1), "16UC1": ("u2", 1),
    "rgb8": ("u1", 3), "bgr8": ("u1", 3), "rgba8": ("u1", 4), "bgra8": ("u1", 4),
}  # fmt: skip


def picture(message):
    """Return the picture of a sensor_msgs/Image as an array, without a copy if its rows are not padded."""
    if message.encoding not in ENCODINGS:
        raise ValueError(f"the encoding {message.encoding} is not one of {', '.join(ENCODINGS)}")
    kind, channels = ENCODINGS[message.encoding]
    dtype = np.dtype((">" if message.is_bigendian else "<") + kind)
    row = message.width * channels * dtype.itemsize
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)[:, :row]
    image = np.ascontiguousarray(rows).view(dtype).astype(dtype.newbyteorder("="), copy=False)
    image = image.reshape(message.height, message.width, channels)
    # The sensor expects red first.
    return image[..., [2, 1, 0]] if message.encoding.startswith("bgr") else image[..., 0] if channels == 1 else image


class Limbs:
    """Answers messages with messages. ``types`` has the classes of ROS as attributes."""

    def __init__(self, sensor, types):
        self.sensor, self.types, self.altitude_km = sensor, types, None

    def take_fix(self, message):
        """Remember the altitude of a sensor_msgs/NavSatFix that has one."""
        if message.status.status >= 0 and np.isfinite(message.altitude):
            self.altitude_km = message.altitude / 1e3

    def answer(self, message):
        """Return the report on a picture, and its two messages, which are None without an answer."""
        stamp = message.header.stamp
        known = {"altitude_km": self.altitude_km, "time_s": stamp.sec + 1e-9 * stamp.nanosec}
        report = self.sensor.process(picture(message), **known)
        if not report:
            return report, None, None
        x, y, z = report.axis.tolist()
        types = self.types
        axis = types.Vector3Stamped(header=message.header, vector=types.Vector3(x=x, y=y, z=z))
        dimension = types.MultiArrayDimension
        sizes = [dimension(label="row", size=3, stride=9), dimension(label="column", size=3, stride=3)]
        layout = types.MultiArrayLayout(dim=sizes, data_offset=0)
        covariance = types.Float64MultiArray(layout=layout, data=report.covariance.ravel().tolist())
        return report, axis, covariance


def main():
    import rclpy
    from geometry_msgs.msg import Vector3, Vector3Stamped
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import Image, NavSatFix
    from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

    types = SimpleNamespace(
        Vector3=Vector3,
        Vector3Stamped=Vector3Stamped,
        Float64MultiArray=Float64MultiArray,
        MultiArrayDimension=MultiArrayDimension,
        MultiArrayLayout=MultiArrayLayout,
    )
    rclpy.init()
    node = Node("hzn")
    path = node.declare_parameter("sensor", "sensor.toml").value
    limbs = Limbs(hzn.Sensor.from_toml(path), types)
    axes = node.create_publisher(Vector3Stamped, "axis", 10)
    covariances = node.create_publisher(Float64MultiArray, "axis_covariance", 10)

    def on_image(message):
        report, axis, covariance = limbs.answer(message)
        if axis is None:
            node.get_logger().warning(f"{report.status}: {report.detail}", throttle_duration_sec=5.0)
            return
        axes.publish(axis)
        covariances.publish(covariance)

    node.create_subscription(NavSatFix, "fix", limbs.take_fix, qos_profile_sensor_data)
    node.create_subscription(Image, "image", on_image, qos_profile_sensor_data)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
