"""A chip as data: its limits, its mesh, its power and the calibrations of its events.

A chip is a TOML file. The files that come with spikeport are in ``chips/``.
"""

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field, StrictBool, ValidationInfo, field_validator

from spikeport.errors import ChipFileError, UsageError, unknown
from spikeport.files import Line, Name, read_model
from spikeport.hardware_models.calibration import EnergyCalibration
from spikeport.hardware_models.figure import Bits, Count, Figure, Power, StrictModel, Time

SCHEMA = 1
BUILT_IN = Path(__file__).parent / "chips"


class Limits(StrictModel):
    """The limits of a chip: cores per chip, chips per board, the rest per core.

    None: not public, which does not mean unlimited. Such a limit is not checked, and reports name
    it.
    """

    cores: Count
    chips: Count
    compartments: Count | None = None
    in_axons: Count | None = None
    out_axons: Count | None = None
    synapse_bits: Bits | None = None
    compartment_profiles: Count | None = None
    threshold_profiles: Count | None = None
    synapse_profiles: Count | None = None

    def most(self, resource: str) -> float:
        """Return the largest amount of a resource on a core; infinity where it is not public."""
        figure: Figure | None = getattr(self, resource)
        return math.inf if figure is None else figure.count


class SynapseMemory(StrictModel):
    """The memory for a core's synapses: lists of words, each list with a header.

    ``population_32_slots`` is the size of an output axon to synapses of population type 32.
    """

    word: Bits
    list_header: Bits
    population_32_slots: Count


class SoftMemory(StrictModel):
    """Blocks of memory that the soft cores of an FPGA share: each core takes those that it fills.

        blocks = port + sum over cores (core + ceil(out_axons / axon_step) + ceil(rows / block))

    ``core`` counts the blocks of a core's memories with a fixed size, and ``port`` those of the
    host's port. Where ``core`` is None, only rows are in these blocks. Rows are 16-bit words, see
    ``hardware_models/softcore/walker.v``; up to ``queue`` messages wait at a core, and the host
    reads up to ``outputs`` values and spikes after a step.
    """

    blocks: Count
    block: Bits
    axon_step: Count
    queue: Count
    outputs: Count
    core: Count | None = None
    port: Count | None = None


class Topology(StrictModel):
    """The mesh of tiles that carries messages between cores."""

    tiles_x: Count
    tiles_y: Count
    cores_per_tile: Count

    @property
    def places(self) -> int:
        """The number of cores that the mesh has room for."""
        return self.tiles_x.count * self.tiles_y.count * self.cores_per_tile.count


class Powers(StrictModel):
    """Power drawn whatever the network does, in W; None: no public figure, which is not 0.

    ``static_chip_w`` is one chip's, ``host_processors_w`` that of the processors on it,
    ``board_idle_w`` that of a whole board, chips included, with no network running.
    """

    static_chip_w: Power | None = None
    host_processors_w: Power | None = None
    board_idle_w: Power | None = None


class HostIo(StrictModel):
    """Input and output of the host.

    ``step`` is the time of a step in which host and chip exchange spikes and values, whatever their
    number, in s; ``word`` and ``packet`` are a word in bits and a packet in words, if public.
    """

    step: Time
    word: Bits | None = None
    packet: Count | None = None


class ChipModel(StrictModel):
    """A chip as data, in SI units, every figure with its source.

    Parameters
    ----------
    schema_version : int
        Version of the file format; ``schema`` in the file.
    name, title : str
        Its names for programs and for people.
    caveat : str
        A warning that every report on the chip contains.
    pipeline : str
        The default passes of a compile, as ``--passes`` takes them.
    limits : Limits
        The resources of a core and of the chip.
    synapse_memory : SynapseMemory or None
        Without a public layout, only bits of weights and indices are counted.
    soft_memory : SoftMemory or None
        Memory that soft cores share; None for manufactured chips.
    clock : Figure or None
        The time of a cycle, in s, where all times are cycles of one clock.
    learns : bool
        True if synapses can learn on it.
    topology : Topology or None
        Without a public mesh, no hops are counted.
    power : Powers
        Static power, for every network.
    host_io : HostIo or None
        Without a published figure, it is unknown whether host and chip keep up with real time.
    calibrations : tuple of EnergyCalibration
        Energies and times of events, one set for each source.
    """

    # pydantic uses the name `schema` itself.
    schema_version: Annotated[int, Field(alias="schema")]
    name: Name
    title: Line
    caveat: Line = ""
    pipeline: Line = ""
    limits: Limits
    synapse_memory: SynapseMemory | None = None
    soft_memory: SoftMemory | None = None
    clock: Time | None = None
    learns: StrictBool = True
    topology: Topology | None = None
    power: Powers = Powers()
    host_io: HostIo | None = None
    calibrations: tuple[EnergyCalibration, ...] = ()

    @field_validator("schema_version")
    @classmethod
    def _schema_is_supported(cls, version: int) -> int:
        if version != SCHEMA:
            raise ValueError(f"version {version} is not supported, only {SCHEMA}")
        return version

    @field_validator("topology")
    @classmethod
    def _cores_have_places(cls, mesh: Topology | None, info: ValidationInfo) -> Topology | None:
        # `limits` is absent if it was refused itself.
        limits = info.data.get("limits")
        if mesh and limits and mesh.places < limits.cores.count:
            raise ValueError(
                f"has places for {mesh.places} cores, but limits.cores is {limits.cores.count}"
            )
        return mesh

    @field_validator("calibrations")
    @classmethod
    def _names_differ(
        cls, calibrations: tuple[EnergyCalibration, ...]
    ) -> tuple[EnergyCalibration, ...]:
        names = [calibration.name for calibration in calibrations]
        if len(set(names)) < len(names):
            raise ValueError(f"two have the same name: {', '.join(names)}")
        return calibrations

    @property
    def n_cores(self) -> int:
        """The number of cores of all chips of the board."""
        return self.limits.cores.count * self.limits.chips.count

    def calibration(self, name: str) -> EnergyCalibration:
        """Return the calibration of a name.

        Raises
        ------
        UsageError
            There is no such calibration; the message lists the known ones.
        """
        by_name = {calibration.name: calibration for calibration in self.calibrations}
        if name not in by_name:
            raise unknown("calibration", name, by_name)
        return by_name[name]


def names() -> list[str]:
    """Return the names of the chips that come with spikeport."""
    return sorted(path.stem for path in BUILT_IN.glob("*.toml"))


def get(name: str) -> ChipModel:
    """Return the chip of a name, or in a file if the name ends in ``.toml``.

    Raises
    ------
    UsageError
        There is no such chip; the message lists the known ones.
    ChipFileError
        The file is wrong; see `load`.
    """
    if files_of(name):
        return load(name)
    if name not in names():
        error = unknown("chip", name, names())
        raise UsageError(f"{error}; the file of a chip ends in .toml") if "." in name else error
    return load(BUILT_IN / f"{name}.toml")


def files_of(name: str) -> list[Path]:
    """Return the file of a chip, if the chip's name is a file's; else an empty list."""
    return [Path(name)] if name.endswith(".toml") else []


def load(path: str | Path) -> ChipModel:
    """Return the chip in a TOML file.

    Raises
    ------
    ChipFileError
        The file cannot be read, is not TOML, or is not a chip; the message gives the path of the
        file, and for every problem the dotted path inside it and the reason.
    """
    return read_model(Path(path), ChipModel, "chip", ChipFileError)
