from spikeport.robot import urdf
from spikeport.robot.plant import Plant


def test_only_the_ranges_of_both_hip_pitches_differ_from_the_models():
    hips = dict.fromkeys(("left_hip_pitch", "right_hip_pitch"), (-3.14, 2.53))
    assert urdf.ranges_rad() == hips


def test_every_link_but_the_torso_is_heavier_than_the_models():
    model = Plant().model
    links = {name: link["mass"] for name, link in urdf.figures()["links"].items()}
    assert len(links) == 11
    more_kg = {name: mass - model.body(name).mass.item() for name, mass in links.items()}
    assert more_kg.pop("torso_link") == 0
    assert min(more_kg.values()) > 0
