"""The report on a compiled network: resources, energy, time, and the cost of rounding."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, TypeAlias

import numpy as np

from spikeport.compile.check.lost_values import hints_after
from spikeport.compile.check.violation import Offloaded, OnHost, Violation
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.image.expected import ALL, Rates
from spikeport.compile.report import summary
from spikeport.compile.report.neurobench import NeuroBench, workload
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel
from spikeport.hardware_models.energy import ModuleEnergy, energy, module_energies
from spikeport.hardware_models.host_io import Basis, HostIoReport, HostTraffic, host_io
from spikeport.hardware_models.limits import (
    CoreUse,
    Usage,
    limits_of_a_core,
    totals,
    usages,
)
from spikeport.hardware_models.timing import timing
from spikeport.hardware_models.topology import chip_of, tile_xy

Json: TypeAlias = dict[str, Any]
"""Plain data, ready for JSON: a report or a part of it, as ``docs/report.schema.json`` has it."""
SCHEMA = 2
"""Version of the report as plain data; `spikeport.compile.report.schema` is its schema."""


@dataclass(frozen=True)
class Modules:
    """The names of an image's modules, and the activity if each module had a core of its own."""

    names: tuple[str, ...]
    activity: Activity

    def energies(self, chip: ChipModel) -> dict[str, list[ModuleEnergy]]:
        """Return the energy of a step of each module, by calibration."""
        return {
            c.name: module_energies(self.activity, self.names, chip, c) for c in chip.calibrations
        }

    def to_dict(self, chip: ChipModel) -> Json:
        """Return plain data, ready for JSON."""
        return {name: [asdict(one) for one in found] for name, found in self.energies(chip).items()}


@dataclass(frozen=True)
class Report:
    """The resources, placement, errors and hints of a compiled network.

    The report on a network with nothing on the chip has no cores, no traffic and an empty digest.
    So has the report on a network that does not fit.

    Attributes
    ----------
    chip : ChipModel
        The chip.
    digest : str
        The digest of the image.
    cores : tuple of CoreUse
        The use of every core.
    errors : tuple of BlockError
        The rounding error of every block.
    warnings : tuple of str
        The warnings of nengo-loihi's builder.
    placed : tuple of tuples of str
        The names of the blocks on each core.
    passes : tuple of dict
        The name, the options and the findings of every pass.
    lower_bound : mapping of str to int
        Lower bounds of the number of cores, by reason.
    neurobench : NeuroBench or None
        NeuroBench's static metrics; None without an image.
    hints : tuple of Violation
        The hints on parts that are lost or left out.
    offloaded : tuple of Offloaded
        The ensembles that were moved to the host.
    on_host : tuple of OnHost
        The ensembles that were not meant for the chip.
    host : HostTraffic or None
        The traffic with the host; None without an image.
    violations : tuple of Violation
        The reasons why the network does not fit.
    over_budget : tuple of Violation
        The budgets of the user that the network exceeds.
    """

    chip: ChipModel
    digest: str
    cores: tuple[CoreUse, ...]
    errors: tuple[BlockError, ...]
    warnings: tuple[str, ...]
    placed: tuple[tuple[str, ...], ...] = ()
    passes: tuple[Json, ...] = ()
    lower_bound: Mapping[str, int] = field(default_factory=dict)
    neurobench: NeuroBench | None = None
    hints: tuple[Violation, ...] = ()
    offloaded: tuple[Offloaded, ...] = ()
    on_host: tuple[OnHost, ...] = ()
    host: HostTraffic | None = None
    violations: tuple[Violation, ...] = ()
    over_budget: tuple[Violation, ...] = ()

    def __repr__(self) -> str:
        """Return the verdict, on a line."""
        return f"<Report: {summary.verdict(self)}>"

    def __str__(self) -> str:
        """Return the report on one screen."""
        return summary.text(self)

    def _repr_html_(self) -> str:
        """Return the report as a notebook shows it."""
        return summary.as_html(self)

    def resources(self) -> dict[str, Usage]:
        """Return the use of every resource in sum, against the limit of the whole chip."""
        return totals(self.cores, self.chip)

    def fullest(self) -> dict[str, Usage]:
        """Return the use of every resource on its fullest core, against the limit of one core."""
        rows: dict[str, Usage] = {}
        for usage in usages(self.cores, self.chip):
            if usage.resource not in rows or usage.used > rows[usage.resource].used:
                rows[usage.resource] = usage
        return rows

    def host_io(
        self, activity: Activity | None = None, rates: Rates | None = None
    ) -> HostIoReport | None:
        """Return the host's input and output; None without an image. See `to_dict`."""
        if self.host is None:
            return None
        basis: Basis = "run"
        if rates is not None:
            basis = "all rates" if rates.of_host else "rates on the chip"
        return host_io(self.host, self.chip, activity, basis)

    def to_dict(
        self,
        activity: Activity | None = None,
        rates: Rates | None = None,
        loss: Mapping[str, object] | None = None,
        modules: Modules | None = None,
    ) -> Json:
        """Return the report as plain data.

        Parameters
        ----------
        activity : Activity, optional
            The counts of a run, or those expected at ``rates``; without them, the report has no
            energy and timing.
        rates : Rates, optional
            The rates that the counts are expected at; None: the counts are those of a run.
        loss : mapping, optional
            The result of a run on floating-point and on integer blocks, as plain data.
        modules : Modules, optional
            The counts by module; without them, the report has no energy by module.
        """
        return {
            "schema": SCHEMA,
            "chip": self.chip.name,
            "caveat": self.chip.caveat,
            "verdict": summary.verdict(self),
            "fits": not self.violations,
            "violations": [one._asdict() for one in self.violations],
            "over_budget": [one._asdict() for one in self.over_budget],
            "image_digest": self.digest,
            "resources": self._resources(),
            "limits_of_a_core": limits_of_a_core(self.chip),
            "places": places(len(self.cores), self.chip),
            "lower_bound": dict(self.lower_bound),
            "cores": [core._asdict() for core in self.cores],
            "placed": [list(names) for names in self.placed],
            "passes": [dict(one) for one in self.passes],
            "quantisation": [error._asdict() for error in self.errors],
            "neurobench": self._neurobench(activity),
            "hints": [hint._asdict() for hint in self._hints(activity)],
            "offloaded": [one._asdict() for one in self.offloaded],
            "on_host": [one._asdict() for one in self.on_host],
            "warnings": list(self.warnings),
            "basis": _basis(activity, rates),
            **costs(self.chip, activity),
            "host_io": self._host_io(activity, rates),
            "traffic": None if activity is None else traffic(activity),
            "modules": None if modules is None else modules.to_dict(self.chip),
            "loss": None if loss is None else dict(loss),
        }

    def _host_io(self, activity: Activity | None, rates: Rates | None) -> Json | None:
        found = self.host_io(activity, rates)
        return None if found is None else found.to_dict()

    def _resources(self) -> dict[str, dict[str, int | None]]:
        rows = {n: {"used": u.used, "limit": u.limit} for n, u in self.resources().items()}
        rows["cores"]["lower_bound"] = self.lower_bound.get("cores")
        return rows

    def _hints(self, activity: Activity | None) -> Iterable[Violation]:
        if activity is None:
            return self.hints
        # A measured loss has the same hints: each is listed once.
        return dict.fromkeys(hints_after(activity, self.hints))

    def _neurobench(self, activity: Activity | None) -> Json | None:
        if self.neurobench is None:
            return None
        return asdict(self.neurobench) | ({} if activity is None else workload(activity))


def places(n_cores: int, chip: ChipModel) -> Json:
    """Return the places of cores: chip, and column and row of the tile, each a list by core.

    Columns and rows are None where the chip's mesh is not public.
    """
    xy = None if chip.topology is None else tile_xy(n_cores, chip)
    return {
        "chip": chip_of(n_cores, chip).tolist(),
        "x": None if xy is None else xy[:, 0].tolist(),
        "y": None if xy is None else xy[:, 1].tolist(),
    }


def traffic(activity: Activity) -> Json:
    """Return the mean messages of a step: rows of source core, destination core and messages."""
    # Pairs without messages are left out.
    rows, columns = np.nonzero(activity.messages)
    means = activity.messages[rows, columns] / activity.n_steps
    return {
        "between_cores": [
            list(row) for row in zip(rows.tolist(), columns.tolist(), means.tolist(), strict=True)
        ],
        "from_host": (activity.messages_host / activity.n_steps).tolist(),
    }


def _basis(activity: Activity | None, rates: Rates | None) -> Json | None:
    """Return the basis of energy and timing: the steps of a run, or stated rates."""
    if activity is None:
        return None
    stated = None if rates is None else {ALL: rates.others_hz, **rates.by_name_hz}
    return {"n_steps": activity.n_steps, "dt_s": activity.dt_s, "rates_hz": stated}


def costs(chip: ChipModel, activity: Activity | None) -> Json:
    """Return energy and timing in every calibration of a chip; without activity, both are None.

    The timing in a calibration without any time is None.
    """
    if activity is None:
        return {"energy": None, "timing": None}
    timings = {
        c.name: timing(activity, chip, c) if c.has_times else None for c in chip.calibrations
    }
    return {
        "energy": {c.name: energy(activity, chip, c).to_dict() for c in chip.calibrations},
        "timing": {name: taken and taken.to_dict() for name, taken in timings.items()},
    }


def in_result(report: Json | None) -> Json:
    """Return the parts of a report that a run's ``result.json`` repeats; without report, Nones."""
    parts = ("image_digest", "resources", "energy", "timing", "host_io")
    return {key: report and report[key] for key in parts}
