"""Settings of single objects in the configs of networks, and the networks where they are read."""

import nengo
import nengo_loihi
import pytest

from spikeport.compile.ground.settings import NetworkSettings, add_params


def pair() -> tuple[nengo.Ensemble, nengo.Ensemble, nengo.Connection]:
    a, b = nengo.Ensemble(4, 1), nengo.Ensemble(4, 1)
    return a, b, nengo.Connection(a, b)


def test_the_decode_path_is_automatic_unless_it_is_set() -> None:
    with nengo.Network() as network:
        *_, connection = pair()
        add_params(network)
        add_params(network)  # a second call changes nothing
    assert network.config[connection].decode_path == "auto"
    network.config[connection].decode_path = "host"
    assert NetworkSettings(network).get(connection, "decode_path") == "host"


def test_an_unknown_decode_path_is_refused() -> None:
    with nengo.Network() as network:
        *_, connection = pair()
        add_params(network)
    with pytest.raises(nengo.exceptions.ValidationError, match="decode_path"):
        network.config[connection].decode_path = "tunnel"


def test_a_network_without_options_has_no_settings() -> None:
    with nengo.Network() as network:
        a, _, connection = pair()
    settings = NetworkSettings(network)
    assert [settings.get(a, "on_chip"), settings.get(connection, "pop_type")] == [None, None]


def test_on_chip_is_read_in_the_outermost_network_and_others_in_the_objects_own() -> None:
    with nengo.Network() as network:
        nengo_loihi.add_params(network)
        with nengo.Network() as inner:
            nengo_loihi.add_params(inner)
            a, _, connection = pair()
    network.config[a].on_chip = False
    inner.config[a].on_chip = True
    network.config[a].block_shape = nengo_loihi.BlockShape((1,), (4,))
    inner.config[a].block_shape = nengo_loihi.BlockShape((2,), (4,))
    network.config[connection].pop_type = 16
    inner.config[connection].pop_type = 32
    settings = NetworkSettings(network)
    assert settings.get(a, "on_chip") is False
    assert settings.get(a, "block_shape").shape == (2,)
    assert settings.get(connection, "pop_type") == 32


def test_settings_are_copied_to_another_network() -> None:
    with nengo.Network() as network:
        add_params(network)
        a, _, connection = pair()
        network.config[a].on_chip = False
        network.config[a].block_shape = nengo_loihi.BlockShape((2,), (4,))
        network.config[connection].decode_path = "direct"
    other = nengo.Network()
    add_params(other)
    settings = NetworkSettings(network)
    settings.copy(a, other)
    settings.copy(connection, other)
    with other:
        *_, replacement = pair()
    settings.copy(connection, other, onto=replacement)
    assert other.config[replacement].decode_path == "direct"
    assert other.config[a].on_chip is False
    assert other.config[a].block_shape.shape == (2,)
    assert other.config[connection].decode_path == "direct"


def test_decode_path_is_read_in_the_objects_network_then_in_those_around_it() -> None:
    with nengo.Network() as network, nengo.Network() as middle, nengo.Network() as inner:
        *_, connection = pair()
    settings = NetworkSettings(network)
    for holder, path in ((network, "host"), (middle, "onoff"), (inner, "direct")):
        assert settings.get(connection, "decode_path") != path
        add_params(holder)
        holder.config[connection].decode_path = path
        assert settings.get(connection, "decode_path") == path
    inner.config[connection].decode_path = "auto"
    assert settings.get(connection, "decode_path") == "onoff"
    network.config[connection].pop_type = 16
    assert settings.get(connection, "pop_type") == 32  # as nengo-loihi's builder reads it


def test_options_that_others_add_are_not_listed_as_unread() -> None:
    with nengo.Network() as network, nengo.Network() as inner:
        a, *_ = pair()
    for holder in (network, inner):
        holder.config[nengo.Ensemble].set_param("colour", nengo.params.Parameter("colour", None))
        add_params(holder)
        holder.config[a].colour = "red"
    inner.config[a].on_chip = False
    assert [(one.obj, one.name) for one in NetworkSettings(network).unread()] == [(a, "on_chip")]
    network.config[a].on_chip = False
    assert not list(NetworkSettings(network).unread())
