"""Digests of the files that a run reads, by which its results name their contents."""

import hashlib
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from spikeport.errors import UsageError
from spikeport.reading.archive import UnreadableError, open_file
from spikeport.reading.mismatch import MismatchError

DIGITS = 12
CURE = "cure: name a file that you can read"


def digest(path: Path) -> str:
    """Return the first digits of the SHA-256 of a file; UsageError if it cannot be read."""
    try:
        with open_file(path) as file:
            return hashlib.sha256(file.read()).hexdigest()[:DIGITS]
    except MismatchError as error:
        raise UsageError(f"{path}: {error}; {CURE}") from None
    except UnreadableError as error:
        raise UsageError(f"{error}; {CURE}") from None
    except OSError as error:  # of a disk that fails while the file is read
        raise UsageError(f"{UnreadableError(path, error)}; {CURE}") from None


def digests(files: Iterable[Path]) -> dict[str, str]:
    """Return the digest of each file, by its path as it was named."""
    return {str(path): digest(path) for path in sorted(set(files))}


def digests_of_present(files: Iterable[Path]) -> dict[str, str]:
    """Return the digest of each file that is there; readers refuse the others in own words."""
    # False, too, for a name that is too long, where `Path.is_file` raises an error.
    return digests(path for path in files if os.path.isfile(path))


def check_unchanged(before: Mapping[str, str]) -> None:
    """Refuse to go on if a file is not as it was before a network was made of it.

    Raises
    ------
    UsageError
        If a file differs or cannot be read; the error names the first one.
    """
    for name, then in before.items():
        if (now := digest(Path(name))) != then:
            raise UsageError(
                f"{name}: changed while the network was made (digest {then} then, {now} now); "
                "cure: give the same command again"
            )
