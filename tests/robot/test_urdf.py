from spikeport.robot import urdf


def test_ranges_are_those_of_both_sides():
    hips = dict.fromkeys(("left_hip_pitch", "right_hip_pitch"), (-3.14, 2.53))
    assert urdf.ranges_rad() == hips


def test_the_urdf_is_heavier_than_the_model():
    assert urdf.figures()["links"]["torso_link"]["mass"] == 17.789
