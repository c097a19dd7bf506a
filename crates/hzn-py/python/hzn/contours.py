"""Deprecated: the old name of `hzn.contour`."""

import warnings

from .contour import *  # noqa: F403

warnings.warn("hzn.contours is now hzn.contour; the old name will be removed", DeprecationWarning, stacklevel=2)
