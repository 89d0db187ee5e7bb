"""What all tests share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Checks of a change are the same each time; whoever works on the code tries other examples with every run.
settings.register_profile("checks", derandomize=True, deadline=None)
settings.register_profile("work", deadline=None)
settings.load_profile("checks" if os.environ.get("CI") else "work")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def scenarios() -> Path:
    """The shipped scenarios."""
    return ROOT / "scenarios"


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """Folder of real measurements and oracles made by others; set NETSIM_DATA if it is not beside the checkout."""
    folder = Path(os.environ.get("NETSIM_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}: set NETSIM_DATA to the folder that holds it")
    return folder
