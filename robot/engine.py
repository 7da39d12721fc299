"""The physics engine, or an error that says how to get it."""

import os

from spikeport.errors import RenderError
from spikeport.extras import missing

try:
    import mujoco
except ImportError as error:
    raise missing("the robot", "mujoco", "robot", f"cannot be imported ({error})") from error
except (AttributeError, RuntimeError) as error:
    # mujoco loads the graphics library that MUJOCO_GL names as soon as it is imported.
    raise RenderError(
        f"mujoco cannot be imported with MUJOCO_GL={os.environ.get('MUJOCO_GL', '')} ({error}); "
        "unset MUJOCO_GL, or install the library it names (osmesa: apt-get install libosmesa6)"
    ) from error

__all__ = ["mujoco"]
