"""Parts of nengo-loihi that are replaced while it works for us."""

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def replaced(owner: object, name: str, new: object) -> Iterator[None]:
    """Replace an attribute of a class or a module within the context.

    All threads see it: whoever replaces a part that others use holds `refusal.TURN`.
    """
    usual = getattr(owner, name)
    setattr(owner, name, new)
    try:
        yield
    finally:
        setattr(owner, name, usual)
