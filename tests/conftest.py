"""Fixtures: the wheel of this checkout's files in git, environments with it, Nengo's defaults."""

import fcntl
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from spikeport.cache import Cache

pytest.register_assert_rewrite("tests.helpers")  # a failure there shows its values, as in a test

settings.register_profile(
    "equal",  # the same examples in every run, however slow the machine
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("equal")

ROOT = Path(__file__).parents[1]
NUMPY_1 = ("numpy==1.26.4", "scipy<1.14")
Run = Callable[..., subprocess.CompletedProcess[str]]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add --bless."""
    parser.addoption("--bless", action="store_true", help="write golden files anew")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put files with slow tests first: a worker that got one last would work on alone."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.fixture(autouse=True)
def _own_path() -> Iterator[None]:
    """Restore `sys.path`: a module of user code could hide one of Python's in later tests."""
    before = sys.path[:]
    yield
    sys.path[:] = before


@pytest.fixture(autouse=True)
def _from_an_index(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let messages name the package in an index, wherever this spikeport was installed from."""
    monkeypatch.setattr("spikeport.extras.origin", lambda: ([], "spikeport"))


def _foreign_environment() -> dict[str, str]:
    """Return this environment, without the variables by which Python could find the checkout."""
    return {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}


def _run(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(a) for a in arguments],
        cwd=cwd,
        env=_foreign_environment(),
        capture_output=True,
        text=True,
        timeout=900,
    )


def _pip(python: Path | str, *arguments: object, cwd: Path) -> None:
    done = _run(python, "-m", "pip", *arguments, "--disable-pip-version-check", cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr


def _new_environment(python: Path | str, folder: Path) -> Path:
    """Return the folder of programs of a new environment; ours needs no pip of its own."""
    # Another Python needs its own, as ours may be too old for it.
    options = ["--without-pip"] if python == sys.executable else []
    done = _run(python, "-m", "venv", *options, folder / "venv", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "venv" / "bin"


def _install(programs: Path, *arguments: object, cwd: Path) -> None:
    """Install packages into an environment, with its own pip or else with that of this one."""
    if (programs / "pip").exists():
        _pip(programs / "python", "install", *arguments, cwd=cwd)
    else:
        _pip(sys.executable, "--python", programs / "python", "install", *arguments, cwd=cwd)


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the folder of the checkout."""
    return ROOT


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """Return a folder that tests share, also those of other workers."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if hasattr(request.config, "workerinput") else own) / "shared"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def kept(shared: Path) -> Cache:
    """Return a cache that tests share, also those of other workers: a rehearsal takes 8 to 30 s.

    Tests that replace a function whose result is kept have caches of their own.
    """
    return Cache(shared / "kept")


@pytest.fixture(scope="session")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the files git tracks or would add, and of nothing else."""
    listed = _run("git", "ls-files", "-z", "-co", "--exclude-standard", cwd=ROOT)
    assert listed.returncode == 0, listed.stderr
    target = tmp_path_factory.mktemp("checkout")
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).exists():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, target / name, follow_symlinks=False)
    return target


@pytest.fixture(scope="session")
def wheel(checkout: Path, shared: Path) -> Path:
    """Return the wheel that is built from that copy, by the first worker that needs it."""
    folder = shared / "wheel"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not list(folder.glob("*.whl")):
            _pip(sys.executable, "wheel", "--no-deps", "-w", folder, checkout, cwd=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="session")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Run]:
    """Return a function that makes an environment of the wheel, its core dependencies and more."""

    def make(
        *packages: str, numpy: Iterable[str] = NUMPY_1, python: Path | str = sys.executable
    ) -> Run:
        if numpy is NUMPY_1 and sys.version_info >= (3, 13):
            pytest.skip("NumPy 1.26 has no wheels for this Python")
        folder = tmp_path_factory.mktemp("environment")
        programs = _new_environment(python, folder)
        # Modules are compiled when a test imports them: it imports few of those installed.
        _install(programs, "--no-compile", wheel, *numpy, *packages, cwd=folder)
        return lambda program, *arguments, cwd: _run(programs / program, *arguments, cwd=cwd)

    return make


@pytest.fixture(scope="session")
def bare_environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Run]:
    """Return a function that makes an environment with the wheel and the chosen packages alone."""

    def make(*packages: str) -> Run:
        folder = tmp_path_factory.mktemp("bare")
        programs = _new_environment(sys.executable, folder)
        _install(programs, "--no-compile", "--no-deps", wheel, cwd=folder)
        constraints = ("-c", ROOT / "constraints.txt")
        _install(programs, "--no-compile", *constraints, *packages, cwd=folder)
        return lambda program, *arguments, cwd: _run(programs / program, *arguments, cwd=cwd)

    return make


@pytest.fixture(scope="session")
def numpy_1(environment: Callable[..., Run]) -> Run:
    """Return a runner of programs beside the wheel, its core dependencies and NumPy 1."""
    return environment()


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """Switch the cache off, so that tests share nothing; a test of the cache sets a folder."""
    monkeypatch.setenv("SPIKEPORT_CACHE", "off")


@pytest.fixture
def nengo_defaults() -> Iterator[None]:
    """Restore Nengo's defaults afterwards, which `set_defaults` changes."""
    import nengo

    parameters = (nengo.Ensemble.max_rates, nengo.Ensemble.intercepts)
    states = (nengo.LIF.state, nengo.SpikingRectifiedLinear.state)
    values, kept = [one.default for one in parameters], [dict(one) for one in states]
    yield
    for parameter, value in zip(parameters, values, strict=True):
        parameter.default = value
    for state, before in zip(states, kept, strict=True):
        state.update(before)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let SIGINT and SIGHUP reach the process, also if tests were started in the background."""
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in usual.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
