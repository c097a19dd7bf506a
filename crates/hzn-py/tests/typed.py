"""Code that uses the package and must pass a strict type check; it is not run."""

import numpy as np
from numpy.typing import NDArray

import hzn


def directions(images: list[NDArray[np.uint8]]) -> NDArray[np.float64]:
    sensor = hzn.Sensor.from_toml("sensor.toml", flight=True)
    found: list[NDArray[np.float64]] = []
    for image in images:
        report = sensor.process(image, altitude_km=230.0, position_km=(6600.0, 0.0, 0.0), detail=True)
        if report.axis is not None and report.covariance is not None:
            found.append(report.covariance @ report.axis)
        picture: NDArray[np.uint8] = hzn.overlay(image, report)
        assert picture.shape[2] == 3
    rays: NDArray[np.float64] = sensor.camera.unproject(np.zeros((1, 2)))
    return np.vstack([*found, rays])


def narrowed(sensor: hzn.Sensor, image: NDArray[np.uint8]) -> NDArray[np.float64]:
    report = sensor.process(image)
    if report.ok:
        return report.covariance @ report.axis
    if other := sensor.process("next.png"):
        return other.covariance * other.sigma_max_deg
    nothing: None = other.axis
    reports: list[hzn.Report] = [report, other]
    assert nothing is None and reports
    return np.zeros((3, 3))


def statuses(path: str) -> dict[str, int]:
    table = hzn.read_mcap(path)
    names, counts = np.unique(table["status"], return_counts=True)
    return dict(zip(names.tolist(), counts.tolist(), strict=True))


def sequence(folder: str) -> list[str]:
    sensor = hzn.Sensor(camera=hzn.Camera.from_opencv(np.eye(3), size=(4, 4)), preset="sun")
    sensor.parameters = {**sensor.parameters, "consensus": {"seed": 2}}
    known = [(np.zeros((4, 4), np.uint8), {"altitude_km": 3.0})]
    found: list[str] = [r.status for images in (folder, known) for r in sensor.process_many(images, jobs=2)]
    with hzn.open_mcap("flight.mcap") as recording:
        for frame in recording:
            if frame.image is not None and frame.report.axis is not None:
                found.append(f"{frame.image.shape} {frame.report.axis[0]}")
    return found


def keys(body: hzn.keys.Body) -> float:
    consensus: hzn.keys.Consensus = {"method": "ransac", "threshold_px": 2, "seed": 3}
    camera = hzn.Camera(width=4, height=4, fx_px=3.0, fy_px=3.0, cx_px=1.5, cy_px=1.5, k=np.zeros(4))
    sensor = hzn.Sensor(camera=camera, preset="hzn", body=body, consensus=consensus, mask={"polygons_px": [[(0, 0), (1, 1)]]})
    sensor = hzn.Sensor(**sensor.parameters, flight=True)
    hzn.Sensor(camera={"file": "camchain.yaml"}, bodies=[body, {"kind": "sun", "threshold": {"method": "fixed"}}])
    parameters = sensor.parameters
    parameters["consensus"]["threshold_px"] = 2.0
    sensor.parameters = parameters
    return parameters["camera"]["fx_px"]


def wrong_keys(camera: hzn.Camera) -> None:
    # Each line is an error of the type checker. A line without its error fails the check, because its comment is unused.
    hzn.Sensor(camera=camera, rejct={})  # type: ignore[call-arg]
    hzn.Sensor(camera=camera, consensus={"treshold_px": 2.0})  # type: ignore[typeddict-unknown-key]
    hzn.Sensor(camera=camera, consensus={"threshold_px": "2"})  # type: ignore[typeddict-item]
    hzn.Sensor(camera=camera, body={"kind": "vulcan"})  # type: ignore[typeddict-item]
    hzn.Sensor(camera=camera, preset="dlr")  # type: ignore[arg-type]
    hzn.Sensor(body={"altitude_km": 230.0})  # type: ignore[call-arg]
    hzn.Camera(widht=4)  # type: ignore[call-arg]
    hzn.Sensor(camera=camera).parameters["consensus"]["treshold_px"] = 2.0  # type: ignore[typeddict-unknown-key]


def simulated() -> float:
    flight = hzn.simulate("horace", frames=3)
    reports = [flight.sensor.process(frame.image, **frame.known) for frame in flight]
    result = hzn.evaluate(reports, flight)
    table = hzn.sensitivity(altitude_km=[100.0, 200.0])
    return float(result["evaluations"][0]["answered"]) + float(table["pitch_free_deg"][0])


def first_start(image: NDArray[np.uint8]) -> NDArray[np.float64] | None:
    sensor = hzn.Sensor.start(size=(640, 480), fov_deg=60, lens="pinhole", altitude_km=500.0)
    picture = hzn.render(sensor, (7000.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), 0.0, world={"name": "mine"}, seed=1)
    report = hzn.Sensor.start("flight/", fov_deg=60, body="moon").process(picture, detail=True)
    report.plot(image, ax=None)
    hzn.Sensor.start(size=(640, 480), fov_deg=60, lens="fish")  # type: ignore[arg-type]
    return report.nadir if report.nadir_error_deg is not None and report.nadir_error_deg < 0.1 else None
