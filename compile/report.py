"""The report on a compiled network: resources, energy, time, and what rounding cost."""

from dataclasses import dataclass
from typing import Any

from spikeport.compile.quantisation import BlockError
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import Chip
from spikeport.hardware_models.energy import energy
from spikeport.hardware_models.limits import CoreUse, Usage, totals, usages
from spikeport.hardware_models.timing import timing


@dataclass(frozen=True)
class Report:
    """What a compiled network takes.

    ``cores`` holds the use of every core, ``errors`` the quantisation error of every block,
    ``warnings`` what nengo-loihi's builder said on the way.
    """

    chip: Chip
    digest: str
    cores: tuple[CoreUse, ...]
    errors: tuple[BlockError, ...]
    warnings: tuple[str, ...]

    def resources(self) -> dict[str, Usage]:
        """Every resource: used in sum against the limit of the whole chip."""
        return totals(self.cores, self.chip)

    def fullest(self) -> dict[str, Usage]:
        """Every resource on the core that uses most of it, against the limit of one core."""
        rows: dict[str, Usage] = {}
        for usage in usages(self.cores, self.chip):
            if usage.resource not in rows or usage.used > rows[usage.resource].used:
                rows[usage.resource] = usage
        return rows

    def to_dict(self, activity: Activity | None = None) -> dict[str, Any]:
        """The report as plain data; energy and timing where a run's activity is given."""
        return {
            "chip": self.chip.name,
            "image_digest": self.digest,
            "resources": {
                name: {"used": u.used, "limit": u.limit} for name, u in self.resources().items()
            },
            "cores": [core._asdict() for core in self.cores],
            "quantisation": [error._asdict() for error in self.errors],
            "warnings": list(self.warnings),
            **costs(self.chip, activity),
        }


def costs(chip: Chip, activity: Activity | None) -> dict[str, Any]:
    """Energy and timing of a run in every calibration of a chip; None for both without a run."""
    if activity is None:
        return {"energy": None, "timing": None}
    return {
        "energy": {c.name: energy(activity, chip, c).to_dict() for c in chip.calibrations},
        "timing": {c.name: timing(activity, chip, c).to_dict() for c in chip.calibrations},
    }
