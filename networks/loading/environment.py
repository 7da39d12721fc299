"""The parts that are read of an environment description of Isaac Lab (``env.yaml``).

Values for joints are a table from regular expressions of names to numbers, or one number.
"""

from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import ErrorDetails

from spikeport.networks.loading.refusal import extra
from spikeport.reading.archive import read_bytes
from spikeport.reading.mismatch import MismatchError, first_line

if TYPE_CHECKING:
    from yaml import MappingNode, Node, SafeLoader

TEXT_BYTES = 2**18
"""The largest description: Isaac Lab's have some 50,000, and PyYAML reads as many in a second."""

MOST_VALUES = 100_000
"""Values that a description may have, each alias counted as often as it is used."""
DEPTH = 50
"""Levels of a description: Isaac Lab's have ten."""

MERGE = "tag:yaml.org,2002:merge"

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
    """The simulated objects in a description."""

    robot: Robot


class Physics(BaseModel):
    """The physics simulation; only its time step, in s, is read."""

    dt: float


class Action(BaseModel):
    """The meaning of actions: target = default pose + scale * action."""

    class_type: str
    joint_names: list[str]
    scale: ByName
    clip: None = None
    preserve_order: Literal[False] = False
    use_default_offset: Literal[True]


class Asset(BaseModel):
    """Joints that a term is of: all, or those that names or numbers choose."""

    joint_names: str | list[str] | None = None
    joint_ids: list[int | None] | None = None
    preserve_order: bool = False


class Parameters(BaseModel):
    """Arguments of a term's function; others than the joints do not affect what is read."""

    asset_cfg: Asset = Asset()


class ObservationTerm(BaseModel):
    """A part of the observation."""

    func: str
    params: Parameters = Parameters()
    modifiers: Annotated[list[object], Field(max_length=0)] | None = None
    scale: float | None = None
    clip: None = None
    history_length: Literal[0, None] = None


class ObservationOptions(BaseModel):
    """Options of the observation, and its terms in their order."""

    policy: dict[str, object]

    def terms(self) -> dict[str, ObservationTerm]:
        """Return the terms that are not switched off."""
        found = {name: value for name, value in self.policy.items() if isinstance(value, dict)}
        return {name: ObservationTerm.model_validate(value) for name, value in found.items()}


class Environment(BaseModel):
    """An environment description."""

    decimation: Annotated[int, Field(ge=1, le=10_000)]
    sim: Physics
    scene: Scene
    observations: ObservationOptions
    actions: dict[str, Action]


def _check_size(content: object) -> None:
    """Refuse a text of too many values: an alias is one, but its values are copied each time."""
    left, waiting = MOST_VALUES, [content]
    while waiting:
        one = waiting.pop()
        inside = list(one.values()) if isinstance(one, dict) else one
        if isinstance(inside, list | tuple):
            left -= len(inside)
            if left < 0:
                raise MismatchError(f"at most {MOST_VALUES:,} values, with aliases", "more")
            waiting += inside


def read(path: Path) -> tuple[Environment, dict[str, ObservationTerm]]:
    """Return the description, and the terms of its observation.

    Raises
    ------
    MismatchError
        The file is not YAML, lacks a part, or is too long or too deep.
    MissingExtraError
        The package that reads YAML is absent.
    """
    yaml = extra("yaml")
    written = read_bytes(path, TEXT_BYTES)
    try:
        content = yaml.load(written.decode("utf-8"), _loader(yaml))
        _check_size(content)
        environment = Environment.model_validate(content)
        return environment, environment.observations.terms()
    except ValidationError as error:
        raise _mismatch(error.errors(include_url=False, include_context=False)[0]) from None
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        # Python raises ValueError for an invalid number or date
        raise MismatchError("YAML", first_line(error)) from error


def _loader(yaml: ModuleType) -> "type[SafeLoader]":
    """Return a loader that makes only plain values, no more of them than the text contains."""
    Safe: Any = yaml.SafeLoader

    class Loader(Safe):
        depth = 0

        def compose_node(self, parent: "Node | None", index: object) -> "Node":
            self.depth += 1
            if self.depth > DEPTH:
                raise MismatchError(f"YAML of at most {DEPTH} levels", "more")
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

        def construct_object(self, node: "Node", deep: bool = False) -> object:
            try:
                return super().construct_object(node, deep)
            except (AttributeError, LookupError):  # PyYAML's, where a tag does not fit its text
                raise MismatchError(f"YAML with a value of {node.tag}", f"'{node.value}'") from None

        def flatten_mapping(self, node: "MappingNode") -> None:
            """Refuse merge keys: merges of merges may expand a line to a thousand million items."""
            if any(key.tag == MERGE for key, _ in node.value):
                raise MismatchError("YAML without merge keys", "<<")

    # Tags of Python's tuples, slices and functions make plain values, never objects.
    Loader.add_multi_constructor("", _plain)
    return Loader


def _mismatch(first: ErrorDetails) -> MismatchError:
    where = ".".join(map(str, first["loc"])) or "all"
    found = "none" if first["type"] == "missing" else _short(first["input"])
    return MismatchError(f"a description of Isaac Lab ({where}: {first['msg']})", found)


def _short(value: object) -> str:
    """Return a value in words; a list may contain itself, and a number be too long to print."""
    if isinstance(value, dict | list | tuple | set):
        return type(value).__name__
    if isinstance(value, int) and abs(value) >= 2**64:
        return "a number of many digits"
    return repr(value)


def _plain(loader: "SafeLoader", _tag: str, node: "Node") -> object:
    match node.id:
        case "mapping":
            return loader.construct_mapping(node, deep=True)
        case "sequence":
            return loader.construct_sequence(node, deep=True)
    return loader.construct_scalar(node)
