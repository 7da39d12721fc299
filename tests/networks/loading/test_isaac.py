"""Expressions and tables of Isaac Lab's descriptions that would take for ever."""

import pytest
import yaml

from spikeport.networks.loading import isaac
from tests.helpers.foreign import described


@pytest.mark.parametrize(
    ("expression", "complaint"),
    [
        ("(.*)*(.*)*(.*)*(.*)*x", "names of joints as simple expressions"),
        ("((a+)+)+$", "names of joints as simple expressions"),
        (".*" * 20 + "x", "names of joints as simple expressions"),
        ("(|)" * 30 + "x", "names of joints as simple expressions"),
        (".{1,20}" * 4 + "x", "names of joints as simple expressions"),
        ("(?=.*)x", "names of joints as simple expressions"),
        ("a" * 1000, "names of joints as simple expressions"),
        (".*(a|aa|aaa|aaaa).*(a|b|c|d|e)x", "joints of the H1 in"),
        ("(", "a regular expression, found ("),
        ("[", "a regular expression, found ["),
    ],
)
def test_expressions_that_may_take_for_ever_are_refused(
    environment, refused, expression, complaint
):
    change = {"scene/robot/init_state/joint_pos": {expression: 0.1}}
    assert complaint in refused(environment(change), described)


def test_tables_without_end_are_refused(environment, refused):
    change = {"scene/robot/init_state/joint_pos": {f".*{n}": 0.1 for n in range(3000)}}
    assert "at most 100 items in robot.init_state.joint_pos" in refused(
        environment(change), described
    )


def test_aliases_that_isaac_lab_writes_are_read(environment, tmp_path):
    path = environment()
    content = yaml.unsafe_load(path.read_text())
    content["again"] = [content["sim"], content["sim"]]
    path.write_text(yaml.dump(content, sort_keys=False))
    assert "*id001" in path.read_text()
    assert isaac.described(path).control_dt_s == pytest.approx(0.02)
