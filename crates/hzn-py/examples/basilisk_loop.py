"""A satellite of Basilisk that points at the Earth with hzn: simulated orbit, rendered picture, answer, torque.

    pip install hzn-sensor bsk
    python basilisk_loop.py

Three traps wait between the programs. The axis of the limb is not the direction to the Earth's centre, so
`Report.nadir` goes into Basilisk's message. hzn's pixel centres are integers, while Basilisk's principal point is half
the resolution: its modules get points that are moved by half a pixel. And `horizonOpNav` expects square pictures: for
others it scales the field of view, not its tangent.
"""

import numpy as np
from Basilisk.architecture import messaging, sysModel
from Basilisk.fswAlgorithms import horizonOpNav
from Basilisk.simulation import extForceTorque, spacecraft
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros, orbitalMotion, simIncludeGravBody

import hzn

START_S = 1_626_307_200.0  # 2021-07-15T00:00:00Z
SIZE = (640, 480)
FOCAL_PX = 420.0
CAMERA = dict(
    width=SIZE[0], height=SIZE[1], model="pinhole", fx_px=FOCAL_PX, fy_px=FOCAL_PX, cx_px=SIZE[0] / 2 - 0.5, cy_px=SIZE[1] / 2 - 0.5
)
INERTIA = np.diag([12.0, 10.0, 8.0])  # kg m²
NATURAL_RADPS, DAMPING = 0.05, 0.9
PICTURE_EVERY_S = 10


def body_from_camera(depression_deg=24.0):
    """Return the rotation of a camera that looks forward (x) and down to the limb; z of the body points at the Earth."""
    d = np.radians(depression_deg)
    forward = np.array([np.cos(d), 0.0, np.sin(d)])
    down = np.array([-np.sin(d), 0.0, np.cos(d)])
    return np.column_stack([np.cross(down, forward), down, forward])


def ecef_from_inertial(time_s):
    """Return the rotation by the Earth rotation angle."""
    days = (START_S + time_s - 946_728_000.0) / 86_400
    angle = 2 * np.pi * (0.779_057_273_264 + 1.002_737_811_911_354 * days)
    return np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])


def quaternion(rotation):
    """Return the unit quaternion (w, x, y, z) of a rotation matrix."""
    return RigidBodyKinematics.C2EP(rotation.T)  # Basilisk's matrices turn the axes, not the vectors.


def infrared_sensor():
    """Return the world of the scene `leo-infrared`, and a sensor whose noise is measured in it."""
    world = {**hzn.simulate("leo-infrared", frames=1).parameters, "camera": CAMERA}
    return world, hzn.simulate(world, frames=24).sensor


class HorizonSensor(sysModel.SysModel):
    """Renders the camera's picture, finds the limb, and writes Basilisk's message of optical navigation.

    The orbit is known, as a receiver gives it. The attitude is known to `attitude_sigma_deg`, as a controller keeps it;
    it only says in which direction the limb's axis differs from that to the centre.
    """

    def __init__(self, world, sensor, attitude_sigma_deg=5.0):
        super().__init__()
        self.ModelTag = "hzn"
        self.world, self.sensor, self.attitude_sigma_deg = world, sensor, attitude_sigma_deg
        self.mount = body_from_camera()
        self.scStateInMsg = messaging.SCStatesMsgReader()
        self.opNavOutMsg = messaging.OpNavMsg()
        self.report, self.log = None, []

    def UpdateState(self, CurrentSimNanos):
        time_s = CurrentSimNanos * macros.NANO2SEC
        state = self.scStateInMsg()
        ecef = ecef_from_inertial(time_s)
        inertial_from_body = np.array(RigidBodyKinematics.MRP2C(state.sigma_BN)).T
        position_km = ecef @ state.r_BN_N / 1e3
        attitude = quaternion(ecef @ inertial_from_body @ self.mount)
        image = hzn.render(self.sensor, position_km, attitude, START_S + time_s, world=self.world)
        self.report = self.sensor.process(
            image,
            position_km=position_km,
            attitude=attitude,
            attitude_sigma_deg=self.attitude_sigma_deg,
            time_s=START_S + time_s,
            detail=True,
        )
        self.opNavOutMsg.write(self.message(position_km, time_s), CurrentSimNanos, self.moduleID)
        centre = self.mount.T @ inertial_from_body.T @ -np.array(state.r_BN_N)
        self.log.append((time_s, self.report, centre / np.linalg.norm(centre), attitude))

    def message(self, position_km, time_s):
        """Return the position as seen by the camera: minus the direction to the centre, times the known distance."""
        message = messaging.OpNavMsgPayload()
        message.timeTag, message.planetID, message.valid = time_s, 1, int(self.report.ok)
        if self.report:
            range_m = 1e3 * np.linalg.norm(position_km)
            r_camera = -range_m * self.report.nadir
            covariance = range_m**2 * self.report.covariance
            message.r_BN_C, message.covar_C = r_camera.tolist(), covariance.ravel().tolist()
            message.r_BN_B = (self.mount @ r_camera).tolist()
            message.covar_B = (self.mount @ covariance @ self.mount.T).ravel().tolist()
        return message


class Pointing(sysModel.SysModel):
    """Turns z of the body to the Earth. Between two pictures the gyroscope carries the last direction on."""

    def __init__(self, rate_radps):
        super().__init__()
        self.ModelTag = "pointing"
        self.scStateInMsg = messaging.SCStatesMsgReader()
        self.opNavInMsg = messaging.OpNavMsgReader()
        self.cmdTorqueOutMsg = messaging.CmdTorqueBodyMsg()
        self.wanted = np.array([0.0, -rate_radps, 0.0])
        self.down, self.seen_s, self.errors = None, -1.0, []

    def UpdateState(self, CurrentSimNanos):
        state, seen = self.scStateInMsg(), self.opNavInMsg()
        rate = np.array(state.omega_BN_B)
        if seen.valid and seen.timeTag > self.seen_s:
            self.down, self.seen_s = -np.array(seen.r_BN_B) / np.linalg.norm(seen.r_BN_B), seen.timeTag
        elif self.down is not None:
            self.down = self.down - np.cross(rate - self.wanted, self.down)  # over one second
        torque = np.zeros(3)
        if self.down is not None:
            torque = INERTIA @ (
                NATURAL_RADPS**2 * np.cross([0.0, 0.0, 1.0], self.down) - 2 * DAMPING * NATURAL_RADPS * (rate - self.wanted)
            ) + np.cross(rate, INERTIA @ rate)
        command = messaging.CmdTorqueBodyMsgPayload()
        command.torqueRequestBody = torque.tolist()
        self.cmdTorqueOutMsg.write(command, CurrentSimNanos, self.moduleID)
        centre = np.array(RigidBodyKinematics.MRP2C(state.sigma_BN)) @ -np.array(state.r_BN_N)
        off = np.degrees(np.arctan2(np.hypot(*centre[:2]), centre[2]))
        self.errors.append((CurrentSimNanos * macros.NANO2SEC, off))


def fly(world, sensor, duration_s=None, off_deg=(3.0, -2.0, 1.0)):
    """Fly one orbit at 600 km, off by these angles at first. Return the log of the sensor and the pointing errors."""
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("dynamics", macros.sec2nano(1.0)))
    process.addTask(simulation.CreateNewTask("camera", macros.sec2nano(float(PICTURE_EVERY_S))))
    craft = spacecraft.Spacecraft()
    craft.hub.mHub, craft.hub.IHubPntBc_B = 50.0, INERTIA.tolist()
    gravity = simIncludeGravBody.gravBodyFactory()
    earth = gravity.createEarth()
    earth.isCentralBody = True
    gravity.addBodiesTo(craft)
    orbit = orbitalMotion.ClassicElements()
    orbit.a, orbit.e, orbit.i = earth.radEquator + 600e3, 1e-4, np.radians(97.8)
    orbit.Omega, orbit.omega, orbit.f = np.radians(30.0), 0.0, 0.0
    r, v = orbitalMotion.elem2rv(earth.mu, orbit)
    rate_radps = np.sqrt(earth.mu / orbit.a**3)
    along, across = np.array(v) / np.linalg.norm(v), -np.cross(r, v) / np.linalg.norm(np.cross(r, v))
    level = np.array([np.cross(across, -r / np.linalg.norm(r)), across, -r / np.linalg.norm(r)])
    assert level[0] @ along > 0.99
    turn = np.array(RigidBodyKinematics.euler3212C(np.radians(off_deg[::-1])))
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = r, v
    craft.hub.sigma_BNInit = RigidBodyKinematics.C2MRP(turn @ level)
    craft.hub.omega_BN_BInit = (turn @ [0.0, -rate_radps, 0.0]).tolist()
    torque = extForceTorque.ExtForceTorque()
    craft.addDynamicEffector(torque)
    horizon, pointing = HorizonSensor(world, sensor), Pointing(rate_radps)
    horizon.scStateInMsg.subscribeTo(craft.scStateOutMsg)
    pointing.scStateInMsg.subscribeTo(craft.scStateOutMsg)
    pointing.opNavInMsg.subscribeTo(horizon.opNavOutMsg)
    torque.cmdTorqueInMsg.subscribeTo(pointing.cmdTorqueOutMsg)
    for task, module, priority in [("dynamics", craft, 30), ("camera", horizon, 20), ("dynamics", pointing, 10), ("dynamics", torque, 40)]:
        simulation.AddModelToTask(task, module, priority)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(duration_s or 2 * np.pi / rate_radps))
    simulation.ExecuteSimulation()
    return horizon.log, pointing.errors


def basilisks_direction(report, attitude):
    """Return the direction to the centre that Basilisk's horizonOpNav finds in the points of an answer."""
    # The picture in the middle of a square one.
    points = report.inliers + [0.5, 0.5 + (SIZE[0] - SIZE[1]) / 2]
    limb = messaging.OpNavLimbMsgPayload()
    limb.valid, limb.numLimbPoints, limb.planetIds = 1, len(points), 1
    limb.limbPoints = points.ravel().tolist()
    camera = messaging.CameraConfigMsgPayload()
    camera.fieldOfView, camera.resolution = 2 * np.arctan(SIZE[0] / 2 / FOCAL_PX), [SIZE[0], SIZE[0]]
    camera.sigma_CB = [0.0, 0.0, 0.0]
    body = messaging.NavAttMsgPayload()
    body.sigma_BN = (np.array(attitude[1:]) / (1 + attitude[0])).tolist()
    module = horizonOpNav.horizonOpNav()
    module.planetTarget, module.noiseSF = 1, 1.0
    written = messaging.OpNavLimbMsg().write(limb), messaging.CameraConfigMsg().write(camera), messaging.NavAttMsg().write(body)
    module.limbInMsg.subscribeTo(written[0])
    module.cameraConfigInMsg.subscribeTo(written[1])
    module.attInMsg.subscribeTo(written[2])
    module.SelfInit()
    module.Reset(0)
    module.UpdateState(0)
    position = -np.array(module.opNavOutMsg.read().r_BN_C)
    return position / np.linalg.norm(position)


def angle_deg(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def main():
    log, errors = fly(*infrared_sensor())
    answers = [entry for entry in log if entry[1].ok]
    off = np.array([angle_deg(report.nadir, centre) for _, report, centre, _ in answers])
    sigma = np.array([report.sigma_max_deg for _, report, _, _ in answers])
    axis = np.array([angle_deg(report.axis, centre) for _, report, centre, _ in answers])
    theirs = np.array([angle_deg(basilisks_direction(report, attitude), centre) for _, report, centre, attitude in answers])
    settled = np.array([error for time_s, error in errors if time_s > 600])
    print(f"{len(answers)} of {len(log)} pictures answered")
    print(f"to the centre, RMS: nadir {rms(off):.4f} deg (sigma {rms(sigma):.4f}), limb axis {rms(axis):.4f} deg")
    print(f"horizonOpNav on the same points, RMS: {rms(theirs):.4f} deg")
    print(f"pointing after 600 s: RMS {rms(settled):.4f} deg, at most {settled.max():.4f} deg")


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


if __name__ == "__main__":
    main()
