"""Environment descriptions, read as plain data."""

import pytest

from spikeport.errors import UsageError
from spikeport.experiments.policy.settings import load_policy

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")


WITH = "; what can be read: spikeport convert --help"


def refused(path, description=None):
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
def test_another_text_is_no_description(path, tmp_path, text, complaint):
    description = tmp_path / "env.yaml"
    description.write_text(text)
    assert refused(path, description) == f"policy file '{description}': {complaint}{WITH}"


def test_tags_of_a_description_make_no_objects(path, environment, tmp_path):
    description = environment()
    harm = f"harm: !!python/object/apply:os.mkdir ['{tmp_path / 'harm'}']\n"
    description.write_text(description.read_text() + harm)
    load_policy(path, description)
    assert not (tmp_path / "harm").exists()
