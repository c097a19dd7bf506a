"""Deprecated: the old name of `hzn.consensus`."""

import warnings

from .consensus import *  # noqa: F403

warnings.warn("hzn.ransac is now hzn.consensus; the old name will be removed", DeprecationWarning, stacklevel=2)
