"""Lines of progress, which commands print if the error stream is not a terminal."""

import re

STAGE = re.compile(r"^\[ *\d+\.\d s\] .*\n", re.MULTILINE)


def taken_out(err: str) -> str:
    """Return an error stream without its lines of progress."""
    return STAGE.sub("", err)
