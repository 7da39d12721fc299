"""The parts that are read of an environment description of Isaac Lab (``env.yaml``).

Values for joints stand in tables from regular expressions of names to numbers, or are one number.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from spikeport.networks.loading.refusal import MismatchError, extra

if TYPE_CHECKING:
    from yaml import Node, SafeLoader

ByName = float | dict[str, float]


class InitState(BaseModel):
    """Joint angles of the default pose, in rad."""

    joint_pos: ByName


class Actuator(BaseModel):
    """Gains of a group of joints."""

    joint_names_expr: list[str]
    stiffness: ByName
    damping: ByName


class Robot(BaseModel):
    """The robot."""

    init_state: InitState
    actuators: dict[str, Actuator]


class Scene(BaseModel):
    """What is simulated."""

    robot: Robot


class Physics(BaseModel):
    """Of the simulation: its step, in s."""

    dt: float


class Action(BaseModel):
    """What becomes of the actions: target = default pose + scale * action."""

    class_type: str
    joint_names: list[str]
    scale: ByName
    clip: None = None
    preserve_order: Literal[False] = False
    use_default_offset: Literal[True]


class ObservationTerm(BaseModel):
    """A part of the observation."""

    func: str
    scale: float | None = None
    clip: None = None
    history_length: Literal[0, None] = None


class ObservationOptions(BaseModel):
    """Options of the observation, and its terms in their order."""

    policy: dict[str, object]

    def terms(self) -> dict[str, ObservationTerm]:
        """The terms that are not switched off."""
        found = {name: value for name, value in self.policy.items() if isinstance(value, dict)}
        return {name: ObservationTerm.model_validate(value) for name, value in found.items()}


class Environment(BaseModel):
    """An environment description."""

    decimation: int
    sim: Physics
    scene: Scene
    observations: ObservationOptions
    actions: dict[str, Action]


def read(path: Path) -> tuple[Environment, dict[str, ObservationTerm]]:
    """The description, and the terms of its observation.

    Raises
    ------
    MismatchError
        It is no YAML, or lacks a part.
    MissingExtraError
        The package that reads YAML is absent.
    """
    yaml = extra("yaml")

    # Python's tuples, slices and functions become plain values, and never objects.
    Loader: type[SafeLoader] = type("Loader", (yaml.SafeLoader,), {})
    Loader.add_multi_constructor("", _plain)
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader)
        environment = Environment.model_validate(content)
        return environment, environment.observations.terms()
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise MismatchError("YAML", str(error).splitlines()[0]) from error
    except ValidationError as error:
        raise _mismatch(error.errors()[0]) from None


def _mismatch(first: ErrorDetails) -> MismatchError:
    where = ".".join(map(str, first["loc"])) or "all"
    found = "none" if first["type"] == "missing" else repr(first["input"])
    return MismatchError(f"a description of Isaac Lab ({where}: {first['msg']})", found)


def _plain(loader: "SafeLoader", _tag: str, node: "Node") -> object:
    match node.id:
        case "mapping":
            return loader.construct_mapping(node, deep=True)
        case "sequence":
            return loader.construct_sequence(node, deep=True)
    return loader.construct_scalar(node)
