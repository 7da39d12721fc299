"""The policy that a user converts: its file, its layers and its observations."""

import os
from collections.abc import Iterator
from pathlib import Path

from spikeport.commands.options_of_networks import ConvertRequest
from spikeport.errors import unknown
from spikeport.experiments.policy.observations import (
    Observations,
    normal_observations,
    read_observations,
)
from spikeport.networks.loading.files import file_format, load_mlp
from spikeport.networks.loading.mlp import Mlp
from spikeport.networks.loading.walking import our_observations
from spikeport.networks.walking_policy import POLICIES, WalkingPolicy


def file_of(request: ConvertRequest) -> Path:
    """Return the file of a policy, which may be given by the name of a shipped policy.

    Raises
    ------
    UsageError
        If there is no policy of this name.
    """
    if (shipped := POLICIES.get(str(request.file))) is not None:
        return shipped
    if not (request.file.suffix or os.path.exists(request.file)):
        raise unknown("policy", str(request.file), (*POLICIES, "the path of a file"))
    return request.file


def read_policy(request: ConvertRequest) -> tuple[WalkingPolicy | None, Mlp]:
    """Return the walking policy, if the file holds one, and the layers."""
    if request.description is None and file_format(file_of(request)) != "npz":
        return None, load_mlp(file_of(request), request.activation, request.output)
    from spikeport.experiments.policy.settings import load_policy  # needs the robot

    walker = load_policy(
        file_of(request), request.description, request.activation, output=request.output
    )
    return walker, Mlp(walker.layers, "elu")


def in_words(request: ConvertRequest, mlp: Mlp) -> Iterator[str]:
    """Yield sizes, activation and ends of a policy; the user may have to correct the activation."""
    yield "-".join(map(str, mlp.sizes))
    is_guess = request.activation is None and file_format(file_of(request)) == "checkpoint"
    hint = " (assumed: a checkpoint names none; give it with --activation)" if is_guess else ""
    yield mlp.activation + hint
    if mlp.observed is not None:
        yield "clip of the observation"
    if mlp.squash is not None:
        yield f"{mlp.squash.words} of the action"


def observations_of(
    request: ConvertRequest, walker: WalkingPolicy | None, mlp: Mlp
) -> Observations:
    """Return a user's observations; without any, those of a gait, or normal ones."""
    if request.observations is not None:
        found = read_observations(request.observations, mlp.sizes[0])
        return found if walker is None else _translated(found, request)
    if walker is None:
        return normal_observations(mlp)
    from spikeport.experiments.walk.gait import record_gait

    gait = record_gait(walker)
    return Observations(gait, f"{len(gait):,} of a gait, recorded from the exact policy")


def _translated(found: Observations, request: ConvertRequest) -> Observations:
    """Return observations of a walking policy in our order of joints, as its layers are."""
    from spikeport.experiments.policy.settings import H1  # needs the robot

    described = request.description
    values = our_observations(found.values, H1, file_of(request), described)
    origin = found.origin if described is None else f"{found.origin}, in the order of {described}"
    return Observations(values, origin)
