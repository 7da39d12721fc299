"""Costs of events in energy and time, from one source."""

from functools import partial
from typing import Annotated

from pydantic import AfterValidator, Field, StrictInt, field_validator

from spikeport.files import Line, Name
from spikeport.hardware_models.figure import Energy, Figure, StrictModel, Time, in_si


class Energies(StrictModel):
    """Energy of one event of each kind, in J; None: no public figure, which is not 0.

    ``update_active`` is the whole update of an active compartment, its access included, and
    ``update_inactive`` only the access. ``message`` is one spike sent to one destination core.
    """

    synaptic_operation: Energy | None = None
    update_active: Energy | None = None
    update_inactive: Energy | None = None
    spike: Energy | None = None
    message: Energy | None = None
    hop_east_west: Energy | None = None
    hop_north_south: Energy | None = None
    message_between_chips: Energy | None = None
    learning_update: Energy | None = None


class Times(StrictModel):
    """Time one event of each kind takes, in s; None: no public figure, which is not 0.

    ``message_on_bus`` is the time of a message on a bus that all cores of a chip share; None: there
    is no such bus.
    """

    synaptic_operation: Time | None = None
    update_active: Time | None = None
    update_inactive: Time | None = None
    spike: Time | None = None
    message_in: Time | None = None
    message_out: Time | None = None
    message_on_bus: Time | None = None
    hop_east_west: Time | None = None
    hop_north_south: Time | None = None
    message_between_chips: Time | None = None
    learning_update: Time | None = None


class BarrierPoint(Figure):
    """Time of the barrier that ends a step, in s, where the chip uses ``tiles`` tiles."""

    tiles: Annotated[StrictInt, Field(ge=1)]


class EnergyCalibration(StrictModel):
    """Energies and times of one source, which belong together.

    Parameters
    ----------
    name, description : str
        Its name, and what was simulated or measured.
    energies, times : Energies, Times
        Cost of each event.
    barrier : tuple of BarrierPoint
        The barrier for numbers of tiles, in increasing order; empty: no public figure.
    """

    name: Name
    description: Line
    energies: Energies = Energies()
    times: Times = Times()
    barrier: tuple[Annotated[BarrierPoint, AfterValidator(partial(in_si, "s"))], ...] = ()

    @field_validator("barrier")
    @classmethod
    def _tiles_increase(cls, points: tuple[BarrierPoint, ...]) -> tuple[BarrierPoint, ...]:
        tiles = [point.tiles for point in points]
        if tiles != sorted(set(tiles)):
            raise ValueError(f"tiles must increase from point to point, not {tiles}")
        return points

    @property
    def has_times(self) -> bool:
        """True if the time of any event has a public figure."""
        return bool(self.barrier) or any(figure is not None for _, figure in self.times)
