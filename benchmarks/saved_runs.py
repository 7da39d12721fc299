"""Runs for the benchmarks: one rig for many runs, one file for each finished run."""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from spikeport.atomic import write_text
from spikeport.digest import digest_of
from spikeport.experiments.policy.readout import policy_digest
from spikeport.networks.walking_policy import WalkingPolicy

CALIBRATION = "nahuku-fit"
"""The calibration by which energies are estimated."""


def policy_key(policy: WalkingPolicy) -> str:
    """Return a name that differs from policy to policy, also if only the follower's gains do."""
    return f"{policy_digest(policy.layers)}-{digest_of(policy.gains)[:12]}"


@dataclass
class Clock:
    """Real-time factor of a simulation in this process's CPU time, taken from its progress."""

    share: list[float] = field(default_factory=list)
    cpu_s: list[float] = field(default_factory=list)

    def __call__(self, what: str, share: float | None) -> None:
        """See `spikeport.progress.Progress`."""
        if what == "simulating" and share is not None:
            self.share.append(share)
            self.cpu_s.append(time.process_time())

    def factor(self, seconds: float) -> float:
        """Return the simulated time over CPU time."""
        return seconds * (self.share[-1] - self.share[0]) / (self.cpu_s[-1] - self.cpu_s[0])


def saved_results(
    folder: Path,
    name: str,
    trials: Mapping[Any, Any],
    prepare: Callable[[Any], Any],
    perform: Callable[[Any, Any], dict[str, Any]],
) -> Iterator[dict[str, Any]]:
    """Yield the figures of trials with the same rig; finished ones are read from their files."""
    rig: Any = None
    try:
        for key, trial in trials.items():
            file = folder / f"{name}-{key}.json"
            if not file.exists():
                rig = rig or prepare(trial)
                write_text(file, json.dumps(perform(trial, rig), indent=2))
            yield json.loads(file.read_text(encoding="utf-8"))
    finally:
        if rig is not None:
            rig.sim.close()
