"""Use of the package that must pass a strict type check; it is not run."""

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


def statuses(path: str) -> dict[str, int]:
    table = hzn.read_mcap(path)
    names, counts = np.unique(table["status"], return_counts=True)
    return dict(zip(names.tolist(), counts.tolist(), strict=True))
