"""Lets the tests import what lies beside them, and the hand-made images of the native tests."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1] / "native")]
