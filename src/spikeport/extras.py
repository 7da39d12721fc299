"""Packages and programs: their versions, the errors for absent ones, and how to install them."""

import json
import shlex
import shutil
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from urllib.parse import urlsplit

from spikeport.errors import MissingExtraError


def version_of(package: str) -> str | None:
    """Return the version of a package; None where it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def missing(
    user: str, package: str | None, extra: str, reason: str = "is absent"
) -> MissingExtraError:
    """Return the error that names a package that ``user`` needs, and how to install it."""
    return MissingExtraError(
        f"{user} needs the package {package}, which {reason}; "
        f"install it with: {install_command(extra)}"
    )


def require_programs(names: Sequence[str], use: str, packages: str) -> None:
    """Look for programs of a system's packages.

    Parameters
    ----------
    names : sequence of str
        The programs.
    use : str
        The task that they are for, for the error.
    packages : str
        The packages of Debian that have them.

    Raises
    ------
    MissingExtraError
        If a program is not installed.
    """
    for name in names:
        if shutil.which(name) is None:
            raise MissingExtraError(
                f"no {name} is installed here, which {use}; "
                f"install it with: apt-get install {packages}"
            )


def install_command(extra: str = "") -> str:
    """Return pip's command for an extra, or for spikeport itself.

    pip finds an extra where the package came from: a folder, file or address that PEP 610's
    ``direct_url.json`` records, or else an index.
    """
    options, source = origin()
    brackets = f"[{extra}]" if extra else ""
    name, at, url = source.partition(" @ ")
    return shlex.join(["pip", "install", *options, f"{name}{brackets}{at}{url}"])


def origin() -> tuple[list[str], str]:
    """Return pip's options and the source that spikeport was installed from."""
    # Installers write down where a package came from, unless it is an index (PEP 610).
    try:
        recorded = metadata.distribution("spikeport").read_text("direct_url.json")
    except metadata.PackageNotFoundError:  # a checkout on Python's path
        recorded = None
    if not recorded:
        return [], "spikeport"
    origin = json.loads(recorded)
    address = urlsplit(origin["url"])
    if address.scheme != "file":
        vcs = origin.get("vcs_info")
        url = f"{vcs['vcs']}+{origin['url']}@{vcs['commit_id']}" if vcs else origin["url"]
        return [], f"spikeport @ {url}"
    from urllib.request import url2pathname  # loads ssl, which would slow every compile

    path = Path(url2pathname(address.path))
    if not path.exists():
        return [], "spikeport"
    constraints = path / "constraints.txt"
    options = ["-c", str(constraints)] if constraints.is_file() else []
    editable = ["-e"] if origin.get("dir_info", {}).get("editable") else []
    return [*options, *editable], str(path)
