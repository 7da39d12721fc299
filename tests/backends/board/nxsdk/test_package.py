"""Substitutes for the modules of NxSDK that nengo-loihi imports."""

from spikeport.backends.board.nxsdk.package import modules, rule_to_microcode
from spikeport.backends.board.nxsdk.recording import Board
from spikeport.backends.board.nxsdk.registers import Register


def test_every_module_has_its_parent_packages() -> None:
    found = modules(None)
    assert {"nxsdk", "nxsdk.arch", "nxsdk.graph.nxinputgen"} <= set(found)
    assert all(module.__name__ == name for name, module in found.items())


def test_a_board_of_one_package_does_not_change_that_of_another() -> None:
    alive = modules(lambda _board: None)  # type: ignore[arg-type, return-value]
    recording = modules(None)
    name = "nxsdk.arch.n2a.n2board"
    assert alive[name].N2Board.runs is not None
    assert recording[name].N2Board.runs is None
    assert Board.runs is None


def test_traces_are_written_to_registers() -> None:
    register = Register()
    trace = modules(None)["nxsdk.arch.n2a.compiler.tracecfggen.tracecfggen"].TraceCfgGen()
    trace.genTraceCfg(tau=9, spikeLevelInt=1, spikeLevelFrac=2).writeToRegister(register)
    assert (register.tau, register.spikeLevelInt, register.spikeLevelFrac) == (9, 1, 2)


def test_learning_rules_stay_text() -> None:
    code = rule_to_microcode(["dw = x1"], doOptimize=False)
    assert (code.numUCodes, code.uCodes) == (1, ["dw = x1"])
