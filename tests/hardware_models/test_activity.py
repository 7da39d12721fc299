from dataclasses import replace

import numpy as np
import pytest

from spikeport.errors import UsageError
from spikeport.hardware_models.activity import Activity


def test_counts_of_a_wrong_shape_are_refused(make_activity):
    with pytest.raises(ValueError, match="messages_in") as caught:
        make_activity(messages_in=[[1, 2, 3]])
    assert str(caught.value) == "messages_in has shape (1, 3), not (2, 2) (n_kept, n_cores)"
    with pytest.raises(ValueError, match="messages") as caught:
        make_activity(messages=[1, 2])
    assert str(caught.value) == "messages has shape (2,), not (2, 2) (n_cores, n_cores)"
    with pytest.raises(ValueError, match="messages_host") as caught:
        make_activity(messages_host=[1])
    assert str(caught.value) == "messages_host has shape (1,), not (2,) (n_cores,)"
    with pytest.raises(ValueError, match="host_spikes") as caught:
        make_activity(host_spikes=[1])
    assert str(caught.value) == "host_spikes has shape (1,), not (2,) (n_kept,)"


def test_counts_that_are_not_numbers_are_refused(make_activity):
    with pytest.raises(ValueError, match=r"^spikes is of bool, but counts are numbers$"):
        make_activity(spikes=[[False, True], [True, True]])


def test_totals_of_a_run_are_integers_and_expected_ones_may_be_fractions(make_activity):
    assert repr(make_activity(spikes=[[0, 1], [2, 3]]).totals()["spikes"]) == "6"
    expected = make_activity(n_steps=1, spikes=[[0.25, 1.5]])
    assert expected.totals()["spikes"] == 1.75


def test_totals_and_sums_per_core_add_up_every_step(make_activity):
    activity = make_activity(
        spikes=[[1, 2], [3, 4]],
        messages=[[5, 6], [7, 8]],
        messages_host=[9, 0],
        host_spikes=[3, 6],
        readout_spikes=2,
    )
    assert activity.n_steps == 2
    assert activity.totals() == {
        "spikes": 10,
        "synaptic_operations": 0,
        "updates_active": 0,
        "updates_inactive": 0,
        "messages_in": 0,
        "learning_updates": 0,
        "messages": 26,
        "messages_host": 9,
        "host_spikes": 9,
        "readout_spikes": 2,
    }
    per_core = activity.per_core()
    assert per_core["spikes"].tolist() == [4, 6]
    assert per_core["messages"].tolist() == [11, 15]
    assert per_core["messages_host"].tolist() == [9, 0]


def test_an_activity_is_shown_as_a_line_as_text_and_as_a_table(make_activity):
    activity = make_activity(spikes=[[1, 2], [3, 4]], messages_host=[9, 0])
    assert repr(activity) == "<Activity: 2 steps of 1 ms on 2 cores, 10 spikes>"
    title, header, spikes, *_, host, sent = str(activity).splitlines()
    assert title == "2 steps of 1 ms on 2 cores"
    assert header.split("  ")[0] == "count"
    assert spikes.split() == ["spikes", "10", "5.0", "6", "1"]
    assert host.split() == ["messages", "host", "9", "4.5", "9", "0"]
    assert sent.split() == ["host", "spikes", "0", "0.0"]
    assert activity._repr_html_().count("<tr>") == 10


def test_spikes_of_the_host_have_a_sum_a_mean_and_a_maximum(make_activity):
    assert make_activity(host_spikes=[3, 6]).from_host == (9, 4.5, 6)
    assert make_activity(n_steps=0).from_host == (0, 0.0, 0)


def test_an_activity_may_have_no_steps(make_activity):
    activity = make_activity(n_steps=0)
    assert activity.n_steps == 0
    assert str(activity).startswith("0 steps of 1 ms on ")
    assert set(activity.totals().values()) == {0}


def test_concatenating_appends_steps_and_adds_messages(make_activity):
    a = make_activity(
        n_steps=1, spikes=[[1, 2]], messages=[[1, 0], [0, 0]], host_spikes=[4], readout_spikes=1
    )
    b = make_activity(
        n_steps=2, spikes=[[3, 4], [5, 6]], messages=[[0, 2], [0, 0]], host_spikes=[2, 0]
    )
    both = Activity.concatenate([a, b])
    assert both.spikes.tolist() == [[1, 2], [3, 4], [5, 6]]
    assert both.messages.tolist() == [[1, 2], [0, 0]]
    assert both.from_host == (6, 2.0, 4)
    assert both.readout_spikes == 1
    assert np.issubdtype(both.messages_host.dtype, np.integer)


def test_values_that_were_cut_off_in_consecutive_runs_add_up(make_activity):
    first = replace(make_activity(n_steps=2), cut_off={"a": 1, "b": 0})
    second = replace(make_activity(n_steps=2), cut_off={"a": 2, "b": 0})
    both = Activity.concatenate([first, second])
    assert both.cut_off == {"a": 3, "b": 0}
    assert both.saturated_inputs == {"a": 0.75}


def test_only_activities_of_the_same_cores_and_time_step_are_concatenated(make_activity):
    message = "^only activities of the same cores and dt_s make one run$"
    with pytest.raises(UsageError, match=message):
        Activity.concatenate([make_activity(), make_activity(n_cores=3)])
    with pytest.raises(UsageError, match=message):
        Activity.concatenate([make_activity(), make_activity(dt_s=0.002)])
    with pytest.raises(UsageError, match=r"^no activities to concatenate; pass at least one$"):
        Activity.concatenate([])
