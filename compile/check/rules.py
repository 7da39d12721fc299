"""The rules that a network must keep, as data: the entries of `rules.toml`, by id and by name."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from spikeport.compile.check.violation import Violation
from spikeport.errors import unknown
from spikeport.files import read_toml

FILE = Path(__file__).with_name("rules.toml")
GROUPS = {
    "SP0": "Rules of the network",
    "SP1": "Limits of one core",
    "SP2": "Limits of chip and board",
    "SP3": "Your own budget",
    "SP4": "Hints",
    "SP5": "Limits of this machine",
}


class Rule(BaseModel):
    """A rule; the head of ``rules.toml`` describes the fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    name: str
    meaning: str
    reason: str
    source: str
    cure: str
    limit: str = ""
    more: tuple[str, ...] = ()
    in_case: Mapping[str, str] = {}

    def broken(self, obj: str, used: str, limit: str = "", **numbers: object) -> Violation:
        """Return the violation of an object that breaks the rule; ``numbers`` fill in the cure."""
        cure = self.cure.format(**numbers)
        return Violation(self.id, self.name, obj, used, limit or self.limit, cure)

    @property
    def cures(self) -> tuple[str, ...]:
        """The cures, with a letter where a violation has a number, and a pronoun for a name."""
        words = {
            "parts": "n",
            "gb": "n",
            "factor": "n",
            "tau_s": "tau",
            "instead": "one of these",
            "kept": "it",
            "static": "its static power",
        }
        return tuple(cure.format(**words) for cure in self.templates)

    @property
    def templates(self) -> tuple[str, ...]:
        """The cures, with names in braces for the numbers of a violation."""
        return (self.cure, *self.more, *self.in_case.values())


def _read() -> dict[str, Rule]:
    rows = read_toml(FILE)["rules"]
    return {row["id"]: Rule.model_validate(row) for row in rows}


RULES = _read()


def get(rule_id: str) -> Rule:
    """Return the rule of an id, in upper or lower case.

    Raises
    ------
    UsageError
        There is no rule of that id; the message lists all ids.
    """
    if rule_id.upper() not in RULES:
        raise unknown("rule", rule_id, RULES)
    return RULES[rule_id.upper()]


def named(name: str) -> Rule:
    """Return the rule of a name."""
    return next(rule for rule in RULES.values() if rule.name == name)
