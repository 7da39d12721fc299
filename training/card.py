"""The model card of a policy: its network, its training, and its evaluations."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from importlib import metadata

from spikeport.training.curriculum import Stage
from spikeport.training.evaluate import Evaluation

LEFT = "left as it is: the policy hardly walks"
LEFT_GAINS = "left as they are: the policy hardly walks"
PACKAGES = ("mujoco", "numpy", "rsl-rl-lib", "spikeport", "torch")

_TEXT = """\
# {name}: a walking policy for the Unitree H1

A network 69 -> 128 -> 128 -> 128 -> 19 with ELU units, trained from scratch by PPO in MuJoCo:

    {command}

{step:,} control steps of {robots} robots at 50 Hz; the checkpoint was chosen by evaluation.
Its forward command was {paced} (`spikeport.training.pace`).
Gains of its path follower: {kp_speed:.3g}/s for the speed, {kp_heading:.3g}/s for the heading,
{lagging} (`spikeport.training.turn_lag`).
Interface: `spikeport.robot.walk_interface`; joints in the order of
`spikeport.robot.description.JOINTS`.

## How it walks

Random commands of the stage `{goal}` for 20 s, which change no faster than stated there{reached}.
Errors are means of the absolute difference between the command and the mean speed of the last 0.2
s, the first second after a change of command left out. "As trained" has the delays, bodies, noise
and pushes of that stage; "jumping commands" has them with commands that change at once, "exact
targets" without offsets and noise of the joint targets; "undisturbed" is the robot as it is
described. Clearance is the mean height of a foot's highest point in a step; the last column counts
steps while asked to stand.

| robots | episodes | falls | vx error, m/s | wz error, rad/s | clearance, m | steps/s | standing |
|---|---|---|---|---|---|---|---|
{rows}

## Recipe

Seed {seed}.
Versions: {versions}.
Stages, by control step, as `spikeport.training.curriculum` states them; what a stage changes
against the one before:

{stages}
"""


def card(
    name: str,
    made: Mapping[str, object],
    evaluations: dict[str, Evaluation],
    stages: tuple[Stage, ...],
) -> str:
    """Return the card's text.

    ``made`` has the command, seed, step, number of robots and gains, the factor of the forward
    command and the turn lag, None for what was left as it was, and the name of the stage that the
    policy was evaluated in; ``stages`` are those that the training reached.
    """
    reached = made["goal"] in [stage.name for stage in stages]
    versions = ", ".join(f"{package} {metadata.version(package)}" for package in PACKAGES)
    rows = "\n".join(_row(robots, e) for robots, e in evaluations.items())
    factor, lag_s = made["factor"], made["turn_lag_s"]
    return _TEXT.format(
        name=name,
        paced=LEFT if factor is None else f"scaled by {factor:.3g}, to walk as fast as asked to",
        lagging=LEFT_GAINS if lag_s is None else f"for a turn lag of {lag_s:.3g} s",
        rows=rows,
        versions=versions,
        reached="" if reached else "; the\ntraining ended before this stage",
        stages="\n".join(_changes(stages)),
        **made,
    )


def _row(robots: str, e: Evaluation) -> str:
    return (
        f"| {robots} | {e.episodes} | {e.fallen} | {e.vx_error_m_s:.3f} | {e.wz_error_rad_s:.3f} "
        f"| {e.clearance_m:.3f} | {e.steps_per_s:.2f} | {e.standing_steps_per_s:.2f} |"
    )


def _changes(stages: tuple[Stage, ...]) -> list[str]:
    """Return one line per stage, with every setting that changed."""
    lines: list[str] = []
    before: dict[str, str] = {}
    for stage in stages:
        now = _flat(asdict(stage))
        changed = {k: v for k, v in now.items() if before.get(k) != v and k != "name"}
        lines.append(f"- **{stage.name}**: " + ", ".join(f"{k} {v}" for k, v in changed.items()))
        before = now
    return lines


def _flat(nested: Mapping[str, object], prefix: str = "") -> dict[str, str]:
    flat: dict[str, str] = {}
    for key, value in nested.items():
        if isinstance(value, dict):
            flat |= _flat(value, "" if key == "task" else f"{key}.")
        else:
            flat[prefix + key] = json.dumps(value)
    return flat
