"""``spikeport compile --explain``."""

from spikeport.compile.check import rules


def test_explain_prints_all_texts_of_a_rule(spikeport):
    done = spikeport("compile", "--explain", "sp101")
    assert (done.code, done.err) == (0, "")
    rule = rules.get("SP101")
    assert done.out.startswith("SP101 out-axons (limits of one core)\n")
    # Long texts are broken into lines.
    in_one_line = " ".join(done.out.split())
    for text in (rule.meaning, rule.reason, rule.source, *rule.more):
        assert text in in_one_line
    assert "split the source ensemble into n, or give it fewer connections" in done.out


def test_explain_lists_all_rules_for_an_unknown_one(spikeport):
    done = spikeport("compile", "--explain", "SP9")
    assert (done.code, done.out) == (2, "")
    assert done.err == f"error: unknown rule 'SP9'; choose from: {', '.join(rules.RULES)}\n"
