"""HDF5 files as plain values: refusals of links, of data elsewhere and of sizes beyond limits."""

import os
import resource
import sys

import h5py
import numpy as np
import pytest
import xarray as xr

from spikeport.errors import MissingExtraError
from spikeport.extras import install_command
from spikeport.reading import hdf5
from spikeport.reading.mismatch import MismatchError


def refusal(path, read=hdf5.read) -> str:
    with pytest.raises(MismatchError) as caught:
        read(path)
    return str(caught.value)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "file.nir"


def test_groups_numbers_and_texts_are_read(path):
    with h5py.File(path, "w") as file:
        file["node/type"] = "NIRGraph"
        file["node/edges"] = [["a", "b"], ["b", "c"]]
        file.create_dataset("node/weight", data=np.arange(6.0).reshape(2, 3), compression="gzip")
        file["node/metadata/anything"] = np.zeros(3)
    node = hdf5.read(path)["node"]
    assert set(node) == {"type", "edges", "weight"}
    assert (node["type"], node["edges"]) == ("NIRGraph", ["a", "b", "b", "c"])
    np.testing.assert_array_equal(node["weight"], [[0, 1, 2], [3, 4, 5]])


def test_a_node_may_be_called_metadata(path):
    with h5py.File(path, "w") as file:
        file["node/type"] = "NIRGraph"
        file["node/nodes/metadata/type"] = "Input"
    assert hdf5.read(path)["node"]["nodes"] == {"metadata": {"type": "Input"}}


def test_a_file_that_is_not_hdf5_is_refused(path):
    path.write_bytes(b"no HDF5")
    assert refusal(path).startswith("expected a whole HDF5 file, found ")


@pytest.mark.parametrize("link", [h5py.ExternalLink("/etc/passwd", "/"), h5py.SoftLink("/node")])
def test_links_are_not_followed(path, link):
    with h5py.File(path, "w") as file:
        file["node/x"] = link
    assert refusal(path) == "expected x in the file itself, found a link"


def test_data_of_other_files_are_not_read(path, tmp_path):
    (tmp_path / "secret").write_bytes(bytes(8))
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1,), "f8", external=[(str(tmp_path / "secret"), 0, 8)])
    assert refusal(path) == "expected x in the file itself, found data in another file"


@pytest.mark.parametrize("name", ["metadata", "node/metadata", "metadata/node"])
def test_time_series_in_another_file_are_refused_whatever_their_name(path, tmp_path, name):
    (tmp_path / "secret").write_bytes(bytes(8))
    with h5py.File(path, "w") as file:
        file.create_dataset(name, (1,), "f8", external=[(str(tmp_path / "secret"), 0, 8)])
    wanted = f"expected {name.rpartition('/')[2]} in the file itself"
    assert refusal(path, hdf5.read_dataset) == f"{wanted}, found data in another file"


def test_a_child_imports_nothing_that_its_parent_could_import_once(path, monkeypatch):
    def imported(content: bytes) -> list[str]:
        before = set(sys.modules)
        opened(content)
        return [name.partition(".")[0] for name in set(sys.modules) - before]

    opened = hdf5._dataset
    monkeypatch.setattr(hdf5, "_dataset", imported)
    xr.Dataset({"x": ("time", np.arange(3.0))}).to_netcdf(path, engine="h5netcdf")
    assert {"dask", "h5netcdf", "xarray"}.isdisjoint(hdf5.read_dataset(path))


def test_metadata_of_a_graph_that_are_a_link_are_refused(path):
    with h5py.File(path, "w") as file:
        file["node/metadata"] = h5py.ExternalLink("/etc/passwd", "/")
    assert refusal(path) == "expected metadata in the file itself, found a link"


def test_virtual_data_are_not_read(path, tmp_path):
    layout = h5py.VirtualLayout((1,), "f8")
    layout[0] = h5py.VirtualSource(tmp_path / "other.h5", "x", (1,))[0]
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("x", layout)
    assert refusal(path) == "expected x in the file itself, found data in another file"


def test_arrays_are_not_inflated_beyond_the_limit(path):
    with h5py.File(path, "w") as file:
        for i in range(3):
            file.create_dataset(f"x{i}", (2**24,), "f8", compression="gzip", chunks=(2**20,))
    assert path.stat().st_size < 10_000
    assert refusal(path) == "expected arrays of at most 268,435,456 bytes, found more in x2"


def test_chunks_are_not_inflated_beyond_the_limit_for_one_number(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1,), "f8", chunks=(2**26,), maxshape=(None,), compression="gzip")
    wanted = "chunks of at most 268,435,456 bytes in x"
    assert refusal(path) == f"expected {wanted}, found 536,870,912"


def test_a_circle_of_groups_is_refused_at_the_limit_of_levels(path):
    with h5py.File(path, "w") as file:
        file["node/x"] = 1.0
        file["node/again"] = file["node"]
    assert refusal(path) == "expected at most 32 levels of groups, found more"


def test_repeated_texts_count_each_time_towards_the_limit(path):
    with h5py.File(path, "w") as file:
        text = file.create_dataset("x", (60,), h5py.string_dtype())
        text[:] = ["a" * 2**17] * 60
    assert refusal(path) == "expected texts of at most 4,194,304 bytes, found more in x"


def test_compound_values_are_refused(path):
    with h5py.File(path, "w") as file:
        file["x"] = np.zeros(2, dtype=[("a", "f8"), ("b", "i4")])
    assert refusal(path).startswith("expected numbers or texts in x, found type [('a'")


def test_data_with_filters_other_than_deflate_and_lzf_are_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (10,), "f8", chunks=(10,), scaleoffset=2)
    assert refusal(path) == "expected x uncompressed, deflated or in LZF, found another filter"


def test_more_texts_than_edges_need_are_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (20_001, 2), h5py.string_dtype())
    assert refusal(path) == "expected at most 40,000 texts in x, found 40002"


def test_a_text_of_fixed_size_above_the_limit_of_all_texts_is_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (1,), f"S{2**23}")
    wanted = "at most 4,194,304 bytes of texts in x"
    assert refusal(path) == f"expected {wanted}, found texts of 8,388,608 bytes"


def test_a_file_that_takes_too_much_memory_is_refused(path, monkeypatch):
    path.write_bytes(b"content")
    monkeypatch.setattr(hdf5, "_values", lambda _: np.ones(2**28))
    wanted = "a file that takes at most 1,073,741,824 bytes of memory"
    assert refusal(path) == f"expected {wanted}, found one that takes more"


def test_a_limit_above_that_of_the_process_is_not_an_error(path, monkeypatch):
    path.write_bytes(b"content")
    monkeypatch.setattr(hdf5, "_values", lambda _: hdf5._limit(resource.RLIMIT_NOFILE, 10**9))
    assert hdf5.read(path) is None


@pytest.mark.slow
def test_a_file_on_which_the_library_loops_or_aborts_is_refused(path, monkeypatch):
    path.write_bytes(b"content")
    message = "expected a whole HDF5 file, found a file on which the HDF5 library failed"
    monkeypatch.setattr(hdf5, "_values", lambda _: os.abort())
    assert refusal(path) == message
    monkeypatch.setattr(hdf5, "CPU_S", 1)
    monkeypatch.setattr(hdf5, "_values", _loop)
    assert refusal(path) == message


def _loop(_content):
    while True:
        pass


@pytest.mark.parametrize(
    ("read", "user", "extra"),
    [(hdf5.read, "a NIR graph", "nir"), (hdf5.read_dataset, "time series", "runs")],
)
def test_the_error_without_h5py_names_the_extra_of_what_is_read(
    path, monkeypatch, read, user, extra
):
    path.write_bytes(b"content")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError) as caught:
        read(path)
    wanted = f"reading {user} needs the package h5py, which is absent; install it with: "
    assert str(caught.value) == wanted + install_command(extra)
