"""How training reports what it is doing."""

from collections.abc import Callable

Progress = Callable[[str, float | None], None]
"""Called with what is being done, and the share that is done."""
