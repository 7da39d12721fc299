"""Environment descriptions: YAML that makes plain values, and the refusal of other YAML."""

import os

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.policy.settings import load_policy
from tests.helpers.foreign import described

WITH = "; see docs/convert.md, 'Refused policies'"


def laughing(levels: int, merged: bool) -> str:
    """Return lists that hold the one before ten times, or mappings that merge it twice."""
    lines = ["a0: &a0 {x: 1}" if merged else "a0: &a0 [1]"]
    for n in range(1, levels):
        again = (
            f"<<: [{', '.join([f'*a{n - 1}'] * 2)}]" if merged else ", ".join([f"*a{n - 1}"] * 10)
        )
        lines.append(f"a{n}: &a{n} {{{again}, y{n}: 1}}" if merged else f"a{n}: &a{n} [{again}]")
    return "\n".join([*lines, f"scene: *a{levels - 1}", ""])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("!!python/object/apply:os.system ['touch harm']", "a description of Isaac Lab"),
        ("a: !!python/name:os.system", "a description of Isaac Lab"),
        ("a: !!python/module:os", "a description of Isaac Lab"),
        ("a: !!python/object/new:subprocess.Popen [[touch, harm]]", "a description of Isaac Lab"),
        (laughing(60, merged=False), "at most 100,000 values, with aliases, found more"),
        (f"decimation: &a [1]\n{laughing(60, merged=False)}", "at most 100,000 values"),
        (laughing(60, merged=True), "YAML without merge keys, found <<"),
        ("[" * 3000, "YAML of at most 50 levels"),
        ("{a: " * 3000, "YAML of at most 50 levels"),
        ("\n".join("  " * n + "a:" for n in range(3000)), "a file of at most 262,144 bytes"),
        ("\n".join(" " * n + "a:" for n in range(700)), "YAML of at most 50 levels"),
        ("- " * 3000, "YAML of at most 50 levels"),
        ("&a [*a]", "at most 100,000 values, with aliases, found more"),
        ("&a {*a : 1}", "expected YAML, found "),
        ("a: " + "9" * 5000, "expected YAML, found Exceeds the limit"),
        (f"decimation: 0x{'f' * 99_999}", "found a number of many digits"),
        (f"decimation: {'1:' * 80_000}1", "a description of Isaac Lab"),
        (f"decimation: 1\nsim: {{dt: 0x{'f' * 99_999}}}", "a description of Isaac Lab"),
        ("a: 2001-99-99", "expected YAML, found month must be in 1..12"),
        ("a: !!binary 'ä'", "expected YAML, found "),
        ("a: !!float x", "expected YAML, found "),
        ("a: !!timestamp x", "YAML with a value of tag:yaml.org,2002:timestamp, found 'x'"),
        ("a: !!bool x", "YAML with a value of tag:yaml.org,2002:bool, found 'x'"),
        ("a: !!int ''", "YAML with a value of tag:yaml.org,2002:int, found ''"),
        ("a: [!!float _]", "YAML with a value of tag:yaml.org,2002:float, found '_'"),
        ("a: !!bool {=: x}", "YAML with a value of tag:yaml.org,2002:bool, found "),
        ("a: " + "x" * 300_000, "a file of at most 262,144 bytes"),
        ("? [a]\n: 1", "expected YAML, found "),
        ("a: \x07", "expected YAML, found "),
        ("%YAML 9.9\n--- a", "expected YAML, found "),
        ("*missing", "expected YAML, found "),
        ("decimation: 1.0e+400", "a description of Isaac Lab"),
        ("", "a description of Isaac Lab"),
    ],
)
def test_harmful_endless_or_malformed_yaml_is_refused(
    tmp_path, monkeypatch, refused, text, complaint
):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "env.yaml"
    path.write_text(text)
    assert complaint in refused(path, described)
    assert os.listdir() == [path.name]


def test_bytes_that_are_not_text_are_refused(tmp_path, refused):
    path = tmp_path / "env.yaml"
    path.write_bytes(b"a: \xff\xfe")
    assert refused(path, described).startswith("expected YAML, found 'utf-8' codec")


def complaint_of(path, description=None):
    with pytest.raises(UsageError) as error:
        load_policy(path, description)
    return str(error.value)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("a: [1", "expected YAML, found while parsing a flow sequence"),
        (
            "just words",
            "expected a description of Isaac Lab (all: Input should be a valid dictionary or "
            "instance of Environment), found 'just words'",
        ),
    ],
)
def test_text_that_is_not_a_description_is_refused(path, tmp_path, text, complaint):
    description = tmp_path / "env.yaml"
    description.write_text(text)
    assert complaint_of(path, description) == f"description '{description}': {complaint}{WITH}"


def test_tags_of_a_description_make_no_objects(path, environment, tmp_path):
    description = environment()
    harm = f"harm: !!python/object/apply:os.mkdir ['{tmp_path / 'harm'}']\n"
    description.write_text(description.read_text() + harm)
    load_policy(path, description)
    assert not (tmp_path / "harm").exists()
