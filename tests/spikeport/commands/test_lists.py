"""``spikeport chips`` and ``spikeport backends``."""

import itertools

from spikeport.backends.registry import BACKENDS
from spikeport.experiments import registry
from spikeport.hardware_models import chip as chips

ANALYTIC = ("run", "reach", "--backend", "analytic", "--seconds", "0.05")


def test_chips_lists_every_chip_with_its_title_limits_and_sources(spikeport):
    done = spikeport("chips")
    assert done.code == 0
    for name in chips.names():
        _, title, rest = done.out.partition(f"{name}: {chips.get(name).title}")
        assert title
        rows = [" ".join(line.split()) for line in rest.partition("not public")[0].splitlines()]
        for limit, figure in chips.get(name).limits:
            if figure is not None:
                row = (
                    f"{limit.replace('_', ' ')} {figure.count:,} {figure.evidence} {figure.source}"
                )
                assert [one for one in rows if one.startswith(row)], row


def test_chips_lists_published_figures_of_host_io(spikeport):
    rows = [line.split() for line in spikeport("chips").out.splitlines() if "host I/O" in line]
    assert [row[2] for row in rows] == ["step", "word", "packet"]
    assert rows[0][3:7] == ["8", "ms", "[0.95,", "9]"]


def test_chips_lists_every_figure_of_a_chip(spikeport):
    """Figures are the tables of a chip file that have a source."""
    rows = spikeport("chips").out.splitlines()
    for name in chips.names():
        n_figures = (chips.BUILT_IN / f"{name}.toml").read_text().count("source =")
        first = next(i for i, row in enumerate(rows) if row.strip().startswith(f"{name}: "))
        mine = itertools.takewhile(lambda row: "  not public" not in row, rows[first + 4 :])
        # The other rows go on with a long source.
        assert len([row for row in mine if not row.startswith("   ")]) == n_figures, name
    found = "\n".join(" ".join(row.split()) for row in rows)
    assert "mesh: cores per tile 4 code SANA-FE, arch/loihi.yaml" in found
    assert "nahuku-fit: time of barrier, 2 tiles 1 us [0.75, 1.25] code SANA-FE" in found
    assert "davies2018: time of barrier, 1 tile 113 ns [no interval] transcribed" in found


def test_sources_of_figures_are_printed_whole(spikeport):
    wide = spikeport("chips").out
    assert "nengo-loihi 1.1.0, hardware/nxsdk_objects.py" in wide
    assert "…" not in wide


def test_backends_lists_every_backend(spikeport):
    done = spikeport("backends")
    assert (done.code, done.err) == (0, "")
    assert [name for name in (*BACKENDS, "analytic") if f"  {name} " not in done.out] == []


def test_backends_and_run_name_the_command_that_installs_a_missing_experiment(
    spikeport, monkeypatch
):
    def absent(name):
        raise ModuleNotFoundError(f"No module named '{name}'", name="xarray")

    monkeypatch.setattr(registry, "import_module", absent)
    done = spikeport("backends")
    assert done.code == 0
    reason = (
        "experiment '{}' needs the package xarray, which is absent; "
        "install it with: pip install 'spikeport[robot]'"
    )
    # One line for all of them, below the table that was asked for.
    *_, line = done.out.splitlines()
    absent = "draw, reach, switch, walk"
    assert line == f"experiments that are not available: {absent}; {reason.format('draw')}"
    assert done.out.count("xarray") == 1
    assert spikeport(*ANALYTIC) == (2, "", f"error: {reason.format('reach')}\n")
