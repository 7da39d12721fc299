"""Pickles that were made to call something, or to take memory without end."""

import io
import os
import pickle
import struct
from pathlib import Path

import pytest

from spikeport.networks.loading import pickles
from spikeport.networks.loading.pickles import Module, ModuleClass
from spikeport.reading.mismatch import MismatchError
from tests.helpers.foreign import Reduced, by_instructions, pack

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "policy.pt"


LEVELS = b"\x85" * 200_000
PICKLES = {
    "a call of os.system": (pickle.dumps(Reduced(os.system, "touch harm"), 2), "posix.system"),
    "the same, of protocol 5": (pickle.dumps(Reduced(os.system, "touch harm"), 5), "posix.system"),
    "eval": (pickle.dumps(Reduced(eval, "open('harm', 'w')"), 2), "eval, which may run code"),
    "open": (pickle.dumps(Reduced(open, "harm", "w"), 2), "open, which may run code"),
    "an object by name": (by_instructions(b"cos\nsystem\nX\4\0\0\0trueR"), "os.system, which may"),
    "INST": (by_instructions(b"(X\4\0\0\0trueios\nsystem\n"), "a pickle with INST"),
    "OBJ": (by_instructions(b"(cos\nsystem\nX\4\0\0\0trueo"), "os.system, which may run code"),
    "EXT1": (by_instructions(b"\x82\x01"), "a pickle with EXT1"),
    "torch's own functions": (by_instructions(b"ctorch\nload\nX\4\0\0\0harm\x85R"), "torch.load"),
    "a class of torch.jit": (by_instructions(b"ctorch.jit\nload\n)R"), "torch.jit.load, which may"),
    "memory for one number": (by_instructions(b"Nr\xff\xff\xff\x7f0"), "a pickle with POP"),
    "a place in memory far off": (by_instructions(b"Nj\xff\xff\xff\x7f"), "damaged"),
    "more text than there is": (by_instructions(b"X\xff\xff\xff\x7fa"), "damaged"),
    "long numbers of digits": (by_instructions(b"L" + b"9" * 5000 + b"L\n"), "damaged"),
    "instructions without end": (
        by_instructions(b"N" * 600_000),
        "a pickle of at most 500,000 instructions",
    ),
    "a key of many levels": (by_instructions(b"})" + LEVELS + b"Ns"), "keys that are plain values"),
    "a key of many digits": (
        by_instructions(b"}\x8b" + struct.pack("<i", 5000) + b"\x7f" * 5000 + b"Ns"),
        "keys that are plain values",
    ),
    "a name of a deep list": (by_instructions(b"]" * 3000 + b"a" * 2999 + b"N\x93"), "damaged"),
    "a name of doubled tuples": (by_instructions(b")", b"q\0h\0\x86" * 20, b"N\x93"), "damaged"),
    "a name of many letters": (
        by_instructions(b"X" + struct.pack("<I", 2000) + b"a" * 2000 + b"X\1\0\0\0b\x93"),
        "damaged",
    ),
    "sizes that are a text": (by_instructions(b"ctorch\nSize\nX\7\0\0\0letters\x85R"), "8 axes"),
    "sizes of many axes": (by_instructions(b"ctorch\nSize\n(", b"K\1" * 9, b"t\x85R"), "8 axes"),
    "a persistent number": (by_instructions(b"X\1\0\0\0aQ"), "storages of numbers"),
    "no end": (b"\x80\x02N", "damaged"),
    "nothing": (b"", "damaged"),
}


@pytest.mark.parametrize("name", PICKLES)
@pytest.mark.parametrize("where", ["data.pkl", "constants.pkl", "checkpoint", "old checkpoint"])
def test_harmful_endless_or_damaged_pickles_are_refused(
    path, scripted, refused, tmp_path, monkeypatch, name, where
):
    monkeypatch.chdir(tmp_path)
    content, complaint = PICKLES[name]
    write(path, scripted, where, content)
    assert complaint in refused(path)
    assert os.listdir() == [path.name]


def write(path: Path, scripted: dict[str, bytes], where: str, content: bytes) -> None:
    """Write a policy's file with a pickle in one of its places."""
    if where == "checkpoint":
        pack(path, {"policy/data.pkl": content})
    elif where == "old checkpoint":
        path.write_bytes(content if content.startswith(b"\x80") else b"\x80" + content)
    else:
        pack(path, {**scripted, f"policy/{where}": content})


@pytest.mark.parametrize(
    ("where", "complaint"),
    [
        ("data.pkl", "expected a TorchScript module, found list"),
        ("constants.pkl", "expected a tuple of constants, found list"),
        ("checkpoint", "expected a checkpoint of rsl-rl, found list"),
    ],
)
def test_a_list_that_holds_itself_is_refused_as_a_list(path, scripted, refused, where, complaint):
    write(path, scripted, where, by_instructions(b"]q\0h\0a"))
    assert refused(path).startswith(complaint)


def with_modules(n_modules: int) -> bytes:
    """Return a pickle of modules that all get one dictionary of a thousand items as their own."""
    attributes = b"".join(b"M" + struct.pack("<H", number) + b"N" for number in range(1000))
    modules = b"c__torch__\nM\n)\x81h\0b" * n_modules
    return by_instructions(b"}q\0(", attributes, b"u(", modules, b"t")


def test_attributes_count_for_every_module_that_they_are_copied_to():
    def load(content: bytes) -> object:
        return pickles.load(io.BytesIO(content), ModuleClass, lambda identifier: identifier)

    made = load(with_modules(400))
    assert [len(module.attributes) for module in made if isinstance(module, Module)] == [1000] * 400
    with pytest.raises(MismatchError, match="a pickle of at most 500,000 instructions"):
        load(with_modules(500))
