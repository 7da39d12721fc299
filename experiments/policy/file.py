"""Walking policies for the H1, from our files or foreign ones."""

from pathlib import Path

from spikeport.networks.loading.description import Description
from spikeport.networks.loading.walking import load_walking
from spikeport.networks.walking_policy import SHIPPED, WalkingPolicy
from spikeport.robot.description import DEFAULT_POSE, GAINS, JOINTS
from spikeport.robot.walk_interface import ACTION_SCALE_RAD, CONTROL_DT_S

H1 = Description(
    joints=JOINTS,
    pose_rad=DEFAULT_POSE,
    gains=GAINS,
    action_scale_rad=dict.fromkeys(JOINTS, ACTION_SCALE_RAD),
    control_dt_s=CONTROL_DT_S,
)
"""The robot that policies are loaded for."""


def load_policy(path: Path = SHIPPED, description: Path | None = None) -> WalkingPolicy:
    """Load a policy for the H1; see `spikeport.networks.loading.walking.load_walking`."""
    return load_walking(path, H1, description)
