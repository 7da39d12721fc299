"""Walking policies from files of any format, for our robot."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from spikeport.errors import UsageError
from spikeport.networks import walking_policy
from spikeport.networks.loading import isaac
from spikeport.networks.loading.description import (
    Description,
    check_robot,
    translated,
    translated_observations,
)
from spikeport.networks.loading.files import file_format, load_mlp
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.refusal import refusing
from spikeport.networks.walking_policy import WalkingPolicy
from spikeport.reading.mismatch import MismatchError

DESCRIBE = "--description env.yaml"
"""The option of ``spikeport convert`` for a description."""


def load_walking(
    path: Path,
    robot: Description,
    description: Path | None = None,
    activation: str | None = None,
    describe: str = DESCRIBE,
    output: str | None = None,
) -> WalkingPolicy:
    """Read a walking policy, for our robot and in its order of joints.

    Parameters
    ----------
    path : Path
        A file of any format that `load_mlp` reads.
    robot : Description
        Our robot.
    description : Path, optional
        Isaac Lab's environment description of the policy; our own files need none.
    activation : str, optional
        The activation, as `load_mlp` takes it.
    describe : str
        The caller's option for a description, for the error message.
    output : str, optional
        The name of the action, as `load_mlp` takes it.

    Raises
    ------
    UsageError
        The policy does not fit the robot; the message says what was expected and what was found.
    MissingExtraError
        The package that reads the format is absent.
    """
    mlp = load_mlp(path, activation, output)
    if file_format(path) == "npz":
        if description is not None:
            raise UsageError(
                f"description '{description}': policy '{path}' needs none; cure: leave the "
                "description out"
            )
        return _ours(path, mlp, robot)
    if description is None:
        with refusing(path, cure=f"give it with {describe}"):
            raise MismatchError("Isaac Lab's environment description with it", "none")
    theirs = _foreign(description, robot)
    with refusing(path):
        return translated(mlp, theirs, robot)


def our_observations(
    observations: np.ndarray, robot: Description, path: Path, description: Path | None
) -> np.ndarray:
    """Return what a policy of a file observes as our robot's observations, like its layers.

    Parameters
    ----------
    observations : (n, 12 + 3 joints) array
        Observations in the order and the units of the file.
    robot : Description
        Our robot.
    path, description : Path
        The file and its description, as `load_walking` takes them.

    Raises
    ------
    UsageError
        The file or its description is of another robot or task.
    """
    if description is None:
        theirs = _owned(walking_policy.load(path), robot)
    else:
        theirs = _foreign(description, robot)
    return translated_observations(observations, theirs, robot)


def _ours(path: Path, mlp: Mlp, robot: Description) -> WalkingPolicy:
    """Read the rest of our file: joints, pose, action scale and the follower's gains."""
    policy = walking_policy.load(path)
    theirs = _owned(policy, robot)
    with refusing(path):
        check_robot(theirs, robot)
        return replace(translated(mlp, theirs, robot), gains=policy.gains)


def _owned(policy: WalkingPolicy, robot: Description) -> Description:
    """Return the robot that our file is of: ours, but for what the file states."""
    return replace(
        robot,
        joints=policy.joints,
        pose_rad=dict(zip(policy.joints, policy.pose_rad, strict=True)),
        action_scale_rad=dict.fromkeys(policy.joints, policy.action_scale_rad),
    )


def _foreign(path: Path, robot: Description) -> Description:
    """Read a description of Isaac Lab, and compare it with our robot."""
    with refusing(path, kind="description"):
        theirs = isaac.described(path)
        check_robot(theirs, robot)
    return theirs
