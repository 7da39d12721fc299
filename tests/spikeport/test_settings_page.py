"""The page of settings: every setting of every experiment, once, with its type and default."""

import dataclasses
import re

from spikeport import settings_page
from spikeport.experiments import registry
from spikeport.experiments.policy.settings import PolicySettings
from spikeport.robot.perturbation import Perturbation

ROW = re.compile(r"^\| `(\w+)` \|", re.MULTILINE)


def sections() -> dict[str, str]:
    _, *parts = settings_page.page().split("\n## ")
    return {name: text for name, _, text in (part.partition("\n") for part in parts)}


def test_every_setting_of_every_experiment_is_listed_and_explained() -> None:
    found = sections()
    for name in registry.EXPERIMENTS:
        settings = registry.get(name).settings
        links = re.findall(r"\(#(\w+)\)", found[name].partition("|")[0])
        shared = [text for title, text in found.items() if title.lower() in links]
        texts = [found[name], *shared]
        listed = [key for text in texts for key in ROW.findall(text)]
        assert sorted(listed) == sorted(field.name for field in dataclasses.fields(settings))
        prose = " ".join(text.rpartition("|\n")[2] for text in texts)
        assert [key for key in listed if f"`{key}`" not in prose] == []


def test_the_row_of_a_setting_has_its_type_and_default() -> None:
    found = sections()
    assert "| `m1` | whole number |  |" in found["ArmSettings"]
    assert "| `calibrated` | true or false, or text | `false` |" in found["ArmSettings"]
    assert "| `speed` | number | `0.5` |" in found["walk"]
    assert "| `recognise` | true or false |  |" in found["draw"]


def test_names_of_classes_are_linked() -> None:
    found = sections()
    assert "[Perturbation](#perturbation)." in found[PolicySettings.__name__]
    assert "Settings of [switch](#switch) and [walk](#walk)." in found[Perturbation.__name__]
