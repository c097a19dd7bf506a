"""Horizon sensing: from a picture of a planet's limb to the direction of the planet, with its covariance.

>>> sensor = hzn.Sensor.from_toml("sensor.toml")
>>> report = sensor.process(image, altitude_km=230.0)
>>> report.status, report.axis, report.covariance

Vectors are in the camera frame (x right, y down, z forward) unless their name says otherwise; pixel centres are at
integers, as in OpenCV. Names end with their unit.
"""

from . import consensus as consensus
from . import contour as contour
from . import covariance as covariance
from . import fit as fit
from . import keys as keys
from . import nav as nav
from . import rays as rays
from . import threshold as threshold
from ._hzn import Calibration as Calibration
from ._hzn import Camera as Camera
from ._hzn import ConfigError as ConfigError
from ._hzn import Expected as Expected
from ._hzn import Frame as Frame
from ._hzn import HznError as HznError
from ._hzn import ImageError as ImageError
from ._hzn import Recording as Recording
from ._hzn import Report as Report
from ._hzn import Rig as Rig
from ._hzn import Sensor as Sensor
from ._hzn import SimulatedFrame as SimulatedFrame
from ._hzn import Simulation as Simulation
from ._hzn import __version__ as __version__
from ._hzn import calibrate as calibrate
from ._hzn import calibrate_points as calibrate_points
from ._hzn import find_corners as find_corners
from ._hzn import locate as locate
from ._hzn import open_mcap as open_mcap
from ._hzn import overlay as overlay
from ._hzn import read_mcap as read_mcap
from ._hzn import render as render
from ._simulation import evaluate as evaluate
from ._simulation import sensitivity as sensitivity
from ._simulation import simulate as simulate
