"""The events that cost energy and time, and where an activity holds their counts."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from spikeport.hardware_models import topology
from spikeport.hardware_models.activity import Activity
from spikeport.hardware_models.chip import Chip


class Event(Protocol):
    """A kind of event; its name is that of its figure in a calibration."""

    @property
    def name(self) -> str:
        """Key of the figure."""

    def count(self, activity: Activity, chip: Chip) -> int:
        """How often it happened in the run."""


@dataclass(frozen=True)
class OnCore:
    """N = sum over steps and cores of a count.

    Parameters
    ----------
    name : str
        Key of the figure.
    counts : str
        The field of the activity, of (n_steps, n_cores), that holds the counts.
    """

    name: str
    counts: str

    def count(self, activity: Activity, chip: Chip) -> int:
        """See `Event.count`."""
        return int(self.per_core(activity).sum())

    def per_core(self, activity: Activity) -> np.ndarray:
        """How often it happened in each step on each core, (n_steps, n_cores)."""
        return getattr(activity, self.counts)


@dataclass(frozen=True)
class Messages:
    """N_msg = messages between cores + messages from the host.

    A host's spike is counted like a core's: the fit this figure is from had its input as neurons
    on cores, free but for their messages.
    """

    name: str = "message"

    def count(self, activity: Activity, chip: Chip) -> int:
        """See `Event.count`."""
        return int(activity.messages.sum() + activity.messages_host.sum())


@dataclass(frozen=True)
class HopsEastWest:
    """H_ew of `topology.hops`."""

    name: str = "hop_east_west"

    def count(self, activity: Activity, chip: Chip) -> int:
        """See `Event.count`."""
        return topology.hops(activity.messages, chip).east_west


@dataclass(frozen=True)
class HopsNorthSouth:
    """H_ns of `topology.hops`."""

    name: str = "hop_north_south"

    def count(self, activity: Activity, chip: Chip) -> int:
        """See `Event.count`."""
        return topology.hops(activity.messages, chip).north_south


SYNAPTIC_OPERATION = OnCore("synaptic_operation", "synaptic_operations")
UPDATE_ACTIVE = OnCore("update_active", "updates_active")
UPDATE_INACTIVE = OnCore("update_inactive", "updates_inactive")
SPIKE = OnCore("spike", "spikes")
MESSAGE_IN = OnCore("message_in", "messages_in")
LEARNING_UPDATE = OnCore("learning_update", "learning_updates")
