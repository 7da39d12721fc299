"""The wheel's content, and its use with only its core dependencies installed."""

import json
import re
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

NETWORK = """
import nengo
import numpy as np


def make():
    with nengo.Network(seed=3) as net:
        stimulus = nengo.Node([0.5, -0.25])
        lif = nengo.Ensemble(60, 2, label="lif")
        relu = nengo.Ensemble(
            50, 1, neuron_type=nengo.SpikingRectifiedLinear(), label="relu",
            max_rates=nengo.dists.Uniform(100, 200),
        )
        more = nengo.Ensemble(40, 3, label="more", radius=1.5)
        through = nengo.Node(size_in=2, label="through")
        again = nengo.Node(size_in=1, label="again")
        nengo.Connection(stimulus, lif)
        nengo.Connection(lif, through, function=lambda x: [x[0] * x[1], x[0] ** 2])
        nengo.Connection(through, more, transform=np.array([[1.0, 0.5], [0.1, -2.0], [0, 0.3]]))
        nengo.Connection(lif, relu, function=lambda x: np.sin(x[0]), synapse=0.01)
        nengo.Connection(relu, again)
        nengo.Connection(again, relu, transform=0.7, synapse=0.1)
        nengo.Connection(again, lif, transform=[[0.2], [-0.3]])
        nengo.Connection(relu.neurons, more.neurons, transform=np.full((40, 50), 1e-3))
        nengo.Probe(more, synapse=0.01)
        nengo.Probe(relu.neurons)
    return net
"""


PATTERNS = [f"**/*.{end}" for end in ("py", "toml", "xml", "npz", "md", "h", "cpp", "v")] + [
    "py.typed"
]


def names(wheel):
    return zipfile.ZipFile(wheel).namelist()


@pytest.fixture(scope="module")
def metadata(wheel):
    (name,) = (n for n in names(wheel) if n.endswith(".dist-info/METADATA"))
    return Parser().parsestr(zipfile.ZipFile(wheel).read(name).decode())


def test_the_wheel_holds_every_module_and_data_file_of_the_package(wheel, checkout):
    package = checkout / "src" / "spikeport"
    wanted = {
        path.relative_to(package).as_posix()
        for folder in (package, *filter(Path.is_dir, package.iterdir()))
        for pattern in PATTERNS
        for path in folder.glob(pattern)
    }
    data = {"robot/h1.xml", "hardware_models/chips/loihi.toml", "networks/policies/h1_robust.npz"}
    assert {*data, "cli.py", "py.typed"} <= wanted
    assert {f"spikeport/{name}" for name in wanted} - set(names(wheel)) == set()


def test_the_wheel_holds_nothing_beside_the_package(wheel):
    assert {name.split("/")[0].split("-")[0] for name in names(wheel)} == {"spikeport"}


def test_the_licence_is_gpl_2_only(wheel, metadata):
    assert metadata["License-Expression"] == "GPL-2.0-only"
    assert metadata.get_all("License-File") == ["LICENSE"]
    (name,) = (n for n in names(wheel) if n.endswith("/LICENSE"))
    assert b"GNU GENERAL PUBLIC LICENSE" in zipfile.ZipFile(wheel).read(name)


def test_the_core_does_not_depend_on_the_robot(metadata):
    required = metadata.get_all("Requires-Dist")
    core = {re.match(r"[\w-]+", r)[0] for r in required if "extra ==" not in r}
    extras = {
        name: {re.match(r"[\w-]+", r)[0] for r in required if f'extra == "{name}"' in r}
        for name in ("runs", "robot")
    }
    assert core >= {"nengo", "nengo-loihi", "numpy", "scipy", "pydantic", "typer", "rich"}
    assert extras["runs"] >= {"matplotlib", "xarray", "h5netcdf"}
    assert extras["robot"] == {"mujoco", "spikeport"}
    assert core & (extras["runs"] | extras["robot"]) == set()


def test_the_wheel_is_imported_from_site_packages_with_numpy_1(numpy_1, tmp_path):
    code = "import spikeport, numpy; print(spikeport.__file__, numpy.__version__)"
    done = numpy_1("python", "-c", code, cwd=tmp_path)
    assert done.stderr == ""
    place, numpy_version = done.stdout.split()
    assert place.endswith("/site-packages/spikeport/__init__.py")
    assert numpy_version == "1.26.4"


@pytest.mark.parametrize(
    "package", ["mujoco", "matplotlib", "xarray", "h5netcdf", "imageio_ffmpeg"]
)
def test_the_core_installation_lacks_the_packages_of_extras(numpy_1, tmp_path, package):
    done = numpy_1("python", "-c", f"import {package}", cwd=tmp_path)
    assert f"No module named '{package}'" in done.stderr


def test_chips_works_without_the_robot(numpy_1, tmp_path):
    done = numpy_1("spikeport", "chips", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "loihi: Intel Loihi" in done.stdout


def installing(wheel, extra):
    """Return the command that installs an extra of a wheel, without its spaces."""
    return f"pipinstall'{wheel}[{extra}]'"


def test_backends_works_without_the_robot_and_says_what_is_missing(numpy_1, wheel, tmp_path):
    done = numpy_1("spikeport", "backends", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "nengo-loihi" in done.stdout
    assert installing(wheel, "robot") in "".join(done.stdout.split())


def test_doctor_names_the_missing_extra(numpy_1, wheel, tmp_path):
    done = numpy_1("spikeport", "doctor", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "mujoco missing extra robot" in " ".join(done.stdout.split())
    assert f"to install everything that is missing: pip install '{wheel}[" in " ".join(
        done.stdout.split()
    )


@pytest.mark.parametrize(
    ("command", "what", "extra"),
    [
        (["run", "reach"], "experiment 'reach'", "robot"),
        (["compile", "arm"], "network 'arm'", "robot"),
        (["simulate", "net.py"], "spikeport simulate", "runs"),
    ],
)
def test_a_command_that_needs_an_extra_says_how_to_install_it(
    numpy_1, wheel, tmp_path, command, what, extra
):
    done = numpy_1("spikeport", *command, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        f"error: {what} needs the package matplotlib, which is absent; "
        f"install it with: pip install '{wheel}[{extra}]'"
    )
    assert list(tmp_path.iterdir()) == []


def test_numpy_1_and_2_give_the_same_image(numpy_1, tmp_path):
    from spikeport.compile.pipeline import compile_network
    from spikeport.find_network import find_network

    (tmp_path / "net.py").write_text(NETWORK, encoding="utf-8")
    done = numpy_1("spikeport", "compile", "net.py:make", "--json", "report.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    theirs = json.loads((tmp_path / "report.json").read_text())["image_digest"]
    ours = compile_network(find_network(f"{tmp_path}/net.py:make", [])).image
    assert theirs == ours.digest
