"""Commands that install extras, wherever spikeport itself was installed from."""

import json
from importlib import metadata

import pytest

from spikeport import extras
from spikeport.errors import MissingExtraError

ORIGIN = extras.origin
"""The function itself, which the tests' conftest replaces by one that names an index."""


class Recorded:
    """A distribution whose origin a test decides."""

    def __init__(self, origin: object) -> None:
        self._origin = origin

    def read_text(self, name: str) -> str | None:
        """Return PEP 610's file, or None if pip wrote none."""
        assert name == "direct_url.json"
        return None if self._origin is None else json.dumps(self._origin)


@pytest.fixture
def command(monkeypatch):
    """Return the command for an extra, of a spikeport that was installed from an origin."""

    def command(origin: object, extra: str = "robot") -> str:
        monkeypatch.setattr(extras, "origin", ORIGIN)
        monkeypatch.setattr(metadata, "distribution", lambda name: Recorded(origin))
        return extras.install_command(extra)

    return command


def test_spikeport_from_an_index_is_installed_by_name(command):
    assert command(None) == "pip install 'spikeport[robot]'"
    assert command(None, "") == "pip install spikeport"


def test_spikeport_from_a_folder_is_installed_with_its_constraints(command, tmp_path):
    (tmp_path / "constraints.txt").touch()
    origin = {"url": tmp_path.as_uri(), "dir_info": {}}
    wanted = f"pip install -c {tmp_path}/constraints.txt '{tmp_path}[robot]'"
    assert command(origin) == wanted


def test_an_editable_install_stays_editable(command, tmp_path):
    origin = {"url": tmp_path.as_uri(), "dir_info": {"editable": True}}
    assert command(origin, "nir") == f"pip install -e '{tmp_path}[nir]'"


def test_a_folder_name_with_spaces_is_quoted(command, tmp_path):
    folder = tmp_path / "my work"
    folder.mkdir()
    assert command({"url": folder.as_uri()}) == f"pip install '{folder}[robot]'"


def test_spikeport_from_a_deleted_file_is_installed_from_the_index(command, tmp_path):
    origin = {"url": (tmp_path / "gone.whl").as_uri(), "archive_info": {}}
    assert command(origin) == "pip install 'spikeport[robot]'"


def test_the_address_and_commit_of_an_install_are_kept(command):
    url = "https://example.org/spikeport.git"
    origin = {"url": url, "vcs_info": {"vcs": "git", "commit_id": "abc"}}
    assert command(origin) == f"pip install 'spikeport[robot] @ git+{url}@abc'"
    url = "https://example.org/spikeport-0.2.0-py3-none-any.whl"
    assert command({"url": url, "archive_info": {}}) == f"pip install 'spikeport[robot] @ {url}'"


def test_the_error_names_feature_package_reason_and_command(command):
    error = extras.missing("a dance", "shoes", "ballet", reason="is too small")
    assert str(error) == (
        "a dance needs the package shoes, which is too small; "
        "install it with: pip install 'spikeport[ballet]'"
    )


def test_the_first_program_that_is_absent_is_named_with_its_packages() -> None:
    extras.require_programs(("sh",), "runs scripts", "dash")
    with pytest.raises(MissingExtraError) as raised:
        extras.require_programs(("sh", "no-such-program", "neither"), "runs scripts", "dash")
    assert str(raised.value) == (
        "no no-such-program is installed here, which runs scripts; "
        "install it with: apt-get install dash"
    )


def test_a_package_that_is_not_installed_has_no_version():
    assert extras.version_of("numpy") == metadata.version("numpy")
    assert extras.version_of("no-such-package") is None


def test_a_checkout_on_pythons_path_is_installed_by_name(monkeypatch):
    def absent(name: str) -> metadata.Distribution:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(extras, "origin", ORIGIN)
    monkeypatch.setattr(metadata, "distribution", absent)
    assert extras.install_command("nir") == "pip install 'spikeport[nir]'"
