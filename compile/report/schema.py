"""The schema of the report as plain data, which ``spikeport compile --json`` writes.

`schema` returns its JSON Schema, which ``docs/report.schema.json`` publishes.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, create_model

from spikeport.compile.check.violation import Offloaded, OnHost, Violation
from spikeport.compile.ground.quantisation import BlockError
from spikeport.compile.report.loss import Loss
from spikeport.compile.report.neurobench import NeuroBench
from spikeport.compile.report.report import SCHEMA, Json
from spikeport.hardware_models.energy import EnergyReport, ModuleEnergy
from spikeport.hardware_models.host_io import HostIoReport
from spikeport.hardware_models.limits import CoreUse
from spikeport.hardware_models.timing import TimingReport

STRICT = ConfigDict(extra="forbid")


def _row(named_tuple: type[tuple[object, ...]]) -> type[BaseModel]:
    """Return a model of the mapping that a named tuple's ``_asdict`` returns."""
    fields: dict[str, Any] = {
        name: (kind, ...) for name, kind in named_tuple.__annotations__.items()
    }
    return create_model(
        named_tuple.__name__, __config__=STRICT, __doc__=named_tuple.__doc__, **fields
    )


class Resource(BaseModel):
    """Use of a resource by all cores. ``limit`` null: not public. Only cores have a lower bound."""

    model_config = STRICT

    used: int
    limit: int | None
    lower_bound: int | None = None


class PassRecord(BaseModel):
    """A pass that ran, with its options and what it found."""

    model_config = STRICT

    name: str
    options: dict[str, object]
    notes: dict[str, object]


class Basis(BaseModel):
    """Source of energy and timing: the counts of a run, or stated rates where they are not null."""

    model_config = STRICT

    n_steps: int
    dt_s: float
    rates_hz: dict[str, float] | None


class Places(BaseModel):
    """Chip of every core, and column and row of its tile; null where the mesh is not public."""

    model_config = STRICT

    chip: list[int]
    x: list[int] | None
    y: list[int] | None


class Traffic(BaseModel):
    """Mean messages of a step: source core, destination core and messages; and from the host."""

    model_config = STRICT

    between_cores: list[tuple[int, int, float]]
    from_host: list[float]


class ReportData(BaseModel):
    """Report of spikeport on a compiled network. SI units throughout."""

    model_config = STRICT

    # `schema` is a name of pydantic's own.
    schema_version: int = Field(alias="schema", ge=SCHEMA, le=SCHEMA)
    chip: str
    caveat: str
    verdict: str
    fits: bool
    violations: list[_row(Violation)]  # type: ignore[valid-type]
    over_budget: list[_row(Violation)] = []  # type: ignore[valid-type]
    image_digest: str
    resources: dict[str, Resource]
    limits_of_a_core: dict[str, int | None]
    places: Places
    lower_bound: dict[str, int]
    cores: list[_row(CoreUse)]  # type: ignore[valid-type]
    placed: list[list[str]]
    passes: list[PassRecord]
    quantisation: list[_row(BlockError)]  # type: ignore[valid-type]
    neurobench: NeuroBench | None
    hints: list[_row(Violation)]  # type: ignore[valid-type]
    offloaded: list[_row(Offloaded)]  # type: ignore[valid-type]
    on_host: list[_row(OnHost)] = []  # type: ignore[valid-type]
    warnings: list[str]
    basis: Basis | None
    energy: dict[str, EnergyReport] | None
    timing: dict[str, TimingReport | None] | None
    host_io: HostIoReport | None
    traffic: Traffic | None
    modules: dict[str, list[ModuleEnergy]] | None
    loss: Loss | None


def schema() -> Json:
    """Return the JSON Schema of a report."""
    return ReportData.model_json_schema(by_alias=True)
