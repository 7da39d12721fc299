"""Captions of pictures of the humanoid."""

from types import SimpleNamespace

import numpy as np

from spikeport.experiments.switch.picture import COLOURS, switch_captions
from spikeport.experiments.switch.schedule import Phase
from spikeport.networks.humanoid import ACTIONS


def test_a_caption_has_the_gates_of_its_pose_even_if_the_robots_clock_is_ahead():
    phase = Phase(
        name="work", begin_s=0, end_s=6, utilities={"walk": 0.4, "draw": 0.8}, arm="reach"
    )
    run = SimpleNamespace(
        goals=[SimpleNamespace(phase=phase)],
        recording=SimpleNamespace(time_s=np.array([0.0, 0.02])),  # in real time, after a stall
        gates=np.eye(len(ACTIONS))[[0] * 5 + [1] * 5],
    )
    captions = switch_captions(run)
    assert [captions(pose).colour for pose in (1, 2)] == [COLOURS[action] for action in ACTIONS]
    assert captions(2).text.startswith("  0.0 s   work   utilities: walk 0.4, draw 0.8   selected:")
