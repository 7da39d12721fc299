"""Walking policies from files of any format, for our robot."""

from dataclasses import replace
from pathlib import Path

from spikeport.networks import walking_policy
from spikeport.networks.loading import isaac
from spikeport.networks.loading.description import Description, translated
from spikeport.networks.loading.files import ACTIVATION, file_format, load_mlp
from spikeport.networks.loading.refusal import refusing
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.reading.mismatch import MismatchError


def load_walking(
    path: Path, robot: Description, description: Path | None = None, activation: str = ACTIVATION
) -> WalkingPolicy:
    """Read a walking policy, for our robot and in its order of joints.

    Parameters
    ----------
    path : Path
        A file of any format that `load_mlp` reads.
    robot : Description
        The robot that the policy is to be for.
    description : Path, optional
        The environment description of Isaac Lab that belongs to it; our own files need none.
    activation : str
        The activation of a checkpoint, which does not name its own.

    Raises
    ------
    UsageError
        It is no policy of such a robot; the message says what was expected and what was found.
    MissingExtraError
        The package that reads the format is absent.
    """
    mlp = load_mlp(path, activation)
    theirs = _ours(path, robot) if file_format(path) == "npz" else _foreign(path, description)
    with refusing(path):
        return translated(mlp, theirs, robot)


def _ours(path: Path, robot: Description) -> Description:
    """Read one of our files: joints, pose and action scale are in it; the rest is the robot's."""
    policy = walking_policy.load(path)
    return replace(
        robot,
        joints=policy.joints,
        pose_rad=dict(zip(policy.joints, policy.pose_rad, strict=True)),
        action_scale_rad=dict.fromkeys(policy.joints, policy.action_scale_rad),
    )


def _foreign(path: Path, description: Path | None) -> Description:
    if description is None:
        with refusing(path, cure="give it with --description env.yaml"):
            raise MismatchError("Isaac Lab's environment description with it", "none")
    with refusing(description):
        return isaac.described(description)
