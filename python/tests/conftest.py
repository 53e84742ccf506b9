"""What the tests share: the program `dermis`, whose results the package must equal."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def dermis(*arguments: str) -> str:
    """Standard output of the program, which `make python` names in the variable DERMIS."""
    program = os.environ["DERMIS"]
    command = [program, "--build-dir", str(ROOT / "build"), *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def searching() -> str:
    """A scene of 10 by 10 taxels that takes the search and states no noise."""
    return """
[sensor]
rows = 10
cols = 10
pitch_x_mm = 4.0
pitch_y_mm = 4.0
thickness_mm = 3.0

[search]
estimator = "search"
"""
