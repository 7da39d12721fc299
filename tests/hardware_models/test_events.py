"""Counts of events, per core and per step."""

import numpy as np

from spikeport.hardware_models import events
from spikeport.hardware_models.events import (
    HOPS_EAST_WEST,
    HOPS_NORTH_SOUTH,
    Messages,
    MessagesBetweenChips,
)

# the toy chip: tiles of two cores, two by two


def test_events_on_a_core_are_summed_over_steps(chip, make_activity):
    activity = make_activity(spikes=[[1, 0], [2, 5]])
    assert events.SPIKE.per_step(activity).tolist() == [[1, 0], [2, 5]]
    assert events.SPIKE.per_core(activity, chip).tolist() == [3, 5]
    assert events.SYNAPTIC_OPERATION.per_core(activity, chip).tolist() == [0, 0]


def test_messages_are_counted_at_their_sender_and_those_of_the_host_where_they_arrive(
    chip, make_activity
):
    activity = make_activity(messages=[[7, 4], [2, 0]], messages_host=[1, 10])
    assert Messages().per_core(activity, chip).tolist() == [11 + 1, 2 + 10]


def test_hops_lead_from_tile_to_tile(chip, make_activity):
    messages = np.zeros((8, 8), dtype=int)
    messages[0, 1] = 100  # within a tile
    messages[0, 2] = 3  # to the tile above
    messages[0, 6] = 5  # diagonally
    messages[4, 0] = 7  # from the tile beside it
    activity = make_activity(n_cores=8, messages=messages)
    east_west = HOPS_EAST_WEST.per_core(activity, chip)
    north_south = HOPS_NORTH_SOUTH.per_core(activity, chip)
    assert (east_west.sum(), north_south.sum()) == (5 + 7, 3 + 5)
    assert MessagesBetweenChips().per_core(activity, chip).sum() == 0


def test_every_event_has_the_name_of_a_figure(chip):
    energies, times = chip.calibration("bench").energies, chip.calibration("bench").times
    messages = Messages(), HOPS_EAST_WEST, HOPS_NORTH_SOUTH, MessagesBetweenChips()
    names = [one.name for one in messages]
    assert set(names) <= set(type(energies).model_fields)
    on_core = (events.SYNAPTIC_OPERATION, events.UPDATE_ACTIVE, events.UPDATE_INACTIVE)
    on_core += (events.SPIKE, events.MESSAGE_IN, events.LEARNING_UPDATE)
    assert {one.name for one in on_core} <= set(type(times).model_fields)
