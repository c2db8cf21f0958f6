"""The recipe of docs/tabletop.md, as a package of its own: any order, no intersections, categories."""

from __future__ import annotations

import pytest

from firefly_sample import build_plan
from firefly_sample.assets import model_path
from firefly_sample.capture.datasets.instances import find_instances
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.tabletop import CATEGORIES, MODULE, installed, objects_of, overlapping, vertices_of

OUTPUTS = "color", "depth", "id"
SMALL = Settings(shadow_resolution=128)


@pytest.fixture(scope="module")
def plugin(tmp_path_factory):
    """The plugin of the installed package, found by the name of its entry point."""
    with installed(tmp_path_factory.mktemp("tabletop")):
        yield find_scene("tabletop")


@pytest.fixture(scope="module")
def scene(plugin):
    return build_scene(plugin)


def test_the_module_has_under_60_lines():
    lines = MODULE.splitlines()
    assert len(lines) < 60
    assert max(map(len, lines)) <= 110


def test_frames_have_the_same_bytes_in_any_order(plugin, scene, render):
    def draw(drawn, *frames):
        found = {}
        for number in frames:
            frame = render(drawn, SMALL, time=float(number), outputs=OUTPUTS)
            assert frame.warnings == ()
            found[number] = (*(frame.images[name].tobytes() for name in OUTPUTS), frame.id_names)
        return found

    first = draw(scene, 0, 1, 2)
    assert draw(build_scene(plugin), 2, 0, 1) == first
    assert len({images[0] for images in first.values()}) == 3


def test_every_seed_and_every_second_has_its_own_numbers(plugin, scene):
    def seen(scene, time):
        scene.update(time)
        return tuple(scene.camera.get_pos())

    other = build_scene(plugin, models=str(model_path("cat.glb")), seed=2**63 - 1)
    times = 0.0, 1.0, 999_999.0
    assert len({seen(each, time) for each in (scene, other) for time in times}) == 6
    assert seen(scene, 1.0) == seen(scene, 1.96)  # frames of one second, at 24 per second


def test_objects_stand_on_the_table_and_do_not_intersect(scene):
    (low, high) = scene.root.find("plinth").get_tight_bounds()
    counts = set()
    for number in range(30):
        scene.update(float(number))
        objects = {path.get_name(): vertices_of(path) for path in objects_of(scene)}
        assert overlapping(objects) == set()
        for vertices in objects.values():
            assert abs(vertices[:, 2].min() - high[2]) < 1e-6
            assert (vertices[:, :2] > low[:2]).all()
            assert (vertices[:, :2] < high[:2]).all()
        counts.add(len(objects))
    assert counts <= set(range(1, 9))
    assert len(counts) >= 4
    # an object that is moved into another is found
    first, second, *_ = objects
    objects[first] += objects[second].mean(axis=0) - objects[first].mean(axis=0)
    assert overlapping(objects) == {(first, second)}


def test_objects_have_their_file_as_category_and_the_table_is_none(scene):
    seen = set()
    for number in range(8):
        plan = build_plan(scene, Settings(), (64, 48), ("id",), float(number))
        instances = find_instances(plan)
        expected = [path.get_children()[0].get_name() for path in objects_of(scene)]
        assert [instance.category for instance in instances] == expected
        assert all(instance.uniform for instance in instances)
        seen.update(expected)
        ids = {index for instance in instances for index in instance.ids}
        others = {name for index, name in enumerate(plan.id_names) if index not in ids}
        assert others == {"root/plinth/plinth/plinth stone slabs"}
    assert seen == CATEGORIES


def test_a_full_table_has_fewer_objects_of_ones_own_models(plugin):
    files = ",".join(str(model_path(name)) for name in ("cat.glb", "mushrooms.glb"))
    scene = build_scene(plugin, models=files, objects=40)
    most = 0
    for number in range(2):
        scene.update(float(number))
        found = objects_of(scene)
        assert {path.get_children()[0].get_tag("category") for path in found} == {"cat", "mushrooms"}
        most = max(most, len(found))
    assert 8 < most < 40  # circles of 0.1 m and more cover at most 1 square metre
