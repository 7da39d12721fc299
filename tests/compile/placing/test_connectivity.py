from dataclasses import replace

from hypothesis import HealthCheck, given, settings
from images import Block, Group, Parts, Route, images

from spikeport.compile.image.chip_image import ChipImage
from spikeport.compile.placing.connectivity import assemble, division_of, groups_of, routes_of


@given(images())
@settings(deadline=None, max_examples=50, suppress_health_check=[HealthCheck.too_slow])
def test_an_image_is_its_parts_put_together(image: ChipImage) -> None:
    parts = (division_of(image), groups_of(image), routes_of(image))
    assert assemble(image, *parts).digest == image.digest


def test_groups_take_their_settings_with_them() -> None:
    learning = (1, 0, 0, 2, 8, 1, 1)
    groups = [Group([[64]]), Group([[128]], pop_type=32, learning=learning)]
    image = Parts(groups=groups, inputs=[1], routes=[Route([0], input=0, group=1)]).image()
    form = image.groups.format.copy()
    form[1, image.manifest.synapse_format.index("weight_bits")] -= 1
    image = replace(image, groups=replace(image.groups, format=form))
    (route,) = routes_of(image)
    turned = assemble(image, division_of(image), groups_of(image)[::-1], [route._replace(group=0)])
    assert [group.label for group in turned.manifest.groups] == ["group 1", "group 0"]
    for name in ("pop_type", "format", "learning"):
        before, after = getattr(image.groups, name), getattr(turned.groups, name)
        assert after.tolist() == before.tolist()[::-1]


def test_blocks_have_the_settings_of_those_they_are_like() -> None:
    image = Parts([Block(2), Block(2, vmax=2**11 - 1)]).image()
    division = replace(division_of(image), like=[1, 0])
    assert assemble(image, division, [], []).blocks.vmax.tolist() == [2**11 - 1, 2**23 - 1]
