"""What is drawn into pictures of the arm: its target, and where the hand went."""

from collections.abc import Callable

from spikeport.experiments.arm.loop import Recording
from spikeport.experiments.pictures import Marks
from spikeport.robot.render import Mark

TRACE_MARKS = 800
TARGET_RGBA = (0.95, 0.45, 0.05, 1.0)
TRACE_RGBA = (0.1, 0.65, 0.25, 1.0)

TraceSince = Callable[[float], float]
"""From when on (s) the hand's trace is shown at a moment (s)."""


def arm_marks(recording: Recording, trace_since: TraceSince) -> Marks:
    """The target, and where the hand went lately, thinned where there are too many samples."""

    def marks(end: int) -> list[Mark]:
        now_s = recording.time_s[end - 1]
        trace = recording.hand[:end][recording.time_s[:end] >= trace_since(now_s)]
        thinned = trace[:: 2 + len(trace) // TRACE_MARKS]
        target = Mark(tuple(recording.target[end - 1]), 0.025, TARGET_RGBA)
        return [target, *(Mark(tuple(hand), 0.004, TRACE_RGBA) for hand in thinned)]

    return marks
