"""copy.deepcopy, copy.copy and pickle of what makes a scene: independent and right."""

from __future__ import annotations

import copy
import gc
import math
import pickle
import weakref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.light import Attenuation
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.particles import ParticleNode, ParticleShadow
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.unit.trees import names, tree


def _pickled(thing):
    return pickle.loads(pickle.dumps(thing))


WAYS = {"deepcopy": copy.deepcopy, "pickle": _pickled}
each_way = pytest.mark.parametrize("duplicate", WAYS.values(), ids=WAYS)


def _geom(name="geom"):
    return Geom(np.eye(3), [(0, 1, 2)], colors=np.eye(4)[:3], name=name)


def _texture():
    return Texture(np.arange(16, dtype=np.uint8).reshape(2, 2, 4), "leaf")


class _Swarm:
    count = 2

    def at(self, time):
        return np.full((self.count, 3), time), (1.0, 1.0, 1.0), 1.0

    def puffs(self, seed, time):
        return np.full((self.count, 3), time), 1.0, 0.5, (1.0, 1.0, 1.0)


def _nodes():
    """A node of every kind, with contents that are not the defaults."""
    bark = Material("bark", (0.1, 0.2, 0.3, 0.4), _texture(), "mask", 0.25, True, shininess=3)
    geoms = GeomNode("geoms")
    geoms.add_geom(_geom(), bark)
    lamp = PointLight("lamp", (1, 2, 3))
    lamp.set_attenuation(Attenuation.FIFTY_UNITS)
    lamp.set_max_distance(7)
    sun = DirectionalLight("sun")
    sun.set_direction((1, 2, 3))
    sun.set_shadow_caster(True, 64)
    spot = Spotlight("spot", (3, 2, 1))
    spot.set_lens(PerspectiveLens(fov=50))
    spot.set_specular_color((0.1, 0.2, 0.3))
    smoke = ParticleNode("smoke", np.eye(3), (1, 2, 3), 0.3)
    smoke.set_shadow(ParticleShadow(sun, blur=2.0))
    smoke.set_bounding_sphere(3, (1, 2, 3))
    return [
        PandaNode("plain"),
        geoms,
        lamp,
        sun,
        spot,
        smoke,
        Camera("eye", OrthographicLens(film_size=(4, 3)), 5),
        AmbientLight("sky", (0.1, 0.2, 0.3)),
        PointLights("lamps", np.eye(3), (1, 0, 0), (1, 2, 3), specular_colors=(0, 1, 0)),
        Sprites("dots", np.eye(3), (1, 0, 0), (1, 2, 3)),
        PointLights("swarm", function=_Swarm().at),
        ParticleNode("puffs", function=_Swarm().puffs, seed=5),
    ]


def _said(thing, seen=None):
    """All that a thing says of itself, but for what each has of its own: comparable, all the way down."""
    seen = {} if seen is None else seen
    if id(thing) in seen:
        return seen[id(thing)]
    if isinstance(thing, np.ndarray):
        return thing.dtype.str, thing.shape, thing.tobytes()
    if isinstance(thing, (list, tuple)):
        return [_said(item, seen) for item in thing]
    if isinstance(thing, dict):
        return {key: _said(value, seen) for key, value in thing.items()}
    if not hasattr(thing, "__dict__") or callable(thing):
        return getattr(thing, "__qualname__", repr(thing))
    seen[id(thing)] = (type(thing).__name__, len(seen))
    own = {"serial", "_parents", "_steps", "_ranks"}
    kept = {name: value for name, value in vars(thing).items() if name not in own}
    parents = len(thing.parents) if isinstance(thing, PandaNode) else 0
    return type(thing), parents, _said(kept, seen)


def _mutable(thing, found=None):
    """The ids of everything that could be changed, all the way down."""
    found = {} if found is None else found
    if id(thing) in found or isinstance(thing, (str, int, float, type(None), type, weakref.ref)):
        return found
    if isinstance(thing, (list, tuple)):
        if isinstance(thing, list):
            found[id(thing)] = thing
        for item in thing:
            _mutable(item, found)
    elif isinstance(thing, dict):
        found[id(thing)] = thing
        for item in thing.values():
            _mutable(item, found)
    elif isinstance(thing, NodePath):
        for path in thing.get_ancestors():
            _mutable(path.node(), found)
    elif hasattr(thing, "__dict__"):
        found[id(thing)] = thing
        _mutable({name: value for name, value in vars(thing).items() if name != "_steps"}, found)
    return found


def _shared(one, other):
    """Return the mutable objects that two trees share."""
    mine, yours = _mutable(one), _mutable(other)
    return [mine[key] for key in mine.keys() & yours.keys()]


@each_way
@pytest.mark.parametrize("node", _nodes(), ids=lambda node: node.name)
def test_every_kind_of_node_has_independent_equals(duplicate, node):
    twin = duplicate(node)
    assert type(twin) is type(node)
    assert _said(twin) == _said(node)
    assert _shared(node, twin) == []
    assert twin.parents == []


@pytest.mark.parametrize("node", _nodes(), ids=lambda node: node.name)
def test_a_plain_copy_has_its_own_attributes_and_shares_children_as_in_panda3d(node):
    theirs = panda.NodePath("a")
    child = theirs.attach_new_node("b").node()
    assert copy.copy(theirs.node()).get_child(0) == child  # the oracle
    path = NodePath(node)
    child = path.attach_new_node("b", sort=3)
    twin = copy.copy(node)
    path.set_tag("kind", "tree")
    path.set_pos(1, 2, 3)
    path.set_color(1, 0, 0)
    assert type(twin) is type(node)
    assert list(twin.children) == [child.node()]
    assert twin.get_child_sort(child.node()) == 3
    assert (twin.tags, twin.transform.is_identity(), twin.flat_color) == ({}, True, None)


def test_a_plain_copy_of_a_geom_node_has_its_own_list():
    node = _nodes()[1]
    twin = copy.copy(node)
    node.add_geom(_geom("more"))
    assert [geom.name for geom, _ in twin.geoms] == ["geom"]


@each_way
def test_a_subclass_that_says_nothing_of_copies_keeps_its_class_and_attributes(duplicate):
    node = _Tree("oak")
    node.rings = [1, 2]
    twin = duplicate(node)
    assert (type(twin), twin.rings) == (_Tree, [1, 2])
    assert twin.rings is not node.rings


class _Tree(GeomNode):
    pass


def test_copy_to_keeps_the_class_and_attributes_of_a_subclass():
    node = _Tree("oak")
    node.rings = [1, 2]
    twin = NodePath(node).copy_to(NodePath("root")).node()
    assert (type(twin), twin.rings) == (_Tree, [1, 2])
    assert twin.rings is not node.rings


@pytest.mark.parametrize("make", [_geom, _texture], ids=["geom", "texture"])
@pytest.mark.parametrize("duplicate", [*WAYS.values(), copy.copy], ids=[*WAYS, "copy"])
def test_a_copy_has_a_serial_of_its_own(duplicate, make):
    """GPU objects are cached by serial, so two objects must not share one."""
    thing = make()
    twin = duplicate(thing)
    later = make()
    assert len({thing.serial, twin.serial, later.serial}) == 3
    assert _said(twin) == _said(thing)


def test_arrays_stay_read_only_in_copies():
    for duplicate in (*WAYS.values(), copy.copy):
        given = _geom()
        given.bounds, given.sphere  # noqa: B018  kept from now on
        geom = duplicate(given)
        for array in (
            *(geom.vertices, geom.normals, geom.texcoords, geom.triangles, geom.colors, geom.alphas),
            *geom.bounds,
            geom.sphere[0],
        ):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0
        with pytest.raises(ValueError, match="read-only"):
            duplicate(Material("m")).base_color[0] = 0.5
        with pytest.raises(ValueError, match="read-only"):
            duplicate(PointLights("l", np.eye(3))).arrays.positions[0] = 0
        with pytest.raises(ValueError, match="read-only"):
            duplicate(_texture()).pixels[0] = 0


def test_a_texture_is_decoded_where_it_is_wanted_and_pickled_whole():
    calls = []
    pixels = _texture().pixels

    def decode():
        calls.append(1)
        return pixels

    texture = Texture.from_file(decode, (2, 2), "digest", "file")
    twin = copy.deepcopy(texture)
    assert not calls
    again = _pickled(twin)
    assert np.array_equal(again.pixels, pixels)
    assert (again.digest, again.size, len(calls)) == ("digest", (2, 2), 1)


@pytest.mark.parametrize("duplicate", [*WAYS.values(), copy.copy], ids=[*WAYS, "copy"])
@pytest.mark.parametrize(
    "value",
    [
        Settings(supersample=2),
        Parameter("lights", int, 3, "How many."),
        Attenuation.FIFTY_UNITS,
        PerspectiveLens(fov=(50, 40), near=0.5),
        OrthographicLens(film_size=(5, 4)),
        Material("m", (0.1, 0.2, 0.3, 0.4)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_values_are_equal_and_lenses_and_materials_independent(duplicate, value):
    twin = duplicate(value)
    assert _said(twin) == _said(value)
    before = _said(twin)
    if isinstance(value, Material):
        value.set_base_color((1, 1, 1, 1))
    elif isinstance(value, (PerspectiveLens, OrthographicLens)):
        value.set_film_size(3, 1)
        value.set_near_far(2, 3)
    assert _said(twin) == before


# --- Paths and trees ---


@st.composite
def graphs(draw):
    """A random graph with instances, as its nodes, each after all of its parents."""
    count = draw(st.integers(1, 8))
    nodes = [PandaNode(f"n{index}") for index in range(count)]
    for index in range(1, count):
        above = draw(st.lists(st.integers(0, index - 1), min_size=1, max_size=3, unique=True))
        for parent in above:
            nodes[parent].add_child(nodes[index], draw(st.integers(-1, 1)))
        nodes[index].set_transform(nodes[index].transform.set_pos((float(index), 0.0, 1.0)))
    return nodes


def _shape(top):
    """Names, sort numbers, transforms and the order of parents, down from a node."""
    return [
        (
            node.name,
            node.transform.get_pos(),
            [parent.name for parent in node.parents],
            [(child.name, node.get_child_sort(child)) for child in node.children],
        )
        for node in top.iter_descendants()
    ]


@each_way
@settings(max_examples=20)
@given(nodes=graphs())
def test_random_graphs_keep_their_shape_and_share_nothing(duplicate, nodes):
    twin = duplicate(nodes[0])
    before = _shape(nodes[0])
    assert _shape(twin) == before
    assert not set(twin.iter_descendants()) & set(nodes)
    for node in twin.iter_descendants():
        node.set_transform(node.transform.set_pos((9.0, 9.0, 9.0)))
        node.name = "changed"
    assert _shape(nodes[0]) == before
    assert nodes[0].subtree_revision == max(node.subtree_revision for node in nodes)


@each_way
@settings(max_examples=20)
@given(nodes=graphs(), data=st.data())
def test_paths_that_are_copied_together_lead_into_one_tree(duplicate, nodes, data):
    places = NodePath(nodes[0]).find_all_matches("**")
    chosen = data.draw(st.lists(st.sampled_from(places), min_size=1, max_size=4))
    twins = duplicate(chosen)
    assert names(twins) == names(chosen)
    assert [a == b for a in twins for b in twins] == [a == b for a in chosen for b in chosen]
    assert len({twin.get_top().node() for twin in twins}) == 1
    assert twins[0].get_top().node() is not nodes[0]
    assert _shape(twins[0].get_top().node()) == _shape(nodes[0])
    for path in chosen:
        path.set_pos(7, 7, 7)
    assert all(twin.get_pos().tolist() != [7, 7, 7] for twin in twins)


def test_a_copied_path_is_a_tree_of_its_own_as_in_panda3d():
    root = panda.NodePath("root")
    theirs = root.attach_new_node("a")
    theirs.attach_new_node("b")
    deep, flat = copy.deepcopy(theirs), copy.copy(theirs)
    oracle = [deep.has_parent(), deep.get_num_children(), flat.has_parent(), flat.get_num_children()]
    t = tree("a", "a/b")
    deep, flat = copy.deepcopy(t["a"]), copy.copy(t["a"])
    assert [deep.has_parent(), deep.get_num_children(), flat.has_parent(), flat.get_num_children()] == oracle
    assert flat.get_child(0).node() is t["a/b"].node()
    assert deep.get_child(0).node() is not t["a/b"].node()
    assert deep.node() is not t["a"].node() is not flat.node()
    assert copy.deepcopy(NodePath()).is_empty()
    assert copy.copy(NodePath()).is_empty()


@each_way
def test_a_scene_with_a_held_path_is_copied_whole(duplicate):
    scene = Scene()
    held = scene.root.attach_new_node(GeomNode("box"))
    twin = duplicate(scene)
    twin.root.find("**/box").set_x(1.5)
    assert held.get_x() == 0.0
    assert twin.camera.get_parent() == twin.root
    assert twin.camera.node().lens is not scene.camera.node().lens
    held.set_x(3)
    assert twin.root.find("**/box").get_x() == 1.5
    assert [str(path) for path in held.get_ancestors()] == ["root/box", "root"]


@each_way
def test_a_change_below_a_copy_shows_in_the_copys_revision_alone(duplicate):
    scene = Scene()
    scene.root.attach_new_node("a").attach_new_node("b")
    twin = duplicate(scene)
    before = scene.root.node().subtree_revision, twin.root.node().subtree_revision
    twin.root.find("**/b").set_x(1)
    assert scene.root.node().subtree_revision == before[0]
    assert twin.root.node().subtree_revision == before[1] + 1


@each_way
def test_what_nodes_and_scenes_call_is_the_copys(duplicate):
    scene = _Bright()
    twin = duplicate(scene)
    twin.swarm.count = 5
    assert len(twin.root.find("**/swarm").node().evaluate(0.0)) == 5
    assert len(scene.root.find("**/swarm").node().evaluate(0.0)) == 2


class _Bright(Scene):
    def __init__(self):
        super().__init__()
        self.swarm = _Swarm()
        self.root.attach_new_node(PointLights("swarm", function=self.swarm.at))


@each_way
def test_particles_keep_to_the_light_of_their_own_copy(duplicate):
    scene = Scene()
    sun = DirectionalLight("sun")
    scene.root.attach_new_node(sun)
    smoke = ParticleNode("smoke", np.eye(3))
    smoke.set_shadow(ParticleShadow(sun))
    scene.root.attach_new_node(smoke)
    twin = duplicate(scene)
    assert twin.root.find("**/smoke").node().get_shadow().light is twin.root.find("**/sun").node()


def test_a_tree_of_any_depth_is_copied():
    node = top = PandaNode("top")
    for _ in range(500):
        child = PandaNode("n")
        node.add_child(child)
        node = child
    twin = copy.deepcopy(top)
    assert sum(1 for _ in twin.iter_descendants()) == 501


def test_a_copy_that_nobody_holds_is_freed_at_once():
    gc.disable()
    try:
        scene = Scene()
        scene.root.attach_new_node(GeomNode("box"))
        for duplicate in WAYS.values():
            twin = duplicate(scene)
            gone = weakref.ref(twin.root.find("**/box").node())
            del twin
            assert gone() is None
    finally:
        gc.enable()


def test_a_function_without_a_name_is_no_part_of_a_pickle():
    node = PointLights("lamps", function=lambda time: (np.zeros((1, 3)), (1, 1, 1), 1.0))
    assert copy.deepcopy(node).function is node.function
    with pytest.raises((pickle.PicklingError, AttributeError), match="lambda"):
        pickle.dumps(node)


def test_lights_keep_infinite_numbers():
    lamp = PointLight("lamp")
    assert _pickled(lamp).get_max_distance() == math.inf
