"""The last states of a simulation, in a ring."""

from typing import Any

import numpy as np


class History:
    """Keeps time, positions, velocities and commands of the last ``length`` steps."""

    def __init__(self, model: Any, length: int = 200) -> None:
        self._ends = np.cumsum([1, model.nq, model.nv])
        self._rows = np.empty((length, 1 + model.nq + model.nv + model.nu))
        self._count = 0

    def clear(self) -> None:
        """Forget every state."""
        self._count = 0

    def record(self, data: Any) -> None:
        """Copy the present state into the ring, over the oldest one."""
        row = self._rows[self._count % len(self._rows)]
        row[0] = data.time
        np.concatenate((data.qpos, data.qvel, data.ctrl), out=row[1:])
        self._count += 1

    def arrays(self) -> dict[str, np.ndarray]:
        """``time_s (n,)``, ``qpos (n, 26)``, ``qvel (n, 25)``, ``ctrl (n, 19)``, oldest first."""
        kept = min(self._count, len(self._rows))
        order = np.arange(self._count - kept, self._count) % len(self._rows)
        time, qpos, qvel, ctrl = np.split(self._rows[order], self._ends, axis=1)
        return {"time_s": time[:, 0], "qpos": qpos, "qvel": qvel, "ctrl": ctrl}
