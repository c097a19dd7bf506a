"""Deprecated: the old name of `hzn.threshold`."""

import warnings

from .threshold import *  # noqa: F403

warnings.warn("hzn.binarize is now hzn.threshold; the old name will be removed", DeprecationWarning, stacklevel=2)
