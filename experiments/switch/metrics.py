"""The figures of a switching run."""

from typing import Any

from spikeport.experiments.arm import digit_reader
from spikeport.experiments.arm.draw_task import Sheet
from spikeport.experiments.switch.phases import drawn, phase_metrics
from spikeport.experiments.switch.trial import SwitchRun


def metrics(run: SwitchRun) -> dict[str, Any]:
    """All metrics of a run.

    - ``falls``: 1 if the robot fell, which ends the run, else 0; ``fallen_at_s``: when;
    - ``phases``: see `experiments.switch.phases.phase_metrics`;
    - ``recognised_as``: the digit a classifier reads in the first drawing, None where there is
      none, or no classifier;
    - ``spikes_by_nucleus``: of the action selection;
    - ``spikes_per_second``: of all neurons;
    - ``readout_spikes``: spikes of read-outs, 0 unless one saturated; None off the chip;
    - ``real_time_factor``: simulated over wall-clock time of the loop, physics included.
    """
    sim = run.sim
    return {
        "falls": int(run.fallen_at_s is not None),
        "fallen_at_s": run.fallen_at_s,
        "phases": phase_metrics(run),
        "recognised_as": _recognised(run),
        "spikes_by_nucleus": {name: int(spikes.sum()) for name, spikes in run.spikes.items()},
        "spikes_per_second": sim.activity.totals()["spikes"] / sim.time,
        "readout_spikes": None if sim.image is None else sim.activity.readout_spikes,
        "real_time_factor": sim.time / run.wall_s,
    }


def _recognised(run: SwitchRun) -> int | None:
    drawings = [drawn(run, goal) for goal in run.goals]
    first = next(filter(len, drawings), None)
    if first is None or not digit_reader.can_read():
        return None
    return digit_reader.read_digit(Sheet().read(first))
