"""Lets these tests use the images of the native backend's tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "native"))
