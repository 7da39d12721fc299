"""Tables as lines and as HTML."""

from spikeport.table import Table

TABLE = Table("of <b>", ("name", "n", "%"), (("a & b", "1", ""), ("c", "1,000", "3.5")))


def test_columns_are_aligned_and_no_line_ends_in_blanks():
    assert str(TABLE).splitlines() == [
        "of <b>",
        "name       n    %",
        "a & b      1",
        "c      1,000  3.5",
    ]


def test_html_is_escaped():
    right = '<td style="text-align: right">'
    assert TABLE.html() == (
        "<table><caption>of &lt;b&gt;</caption>"
        "<thead><tr><th>name</th><th>n</th><th>%</th></tr></thead><tbody>"
        f'<tr><th style="text-align: left">a &amp; b</th>{right}1</td>{right}</td></tr>'
        f'<tr><th style="text-align: left">c</th>{right}1,000</td>{right}3.5</td></tr>'
        "</tbody></table>"
    )
