"""The settings that all experiments of the arm share."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

from spikeport.errors import unknown
from spikeport.networks.arm import PRESETS, ArmSizes
from spikeport.networks.option_checks import check_counts, check_name_or_file, check_seed

OF_NEURONS = ("preset", "m1", "cb", "s1", "efference_copy")
"""Settings that the exact law has no use for."""

FARTHEST_M = 3.0
"""The largest coordinate or size: beyond the arm's reach, but safe to compute with."""


@dataclass(frozen=True, kw_only=True)
class ArmSettings:
    """Settings of the controller, and the robot's appearance.

    ``preset`` is the size of the controller, ``lean`` or ``paper``; ``m1``, ``cb`` and ``s1`` are
    the neurons for each axis of M1 (motor cortex), each ensemble of CB (cerebellum) and each
    dimension of S1 (somatosensory cortex), by default those of the preset. ``network_seed`` draws
    the neurons. With ``efference_copy`` CB learns from a copy of M1's torque. ``calibrated`` refits
    the torque's decoders to the firing of the neurons on the backend, or names a file that
    ``spikeport calibrate`` wrote, with the decoders. ``appearance`` is the robot's look in
    pictures: ``primitive``, or ``menagerie`` for meshes.
    """

    preset: str = "lean"
    m1: int | None = None
    cb: int | None = None
    s1: int | None = None
    network_seed: int = 0
    efference_copy: bool = False
    calibrated: bool | str = False
    appearance: str = "primitive"

    def __post_init__(self) -> None:
        """Check the values; UsageError says what is wrong."""
        if self.preset not in PRESETS:
            raise unknown("preset", self.preset, PRESETS)
        check_counts(**self._own_sizes())
        check_seed("network_seed", self.network_seed)
        if isinstance(self.calibrated, str):
            check_name_or_file("calibrated", self.calibrated, ("true", "false"))

    @property
    def files(self) -> list[Path]:
        """The files that a run reads."""
        return [Path(self.calibrated)] if isinstance(self.calibrated, str) else []

    def _own_sizes(self) -> dict[str, int]:
        sizes = {"m1": self.m1, "cb": self.cb, "s1": self.s1}
        return {key: value for key, value in sizes.items() if value is not None}

    @property
    def sizes(self) -> ArmSizes:
        """Neuron counts of the controller."""
        return dataclasses.replace(PRESETS[self.preset], **self._own_sizes())
