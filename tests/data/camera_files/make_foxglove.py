"""Writes Foxglove's CameraCalibration as JSON with the schemas of Foxglove (foxglove-schemas-protobuf) and protobuf.

    python make_foxglove.py FOLDER
"""

import sys

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from google.protobuf.json_format import MessageToJson

message = CameraCalibration(
    frame_id="camera",
    width=640,
    height=480,
    distortion_model="kannala_brandt",
    D=[-0.0431, 0.0123, -0.0057, 1e-05],
    K=[431.25, 0, 321.5, 0, 430.0625, 238.75, 0, 0, 1],
    R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
    P=[431.25, 0, 321.5, 0, 0, 430.0625, 238.75, 0, 0, 0, 1, 0],
)
for name, keep in (("foxglove-json.json", False), ("foxglove-proto.json", True)):
    with open(f"{sys.argv[1]}/{name}", "w") as file:
        file.write(MessageToJson(message, preserving_proto_field_name=keep) + "\n")
