"""Draws a report with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._hzn import Report


def plot(report: Report, picture: NDArray[np.uint8] | None, size: tuple[int, int] | None, ax: Any) -> Any:
    """Draw the picture (RGB) of this size with limb, points and the answer in words into ``ax`` or a new figure."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as missing:
        raise ImportError("Report.plot needs matplotlib: pip install matplotlib") from missing
    if ax is None:
        _, ax = plt.subplots(layout="constrained")
    ax.set_aspect("equal")
    if picture is not None:
        ax.imshow(picture)
        size = picture.shape[1], picture.shape[0]
    for number, each in enumerate([report, *report.others]):
        _draw(each, ax, is_first=number == 0)
    if size is not None:
        # The limb may go on beyond the picture.
        ax.set_xlim(-0.5, size[0] - 0.5)
        ax.set_ylim(size[1] - 0.5, -0.5)
    elif not ax.yaxis_inverted():
        ax.invert_yaxis()
    ax.set_xlabel("u, px")
    ax.set_ylabel("v, px")
    ax.set_title("\n".join(_words(each) for each in [report, *report.others]), fontsize="small", loc="left")
    if ax.get_legend_handles_labels()[0]:
        # Beside the axes it covers neither the limb nor its points.
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small")
    return ax


def _draw(report: Report, ax: Any, *, is_first: bool) -> None:
    """Draw the limb and the points of one body. The legend names them once."""

    def name(label: str) -> str:
        return label if is_first else "_" + label

    for number, line in enumerate(report.limb):
        ax.plot(*line.T, color="gold", linewidth=1.2, zorder=3, label=name("fitted limb") if number == 0 else None)
    try:
        points = [("inliers", report.inliers, "limegreen"), ("rejected points", report.rejected, "red")]
    except ValueError:
        return  # Only `detail=True` keeps points.
    for label, at, color in points:
        if len(at):
            ax.plot(*at.T, ".", color=color, markersize=2.5, label=name(label))


def _words(report: Report) -> str:
    """Say the answer, or why there is none."""
    if report.axis is None or report.sigma_max_deg is None:
        return f"{report.body}: {report.status} {report.detail}".strip()
    x, y, z = report.axis
    words = f"{report.body}: axis ({x:.4f}, {y:.4f}, {z:.4f}), sigma {report.sigma_max_deg:.3f} deg"
    if report.altitude_est_km is not None and report.altitude_est_sigma_km is not None:
        words += f", altitude {report.altitude_est_km:.0f} ± {report.altitude_est_sigma_km:.0f} km"
    return words
