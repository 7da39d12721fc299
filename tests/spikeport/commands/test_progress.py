"""The progress bar of what may take long."""

from spikeport.commands.progress import progress_bar


def test_nothing_is_drawn_where_nobody_looks(capsys):
    with progress_bar() as update:
        update("walking", None)
        update("walking", 0.5)
    assert capsys.readouterr() == ("", "")
