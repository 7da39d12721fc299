"""``spikeport doctor``."""

from importlib import metadata

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

PACKAGES = {
    "numpy": "",
    "scipy": "",
    "nengo": "",
    "nengo-loihi": "",
    "numba": "",
    "pydantic": "",
    "matplotlib": "runs",
    "xarray": "runs",
    "h5netcdf": "runs",
    "h5py": "runs",
    "pillow": "runs",
    "mujoco": "robot",
    "scikit-learn": "digits",
    "imageio": "video",
    "imageio-ffmpeg": "video",
    "mujoco-menagerie": "menagerie",
    "torch": "train",
    "rsl-rl-lib": "train",
    "pyyaml": "convert",
    "nir": "nir",
    "cyclonedds": "link",
    "dask": "sweep",
    "distributed": "sweep",
}


def run() -> int:
    """Print what there is and what is missing; 1 if something required is missing, else 0."""
    table = Table("part", "found", "if missing", box=SIMPLE_HEAD)
    missing = [name for name in PACKAGES if not _version(name)]
    for name, extra in PACKAGES.items():
        cure = f"pip install 'spikeport[{extra}]'" if extra else "pip install spikeport"
        table.add_row(name, _version(name) or "missing", escape(cure) if name in missing else "")
    graphics, cure = _graphics() if "mujoco" not in missing else ("needs mujoco", "")
    table.add_row("pictures (OpenGL)", graphics, escape(cure))
    Console().print(table)
    return int(any(not PACKAGES[name] for name in missing))


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def _graphics() -> tuple[str, str]:
    from spikeport.errors import RenderError

    try:
        from spikeport.robot.description import load
        from spikeport.robot.render import Renderer

        with Renderer(load(), 64, 48):
            return "works", ""
    except RenderError as error:
        return "missing", str(error)
