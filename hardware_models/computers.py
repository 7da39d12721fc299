"""Conventional computers: their energy for the same operations, and break-even with a chip."""

from functools import cache
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field, StrictInt

from spikeport.errors import ChipFileError
from spikeport.files import Name, read_model
from spikeport.hardware_models.figure import Energy, Power, StrictModel

FILE = Path(__file__).with_name("computers.toml")


class Computer(StrictModel):
    """A computer that others measured.

    Parameters
    ----------
    name : str
        Its name.
    macs : int
        Multiplications and additions of one inference of the network that was measured.
    energy : Figure
        Energy of that inference, in J, above what the computer draws at rest where that is known.
    idle : Figure or None
        Power at rest, in W; None where ``energy`` holds all that was drawn.
    """

    name: Name
    macs: Annotated[StrictInt, Field(ge=1)]
    energy: Energy
    idle: Power | None = None

    def for_macs(self, macs: int) -> float:
        """Return the energy of ``macs`` operations in J, in proportion, without idle power."""
        return self.energy.value * macs / self.macs

    def in_period(self, macs: int, period_s: float) -> float:
        """Return the energy in J of ``macs`` operations, and of idle power over a period."""
        idle_w = 0.0 if self.idle is None else self.idle.value
        return self.for_macs(macs) + idle_w * period_s


class Computers(StrictModel):
    """The computers of a file."""

    # pydantic uses the name `schema` itself.
    schema_version: Annotated[int, Field(alias="schema", ge=1, le=1)]
    computers: tuple[Computer, ...]


@cache
def built_in() -> tuple[Computer, ...]:
    """Return the computers that come with spikeport."""
    return read_model(FILE, Computers, "file of computers", ChipFileError).computers


class OnChip(NamedTuple):
    """The cost of a network on a chip.

    Attributes
    ----------
    synaptic_operations : float
        Mean number in a step.
    synaptic_operation_j : float
        Energy of one synaptic operation.
    other_j : float
        Dynamic energy of a step for all other events.
    static_w : float
        Power of the chip at rest.
    dt_s : float
        Length of a step.
    """

    synaptic_operations: float
    synaptic_operation_j: float
    other_j: float
    static_w: float
    dt_s: float

    @property
    def dynamic_j(self) -> float:
        """Dynamic energy of a step, in J."""
        return self.synaptic_operations * self.synaptic_operation_j + self.other_j

    @property
    def power_w(self) -> float:
        """Dynamic and static power, in W."""
        return self.dynamic_j / self.dt_s + self.static_w


class BreakEven(NamedTuple):
    """Values with which chip and computer draw the same power, if that value alone is changed.

    None: there is no such value above 0.

    Attributes
    ----------
    synaptic_operations : float or None
        Synaptic operations of a step.
    dynamic_j : float or None
        Dynamic energy of a step, in J.
    static_w : float or None
        Power of the chip at rest.
    rate_hz : float or None
        Rate at which the computer computes; None where it draws more than the chip even at rest.
    """

    synaptic_operations: float | None
    dynamic_j: float | None
    static_w: float | None
    rate_hz: float | None


def break_even(chip: OnChip, computer: Computer, macs: int, rate_hz: float) -> BreakEven:
    """Return where a chip draws as much as a computer that repeats ``macs`` operations at a rate.

        P_computer = f E_mac macs + P_idle,   P_chip = (n e_syn + e_other) / dt + P_static

    Parameters
    ----------
    chip : OnChip
        The network on the chip, at work in every step.
    computer : Computer
        The computer, at work at ``rate_hz`` and idle in between.
    macs, rate_hz : int, float
        Operations of a period, and periods in a second.
    """
    computer_w = computer.in_period(macs, 1 / rate_hz) * rate_hz
    dynamic_j = (computer_w - chip.static_w) * chip.dt_s
    at_rest_w = 0.0 if computer.idle is None else computer.idle.value
    return BreakEven(
        _above_zero(dynamic_j - chip.other_j, chip.synaptic_operation_j),
        _above_zero(dynamic_j),
        _above_zero(computer_w - chip.dynamic_j / chip.dt_s),
        _above_zero(chip.power_w - at_rest_w, computer.for_macs(macs)),
    )


def _above_zero(number: float, by: float = 1.0) -> float | None:
    """Return a quotient; None if it is not above 0, or if no number of steps would reach it."""
    return number / by if by and number > 0 else None
