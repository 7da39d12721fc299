"""The files of a conversion in its folder; test_conversion tests its table and lines."""

from spikeport.commands.conversion_report import POLICY, write_conversion
from spikeport.experiments.policy.lint import ConversionLint
from spikeport.experiments.policy.settings import load_policy


def test_an_earlier_conversion_in_the_folder_is_replaced(tmp_path):
    lint = ConversionLint((), 0.1, 0.2, 0.004)
    (tmp_path / POLICY).write_bytes(b"the user's own")
    for _ in range(2):
        write_conversion(tmp_path, lint, None)
        assert (tmp_path / POLICY).read_bytes() == b"the user's own"
    write_conversion(tmp_path, lint, load_policy())
    assert load_policy(tmp_path / POLICY) is not None
    write_conversion(tmp_path, lint, None)
    assert [path.name for path in tmp_path.iterdir()] == ["conversion.json"]
