"""Fixtures and options that nengo-loihi's tests need, and that its package does not contain."""

from pathlib import Path
from typing import Any

import matplotlib
import nengo_loihi
import pytest
from nengo_loihi.builder.builder import Model, ValidationLevel
from nengo_loihi.tests import make_test_sim

from tests.shadow.emulator import ShadowEmulator, install
from tests.shadow.gaps import draw_pictures, fill_gaps
from tests.shadow.tally import TALLY

MARKERS = ("slow", "target_sim", "target_loihi", "hang", "requires_multichip_snips")
IGNORED = (
    "ignore:Combining two lowpass synapses",
    "ignore:divide by zero",
    "ignore:invalid value encountered in",
    "ignore:Non-finite values detected in `max_rates`",
)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--target", default="sim", choices=["sim"])


def pytest_configure(config: pytest.Config) -> None:
    matplotlib.use("Agg")
    install()
    fill_gaps()
    ShadowEmulator.strict = True
    nengo_loihi.set_defaults()
    Model.default_validation_level = ValidationLevel.FULL
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    for line in IGNORED:
        config.addinivalue_line("filterwarnings", line)


@pytest.fixture(scope="session")
def Simulator(request: pytest.FixtureRequest) -> Any:  # noqa: N802
    return make_test_sim(request)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for module in {item.module for item in items if item.path.name == "test_conv.py"}:
        draw_pictures(module, Path(config.inipath).parent)
    for item in items:
        if "target_loihi" in item.keywords:
            item.add_marker(pytest.mark.skip(reason="runs on hardware only"))


def pytest_runtest_logstart(nodeid: str) -> None:
    TALLY.begin(nodeid)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.when == "call" or report.outcome != "passed":
        outcome = "xfailed" if hasattr(report, "wasxfail") else report.outcome
        crash = getattr(report.longrepr, "reprcrash", None)
        TALLY.end(report.nodeid, outcome, crash.message if crash else "")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    write = terminalreporter.write_line
    terminalreporter.section("both emulators side by side")
    compared = sum(1 for steps in TALLY.steps.values() if steps)
    write(
        f"{TALLY.steps.total():,} steps of {compared} tests compared: {TALLY.updates:,} compartment"
        f" updates, {TALLY.spikes:,} spikes, {len(TALLY.mismatches)} mismatches"
    )
    for mismatch in TALLY.mismatches:
        write(f"  {mismatch}")
    for reason, tests in TALLY.not_covered().items():
        write(f"not covered, {reason}: {sum(tests.values())} tests")
        for test, variants in tests.items():
            write(f"  {test}" + (f" ({variants} variants)" if variants > 1 else ""))
