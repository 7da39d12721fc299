"""``spikeport export``: an image as a NIR graph."""

import nir


def test_export_writes_a_graph_and_prints_its_size(spikeport, image, image_file, tmp_path):
    out = tmp_path / "image.nir"
    done = spikeport("export", image_file, "--nir", out)
    assert (done.code, done.err) == (0, "")
    blocks = [n for n in nir.read(out, type_check=False).nodes if n in ("block0", "block1")]
    assert len(blocks) == image.n_blocks
    assert done.out == (
        f"image {image.digest[:12]}: {image.n_compartments} neurons in {image.n_blocks} nodes, in "
        f"steps of 0.001 s; written: {out}\n"
    )


def test_the_image_is_not_replaced_by_its_graph(spikeport, image_file):
    before = image_file.read_bytes()
    done = spikeport("export", image_file, "--nir", image_file)
    assert done == (
        2,
        "",
        f"error: --nir {image_file}: would replace what the command reads; choose another\n",
    )
    assert image_file.read_bytes() == before


def test_a_folder_in_place_of_the_file_is_refused(spikeport, image_file, tmp_path):
    done = spikeport("export", image_file, "--nir", tmp_path)
    assert done.code == 2
    assert (
        done.err == f"error: --nir {tmp_path}: is not a file that can be replaced; choose another\n"
    )
