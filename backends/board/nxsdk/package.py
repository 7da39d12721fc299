"""The recording board as the package ``nxsdk`` that nengo-loihi imports."""

import enum
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType, SimpleNamespace

from spikeport.backends.board.nxsdk.recording import Board, Graph, Running
from spikeport.backends.board.nxsdk.registers import Register

VERSION = "1.0.0"
"""The newest version that nengo-loihi 1.1.0 knows."""


class Phase(enum.Enum):
    """The times of a step at which a snip can run."""

    EMBEDDED_MGMT = enum.auto()
    EMBEDDED_PRELEARN_MGMT = enum.auto()
    HOST_CONCURRENT_EXECUTION = enum.auto()


class TraceConfig(Register):
    """The settings of a learning trace."""

    def genTraceCfg(self, **settings: object) -> "TraceConfig":  # noqa: N802 (NxSDK's)
        """Take settings."""
        self.configure(**settings)
        return self

    def writeToRegister(self, register: Register) -> None:  # noqa: N802 (NxSDK's)
        """Write the settings to a register."""
        register.configure(**self.__dict__)


def rule_to_microcode(rules: Sequence[str], doOptimize: bool = True) -> SimpleNamespace:
    """Return the learning rules unchanged: only NxSDK knows their microcode."""
    return SimpleNamespace(numUCodes=len(rules), uCodes=list(rules))


class SpikeProbe:
    """A probe of spikes; nengo-loihi clears its ``probeDict``."""

    probeDict: dict[str, object] = {}  # noqa: RUF012, N815 (NxSDK's)


class SpikeGenerator:
    """A generator of spikes that are known beforehand: not used, since snips take all spikes."""


def modules(runs: Callable[[Board], Running] | None) -> dict[str, ModuleType]:
    """Return the modules of a package ``nxsdk``, by name.

    Parameters
    ----------
    runs : callable, optional
        See `Board`.
    """
    board = type("N2Board", (Board,), {"runs": None if runs is None else staticmethod(runs)})
    content: dict[str, dict[str, object]] = {
        "nxsdk": {"__version__": VERSION, "__file__": __file__},
        "nxsdk.arch.n2a.compiler.tracecfggen.tracecfggen": {"TraceCfgGen": TraceConfig},
        "nxsdk.arch.n2a.n2board": {"N2Board": board},
        "nxsdk.compiler.microcodegen.interface": {"ruleToUCode": rule_to_microcode},
        "nxsdk.graph.graph": {"Graph": Graph},
        "nxsdk.graph.nxinputgen.nxinputgen": {"BasicSpikeGenerator": SpikeGenerator},
        "nxsdk.graph.nxprobes": {"N2SpikeProbe": SpikeProbe},
        "nxsdk.graph.processes.phase_enums": {"Phase": Phase},
    }
    return _packages(content)


def _packages(content: Mapping[str, Mapping[str, object]]) -> dict[str, ModuleType]:
    """Return modules with this content, and the packages around them."""
    made: dict[str, ModuleType] = {}
    for name in content:
        parts = name.split(".")
        for depth in range(1, len(parts) + 1):
            path = ".".join(parts[:depth])
            made.setdefault(path, ModuleType(path)).__dict__.update(content.get(path, {}))
    return made
