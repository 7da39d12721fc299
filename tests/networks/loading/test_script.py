"""The text of TorchScript, which is interpreted within limits and never run by torch."""

import os
from pathlib import Path

import pytest
import torch
from torch import Tensor, nn

from spikeport.networks.loading.files import load_mlp
from spikeport.networks.loading.refusal import EXPORT
from tests.helpers.foreign import Policy, pack

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.pt"


class Loading(Policy):
    @torch.jit.export
    def __getstate__(self) -> tuple[Tensor, bool]:
        return (self.net[0].weight, self.training)

    @torch.jit.export
    def __setstate__(self, state: tuple[Tensor, bool]) -> None:
        torch.save(state[0], "harm")
        self.training = state[1]


class Endless(Policy):
    @torch.jit.export
    def __getstate__(self) -> tuple[Tensor, bool]:
        return (self.net[0].weight, self.training)

    @torch.jit.export
    def __setstate__(self, state: tuple[Tensor, bool]) -> None:
        while True:
            self.training = state[1]


class Writing(Policy):
    def forward(self, x: Tensor) -> Tensor:
        torch.save(x, "harm")
        return self.net(x)


class Looping(Policy):
    def forward(self, x: Tensor) -> Tensor:
        while bool(x.sum() < 1):
            x = x + 1
        return self.net(x)


class Inner(nn.Module):
    """A module with a harmful part that `forward` does not call."""

    def __init__(self, part: nn.Module) -> None:
        super().__init__()
        self.part, self.net = part, nn.Sequential(nn.Linear(5, 4), nn.ELU(), nn.Linear(4, 3))

    def forward(self, x: Tensor) -> Tensor:
        return self.net(x)


def double(module: nn.Module, inputs: tuple[Tensor], output: Tensor) -> Tensor:
    return output * 2.0


def test_code_that_a_policy_would_run_on_loading_is_refused_and_not_run(
    path, tmp_path, monkeypatch, refused
):
    monkeypatch.chdir(tmp_path)
    torch.jit.script(Loading()).save(path)
    assert refused(path) == (
        f"expected a module without code for loading, found __torch__.{__name__}.Loading, "
        f"whose own code restores its state; {EXPORT}"
    )
    assert not Path("harm").exists()
    with pytest.raises(RuntimeError, match="uninitialized after '__setstate__'"):
        torch.jit.load(path)
    assert Path("harm").exists(), "the attack would have been none"


@pytest.mark.parametrize("module", [Endless(), Inner(Loading()), Inner(Endless())])
def test_code_for_loading_is_refused_wherever_it_is(path, tmp_path, monkeypatch, refused, module):
    monkeypatch.chdir(tmp_path)
    torch.jit.script(module).save(path)
    assert "whose own code restores its state" in refused(path)
    assert os.listdir() == [path.name]


def test_methods_that_forward_does_not_call_are_never_run(path, tmp_path, monkeypatch, watched):
    monkeypatch.chdir(tmp_path)
    torch.jit.script(Policy()).save(path)
    watched(lambda: load_mlp(path))
    assert os.listdir() == [path.name]


@pytest.mark.parametrize(
    ("module", "found"),
    [(Writing(), "operation aten::save"), (Looping(), "a call of bool")],
)
def test_a_forward_that_writes_files_or_loops_is_refused(path, refused, module, found):
    torch.jit.script(module).save(path)
    assert f"expected a chain of dense layers and activations, found {found}" in refused(path)


def test_hooks_are_refused_since_they_change_what_forward_returns(path, refused):
    module = Policy()
    module.register_forward_hook(double)
    torch.jit.script(module).save(path)
    assert refused(path).startswith("expected a module without hooks, found hooks of __torch__.")


class InPlace(nn.Module):
    def __init__(self, again: bool) -> None:
        super().__init__()
        self.first, self.last, self.again = nn.Linear(5, 4), nn.Linear(4, 3), again

    def forward(self, x: Tensor) -> Tensor:
        x = torch.tanh(self.first(x))
        y = x.mul_(2.0)
        if self.again:
            return self.last(x)
        return self.last(y)


def test_a_value_that_is_used_after_it_was_changed_in_place_is_refused(path, refused, watched):
    torch.jit.script(InPlace(False)).save(path)
    watched(lambda: load_mlp(path))
    torch.jit.script(InPlace(True)).save(path)
    assert "found a value that is used after it was changed in place" in refused(path)


MODULE = f"__torch__.{Policy.__module__}"
CODE = f"policy/code/{MODULE.replace('.', '/')}.py"
HEAD = """class Policy(Module):
  __parameters__ = []
  def forward(self: __torch__.Policy, x: Tensor) -> Tensor:
"""
DOUBLING = "".join(
    f"def f{n}(x: Tensor) -> Tensor:\n  return {MODULE}.f{n + 1}({MODULE}.f{n + 1}(x, ), )\n"
    for n in range(60)
)
DOUBLING += "def f60(x: Tensor) -> Tensor:\n  return x\n"


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (HEAD + f"    return {MODULE}.f0(x, )\n" + DOUBLING, "a forward of at most 20,000 steps"),
        (HEAD + "    return (self).forward(x, )\n", "calls nested too deeply"),
        (
            HEAD + "    W = torch.ones([1000, 1000])\n" + "    W = torch.matmul(W, W)\n" * 900,
            "multip",
        ),
        (
            HEAD + "    W = torch.ones([1000, 1000])\n" + "    W = torch.mul(W, 2.)\n" * 900,
            "in all",
        ),
        (
            HEAD + "    W = torch.ones([1000000000])\n",
            "operation aten::ones with operands it does not take",
        ),
        (
            HEAD + "    W = torch.ones([-1, -1])\n",
            "operation aten::ones with operands it does not take",
        ),
        (
            HEAD + "    n = torch.mul('ab', 1000000000)\n",
            "operation aten::mul with operands it does not take",
        ),
        (HEAD + "    n = torch.mul(10, 10)\n" + "    n = torch.mul(n, n)\n" * 99, "one output"),
        (HEAD + "    W = torch.ones([3, 3])\n    y = torch.addmm(1., W, W)\n", "one output"),
        (HEAD + "    return __import__('os')\n", "a call of __import__"),
        (HEAD + "    return x.__class__\n", "__class__ of Chain"),
        (HEAD + "    return [y for y in x]\n", "ListComp in line 4"),
        (HEAD + "    return (lambda: x)()\n", "Lambda in line 4"),
        (HEAD + "    return " + "(" * 5000 + "\n", "too many nested parentheses"),
        (HEAD + "    return " + "-" * 50_000 + "1\n", "expected TorchScript in"),
        (HEAD + "    return x" + ".x" * 50_000 + "\n", "expected TorchScript in"),
        (HEAD + "    return CONSTANTS.c99999999999\n", "constants, found c99999999999"),
        (HEAD + "    return 1\0\n", "expected TorchScript in"),
        (HEAD + "    # \udcff\n", "expected text in"),
        (HEAD + "    x = 1\n" * 30_000, "at most 262,144 bytes"),
        (HEAD + "    while True:\n      x = x\n", "While in line 4 of its text"),
        (
            HEAD.replace("self: __torch__.Policy, x: Tensor", "z=1, /, self=2, x=3") + "    pass\n",
            "with plain arguments, passed by position or by name, found forward with others",
        ),
        (
            HEAD.replace("Tensor) ->", "Tensor, *, y=1) ->") + "    return x\n",
            "functions with plain arguments",
        ),
        (
            HEAD + "    y = 1\n" + "    y = [y, y]\n" * 20 + "    torch.gelu(x, approximate=y)\n",
            "operation aten::gelu with operands it does not take",
        ),
        (HEAD + "    return missing\n", "Name in line 4"),
        (HEAD + "    return self.missing\n", "an attribute missing of"),
        (HEAD.replace("forward", "backward") + "    return x\n", "a method forward of"),
        (HEAD.replace("class Policy", "class Other") + "    return x\n", "a definition of"),
    ],
)
def test_endless_or_malformed_code_is_refused(path, scripted, refused, text, complaint):
    pack(path, {**scripted, CODE: text.encode("utf-8", "surrogateescape")})
    assert complaint in refused(path)


def test_code_for_loading_is_refused_in_the_text_too(path, scripted, refused):
    setter = (
        "  def __setstate__(self: __torch__.Policy, state: int) -> NoneType:\n    return None\n"
    )
    pack(path, {**scripted, CODE: scripted[CODE] + setter.encode()})
    assert refused(path) == (
        "expected a module without code for loading, "
        f"found __setstate__ of {MODULE}.Policy; {EXPORT}"
    )
