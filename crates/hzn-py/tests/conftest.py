import os

import pytest


@pytest.fixture
def hzn_program():
    """The command `hzn` of the same build: cargo xtask test names it."""
    return os.environ["HZN_PROGRAM"]
