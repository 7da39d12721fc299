"""Reader of policy files in any of the known formats, which it detects from the content.

| format | content |
|---|---|
| npz | our own files, see `spikeport.networks.walking_policy` |
| TorchScript | a scripted or traced module, as Isaac Lab exports it (NVIDIA's H1 policies) |
| checkpoint | rsl-rl's, of any version with numbered dense layers |
| ONNX | a graph of dense layers |
"""

from collections.abc import Callable
from pathlib import Path

from spikeport.networks import walking_policy
from spikeport.networks.loading import checkpoint, onnx_file, torchscript
from spikeport.networks.loading.mlp import Mlp, check_activation, checked
from spikeport.networks.loading.refusal import refusing
from spikeport.reading.archive import Archive, read_bytes
from spikeport.reading.mismatch import MismatchError

ACTIVATION = "elu"
"""The default activation of checkpoints, whose files do not name it."""

ZIP = b"PK"
ZIPS = {".npy": "npz", "constants.pkl": "TorchScript", "data.pkl": "checkpoint"}
"""Formats of archives by their members; a TorchScript file has a data.pkl too."""


def load_mlp(path: Path, activation: str | None = None, output: str | None = None) -> Mlp:
    """Read the layers of a policy, with all normalisation folded into them.

    Parameters
    ----------
    path : Path
        A file of any of the formats.
    activation : str, optional
        The activation of a checkpoint's actor, by default `ACTIVATION`. Other files contain their
        activation: if this argument is passed, it must equal the file's.
    output : str, optional
        The name of the action among several outputs of an ONNX file.

    Raises
    ------
    UsageError
        The file is not a perceptron with one kind of activation; the message says what was found.
    MissingExtraError
        The package that reads the format is absent.
    """
    with refusing(path):
        if activation is not None:
            check_activation(activation)
        kind = file_format(path)
        if output is not None and kind != "ONNX":
            cure = "leave out --output"
            raise MismatchError("an ONNX file, whose outputs have names", kind, cure=cure)
        mlp = READERS[kind](path, activation or ACTIVATION, output)
        if activation not in (None, mlp.activation):
            raise MismatchError(
                f"activation {activation}, as --activation says",
                mlp.activation,
                cure="leave out --activation: the file names its own activation",
            )
        return mlp


def file_format(path: Path) -> str:
    """Return the name of a file's format; raise UsageError if it is unknown."""
    with refusing(path):
        content = read_bytes(path)
        if content.startswith(ZIP):
            return _of_zip(Archive(content))
        if content.startswith(checkpoint.PICKLE):
            return "checkpoint"
        if path.suffix == ".onnx":
            return "ONNX"
        raise MismatchError(" or ".join(READERS), "none of them")


def files_of(path: Path) -> list[Path]:
    """Return a policy's file, and the files beside it that hold some of its numbers.

    Raises
    ------
    UsageError
        The file's format is unknown, or it is damaged.
    """
    with refusing(path):
        return [path, *(onnx_file.external_files(path) if file_format(path) == "ONNX" else ())]


def _of_zip(archive: Archive) -> str:
    for end, kind in ZIPS.items():
        if any(name.endswith(end) for name in archive.names):
            return kind
    raise MismatchError(" or ".join(READERS), "another zip archive")


def _npz(path: Path) -> Mlp:
    layers = walking_policy.load(path).layers
    return checked(layers, ("elu",) * (len(layers) - 1))


READERS: dict[str, Callable[[Path, str, str | None], Mlp]] = {
    "npz": lambda path, _activation, _output: _npz(path),
    "TorchScript": lambda path, _activation, _output: torchscript.read(path),
    "checkpoint": lambda path, activation, _output: checkpoint.read(path, activation),
    "ONNX": lambda path, _activation, output: onnx_file.read(path, output),
}
