from spikeport.robot import urdf


def test_only_the_ranges_of_both_hip_pitches_differ_from_the_models():
    hips = dict.fromkeys(("left_hip_pitch", "right_hip_pitch"), (-3.14, 2.53))
    assert urdf.ranges_rad() == hips


def test_the_torso_has_the_urdfs_mass():
    assert urdf.figures()["links"]["torso_link"]["mass"] == 17.789
