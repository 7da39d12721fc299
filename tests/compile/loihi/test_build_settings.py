"""Settings of a build: read from nengo-loihi's model, written into ours."""

import pytest
from nengo_loihi.builder import Model
from nengo_loihi.decode_neurons import OnOffDecodeNeurons, Preset10DecodeNeurons

from spikeport.compile.loihi.build_settings import AS_USUAL, BuildSettings
from spikeport.errors import UsageError


def test_the_defaults_are_those_of_nengo_loihi():
    theirs = BuildSettings.of(Model())
    assert type(theirs.decode_neurons) is Preset10DecodeNeurons
    assert type(theirs.node_neurons) is OnOffDecodeNeurons
    numbers = [name for name in vars(AS_USUAL) if not name.endswith("_neurons")]
    assert {n: getattr(theirs, n) for n in numbers} == {n: getattr(AS_USUAL, n) for n in numbers}


def test_settings_are_written_into_a_model():
    model = Model()
    neurons = model.decode_neurons
    BuildSettings(pes_error_scale=7.0, decode_tau=0.02).set_on(model)
    assert (model.pes_error_scale, model.decode_tau) == (7.0, 0.02)
    assert model.decode_neurons is neurons


@pytest.mark.parametrize(
    "changed",
    [
        {"remove_passthrough": False},
        {"intercept_limit": 0.9},
        {"vth_nonspiking": 20},
        {"decode_tau": 0.05},
        {"decode_neurons": OnOffDecodeNeurons(3)},
    ],
)
def test_settings_that_passes_ignore_are_refused_together_with_passes(changed):
    for usual in (AS_USUAL, BuildSettings.of(Model())):
        usual.check_written()
    ((name, _),) = changed.items()
    with pytest.raises(UsageError, match=f"^{name}=.*: expected .* as_written$"):
        BuildSettings(**changed).check_written()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"decode_tau": float("nan")}, "decode_tau=nan: input should be a finite number"),
        ({"pes_error_scale": "x"}, "pes_error_scale=x: input should be a valid number"),
        ({"pes_wgt_exp": 8}, "pes_wgt_exp=8: input should be less than or equal to 7"),
        ({"vth_nonspiking": 0}, "vth_nonspiking=0: input should be greater than 0"),
    ],
)
def test_invalid_numbers_are_refused(given, message):
    with pytest.raises(UsageError, match=f"^{message}"):
        BuildSettings(**given)
