"""The last states of a simulation, in a ring."""

import numpy as np

from spikeport.arrays import Floats
from spikeport.robot.engine import mujoco


class History:
    """Time, positions, velocities and commands of the last ``length`` steps."""

    def __init__(self, model: mujoco.MjModel, length: int = 200) -> None:
        state = mujoco.mjtState
        parts = state.mjSTATE_TIME, state.mjSTATE_QPOS, state.mjSTATE_QVEL, state.mjSTATE_CTRL
        self._model, self._parts = model, int(sum(parts))
        self._ends = np.cumsum([1, model.nq, model.nv])
        self._rows = np.empty((length, 1 + model.nq + model.nv + model.nu))
        self._count = 0

    def clear(self) -> None:
        """Forget every state."""
        self._count = 0

    def record(self, data: mujoco.MjData) -> Floats:
        """Copy the present state into the ring, over the oldest one; return qpos and qvel."""
        row: Floats = self._rows[self._count % len(self._rows)]
        mujoco.mj_getState(self._model, data, row, self._parts)
        self._count += 1
        return row[1 : self._ends[-1]]

    def arrays(self) -> dict[str, np.ndarray]:
        """Return times (n,), qpos (n, 26), qvel (n, 25) and ctrl (n, 19), the oldest first."""
        kept = min(self._count, len(self._rows))
        # The rows of the ring in the order of time.
        order = np.arange(self._count - kept, self._count) % len(self._rows)
        time, qpos, qvel, ctrl = np.split(self._rows[order], self._ends, axis=1)
        return {"time_s": time[:, 0], "qpos": qpos, "qvel": qvel, "ctrl": ctrl}
