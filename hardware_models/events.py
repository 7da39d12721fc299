"""The events that cost energy and time, and their counts in an activity."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from spikeport.hardware_models import topology
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import ChipModel


class Event(Protocol):
    """A kind of event; its name is that of its figure in a calibration."""

    @property
    def name(self) -> str:
        """Key of the figure."""

    def per_core(self, activity: Activity, chip: ChipModel) -> np.ndarray:
        """Return the number of events on each core, or on the way from it, (n_cores,)."""


@dataclass(frozen=True)
class OnCore:
    """A kind of event that happens on cores: N = sum over steps of a count.

    Parameters
    ----------
    name : str
        Key of the figure.
    counts : str
        The field of the activity that holds the counts, (n_kept, n_cores).
    """

    name: str
    counts: str

    def per_core(self, activity: Activity, chip: ChipModel) -> np.ndarray:
        """See `Event.per_core`."""
        return activity.over_steps(self.counts)

    def per_step(self, activity: Activity) -> np.ndarray:
        """Return the number of events in each kept step on each core, (n_kept, n_cores)."""
        count: np.ndarray = getattr(activity, self.counts)
        return count


@dataclass(frozen=True)
class Messages:
    """Messages: N_msg = messages that a core sends to cores + messages from the host to it.

    A host's spike is counted like a core's: in the fit that the figure is from, the input was
    neurons on cores, which cost nothing but their messages.
    """

    name: str = "message"

    def per_core(self, activity: Activity, chip: ChipModel) -> np.ndarray:
        """See `Event.per_core`."""
        count: np.ndarray = activity.messages.sum(axis=1) + activity.messages_host
        return count


@dataclass(frozen=True)
class Hops:
    """Hops of messages from tile to tile in one direction: H_ew or H_ns of `topology.hops`.

    Parameters
    ----------
    name : str
        Key of the figure.
    direction : str
        The field of `topology.Hops`.
    """

    name: str
    direction: str

    def per_core(self, activity: Activity, chip: ChipModel) -> np.ndarray:
        """See `Event.per_core`."""
        count: np.ndarray = getattr(topology.hops(activity.messages, chip), self.direction)
        return count


@dataclass(frozen=True)
class MessagesBetweenChips:
    """The messages of `topology.messages_between_chips`; no hops are counted for them."""

    name: str = "message_between_chips"

    def per_core(self, activity: Activity, chip: ChipModel) -> np.ndarray:
        """See `Event.per_core`."""
        return topology.messages_between_chips(activity.messages, chip)


SYNAPTIC_OPERATION = OnCore("synaptic_operation", "synaptic_operations")
UPDATE_ACTIVE = OnCore("update_active", "updates_active")
UPDATE_INACTIVE = OnCore("update_inactive", "updates_inactive")
SPIKE = OnCore("spike", "spikes")
MESSAGE_IN = OnCore("message_in", "messages_in")
LEARNING_UPDATE = OnCore("learning_update", "learning_updates")
HOPS_EAST_WEST = Hops("hop_east_west", "east_west")
HOPS_NORTH_SOUTH = Hops("hop_north_south", "north_south")
