"""``spikeport show``: an image by itself, in words."""

import os
import subprocess
import sys
from dataclasses import replace


def test_show_prints_chip_digest_blocks_inputs_and_outputs(spikeport, image, image_file):
    done = spikeport("show", image_file)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0] == f"image {image.digest}"
    assert lines[1] == "for chip loihi, computes as nengo-loihi 1.1, schema 2"
    assert lines[2].startswith(f"{image.n_compartments} compartments in 2 blocks on 1 core, ")
    rows = [" ".join(line.split()) for line in lines]
    assert "0 0 a [bold]b ensemble 0 40" in rows
    assert any(row.startswith("0 stimulus -> a [bold]b 0 4 on/off, 500 ± 500 x Hz") for row in rows)
    assert "0 decoded voltage 4 2 Lowpass, 10 ms" in rows
    assert "1 spikes spiked 40 40 none" in rows


def test_control_characters_in_an_image_are_escaped(spikeport, image, tmp_path):
    manifest, odd = image.manifest, "\x1b[2J\x07"
    changed = {
        name: tuple(replace(one, **{field: odd}) for one in getattr(manifest, name))
        for name, field in (("blocks", "owner"), ("inputs", "name"), ("outputs", "name"))
    }
    path = tmp_path / "odd.npz"
    replace(image, manifest=replace(manifest, chip=odd, **changed)).save(path)
    done = spikeport("show", path)
    assert done.code == 0
    assert done.out.replace("\n", "").isprintable()
    assert done.out.count(r"\x1b[2J\x07") == 6


def test_characters_that_the_output_encoding_lacks_are_escaped(image, tmp_path):
    path = tmp_path / "image.npz"
    replace(image, manifest=replace(image.manifest, chip="\U0001f600")).save(path)
    command = [sys.executable, "-c", "from spikeport.cli import main; main()", "show", str(path)]
    ascii_only = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, env=ascii_only, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert r"for chip \U0001f600" in done.stdout


def test_a_file_that_is_not_an_image_is_refused_in_one_line(spikeport, tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("text")
    message = f"error: {path}: not a chip image, or truncated or altered\n"
    assert spikeport("show", path) == (2, "", message)
