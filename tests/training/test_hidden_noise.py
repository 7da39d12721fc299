"""The noise of hidden units: a white part, and a lasting part drawn for each episode."""

import pytest

pytest.importorskip("torch")

import torch

from spikeport.training.hidden_noise import HiddenNoise, HiddenNoiseSource

NOBODY = torch.zeros(3, dtype=torch.bool)


def source(robots=3, units=2_000, **noise):
    """Return noise that is the same in every test."""
    torch.manual_seed(0)
    return HiddenNoiseSource(HiddenNoise(**noise), robots, units)


def test_white_noise_is_new_at_every_step():
    noise = source(white=0.5)
    first, second = noise.draw(NOBODY), noise.draw(NOBODY)
    assert abs(first.std() - 0.5) < 0.02
    assert abs((first * second).mean()) < 0.02


def test_lasting_noise_stays_until_an_episode_begins():
    noise = source(lasting=0.5)
    first = noise.draw(NOBODY)
    assert abs(first.std() - 0.5) < 0.02
    assert torch.equal(noise.draw(NOBODY), first)
    then = noise.draw(torch.tensor([False, True, False]))
    assert torch.equal(then[::2], first[::2])
    assert abs((then[1] * first[1]).mean()) < 0.03


def test_both_parts_add_up():
    noise = source(white=0.3, lasting=0.4)
    first, second = noise.draw(NOBODY), noise.draw(NOBODY)
    assert abs(first.std() - 0.5) < 0.02
    assert abs((first * second).mean() - 0.16) < 0.02


def test_noise_may_be_absent():
    assert not HiddenNoise()
    assert HiddenNoise(lasting=0.1)
    assert not source().draw(NOBODY).any()
