"""The model card: figures, recipe and stages."""

from dataclasses import replace

from spikeport.training.card import card
from spikeport.training.curriculum import STAGES
from spikeport.training.evaluate import Evaluation
from spikeport.training.hidden_noise import HiddenNoise

WALKS = Evaluation(100, 2, 0.0512, 0.0987, 0.1043, 2.613, 0.207)


def test_the_card_states_figures_recipe_and_what_a_stage_changes():
    noise = HiddenNoise(white=0.5)
    stages = (STAGES[0], replace(STAGES[0], name="harder", first_step=9, hidden_noise=noise))
    made = {"command": "spikeport train walk", "seed": 7, "step": 1234567, "robots": 512}
    made |= {"kp_speed": 1.1, "kp_heading": 3.8171, "goal": "harder"}
    made |= {"factor": 1.2345, "turn_lag_s": 0.0613}
    text = card("h1_walk", made, {"as trained": WALKS}, stages)
    assert "command was scaled by 1.23, to walk as fast as asked to (" in text
    assert "1.1/s for the speed, 3.82/s for the heading,\nfor a turn lag of 0.0613 s (" in text
    assert "1,234,567 control steps of 512 robots" in text
    assert "| as trained | 100 | 2 | 0.051 | 0.099 | 0.104 | 2.61 | 0.21 |" in text
    assert "Seed 7.\nVersions: mujoco " in text
    assert "- **harder**: first_step 9, hidden_noise.white 0.5\n" in text
    assert "weights.fall -200.0" in text
    assert "Random commands of the stage `harder` for 20 s, which change no faster than" in text
    assert "ended before this stage" not in text
    made |= {"factor": None, "turn_lag_s": None}
    text = card("h1_walk", made, {}, stages[:1])
    assert "training ended before this stage" in text
    assert "command was left as it is: the policy hardly walks (" in text
    assert "for the heading,\nleft as they are: the policy hardly walks (" in text
