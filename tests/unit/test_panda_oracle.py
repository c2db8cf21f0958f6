"""Ours against Panda3D itself, on generated trees; bounds in panda_twins."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.nodepath import NodePath
from tests.unit.panda_twins import (
    EPS32,
    Local,
    Twins,
    columns,
    first_order_bound,
    float32s,
    locals_,
    matrix_bound,
    positive_scales,
    scales,
    trees,
    vectors,
)

picks = st.integers(0, 20)


def assert_near(ours, theirs, bound):
    difference = np.abs(np.asarray(ours) - np.asarray(theirs))
    assert (difference <= bound).all(), f"off by {difference.max():g}, allowed {np.max(bound):g}"


# --- Matrices ---


@given(trees())
def test_net_matrices(nodes):
    twins = Twins.grown(nodes)
    for ours, theirs in zip(twins.ours, twins.theirs, strict=True):
        expected = columns(theirs.get_net_transform().get_mat())
        assert_near(columns(ours.get_net_mat()), expected, matrix_bound(ours, twins.ours[0]))


@given(trees(), picks, picks)
def test_relative_matrices(nodes, a, b):
    twins = Twins.grown(nodes)
    (path, other), (oracle, oracle_other) = twins.pick(a, b)
    bound = matrix_bound(path, other)
    assert_near(columns(path.get_mat(other)), columns(oracle.get_mat(oracle_other)), bound)
    assert_near(path.get_pos(other), oracle.get_pos(oracle_other), bound[3])
    assert_near(path.get_distance(other), oracle.get_distance(oracle_other), bound[3].sum())


@given(trees(), picks, picks, vectors(-10, 10))
def test_relative_points_and_vectors(nodes, a, b, point):
    twins = Twins.grown(nodes)
    (path, other), (oracle, oracle_other) = twins.pick(a, b)
    bound = np.abs([*point, 1]) @ matrix_bound(other, path)
    for name in ("get_relative_point", "get_relative_vector"):
        ours, theirs = getattr(path, name)(other, point), getattr(oracle, name)(oracle_other, point)
        assert_near(ours, theirs, bound)


@given(trees(), picks, picks)
def test_wrt_reparent_to(nodes, a, b):
    twins = Twins.grown(nodes)
    (path, other), (oracle, oracle_other) = twins.pick(a, b)
    assume(not path.is_ancestor_of(other))
    bound = matrix_bound(path, other)
    path.wrt_reparent_to(other)
    oracle.wrt_reparent_to(oracle_other)
    assert str(path) == str(oracle)
    assert_near(columns(path.get_mat()), columns(oracle.get_mat()), bound)


# --- Components ---


def our_branches(chain_a: list[Local], chain_b: list[Local]) -> tuple[NodePath, NodePath]:
    """The ends of two chains below one root."""
    twins, a, b = Twins.branches(chain_a, chain_b)
    return twins.ours[a], twins.ours[b]


chains = st.lists(locals_(), min_size=1, max_size=2)
positive_chains = st.lists(locals_(positive_scales), min_size=1, max_size=2)


uniform_scales = st.sampled_from((0.5, -0.5, -1.0, 2.0, -3.0)).map(lambda s: (s, s, s))
uniform_chains = st.lists(
    st.builds(Local, vectors(-10, 10), vectors(-180, 180), uniform_scales, st.just((0.0, 0.0, 0.0))),
    min_size=1,
    max_size=2,
)


@given(uniform_chains, uniform_chains, scales)
def test_signs_of_scale_below_uniform_scales(up, down, scale):
    # Here components say more than the matrix: many triples of signs and angles make the same one.
    down = [*down, Local((0.0, 0.0, 0.0), (10.0, 20.0, 30.0), scale, (0.0, 0.0, 0.0))]
    twins, a, b = Twins.branches(up, down)
    ours = twins.ours[b].get_scale(twins.ours[a])
    np.testing.assert_allclose(ours, twins.theirs[b].get_scale(twins.theirs[a]), rtol=8 * EPS32)


@given(positive_chains, positive_chains)
def test_relative_components(up, down):
    def components(given_):
        other, path = our_branches(given_[: len(up)], given_[len(up) :])
        return flat(path.get_hpr(other), path.get_quat(other), path.get_scale(other), path.get_shear(other))

    def flat(hpr, quat, scale, shear):
        # Angles without their turns, quaternions without their signs.
        turns = np.sin(np.radians(hpr)), np.cos(np.radians(hpr)), np.outer(quat, quat).ravel()
        return np.concatenate([*turns, scale, shear])

    bound = first_order_bound(components, up + down)
    assume(bound.max() < 0.1)  # not straight up, where heading and roll cannot be told apart
    twins, a, b = Twins.branches(up, down)
    oracle, other = twins.theirs[b], twins.theirs[a]
    expected = flat(
        oracle.get_hpr(other), oracle.get_quat(other), oracle.get_scale(other), oracle.get_shear(other)
    )
    assert_near(components(up + down), expected, bound)


quats = st.tuples(*[float32s(-1, 1)] * 4).filter(lambda quat: np.linalg.norm(quat) > 0.1)
SETTERS = {
    "set_pos": vectors(-10, 10),
    "set_hpr": vectors(-80, 80),
    "set_scale": positive_scales,
    "set_shear": vectors(-1, 1),
    "set_quat": quats,
    "set_x": float32s(-10, 10),
    "set_h": float32s(-80, 80),
    "set_sz": float32s(0.25, 4),
    "set_shxz": float32s(-1, 1),
}
PAIRS = {
    "set_pos_hpr": (vectors(-10, 10), vectors(-80, 80)),
    "set_hpr_scale": (vectors(-80, 80), positive_scales),
    "set_pos_quat": (vectors(-10, 10), quats),
}
setters = {name: (values,) for name, values in SETTERS.items()} | PAIRS
settings_ = st.sampled_from(sorted(setters)).flatmap(
    lambda name: st.tuples(st.just(name), st.tuples(*setters[name]))
)


@given(chains, chains, settings_, st.booleans())
def test_setters(up, down, setting, relative):
    name, values = setting

    def matrix_after(given_):
        other, path = our_branches(given_[: len(up)], given_[len(up) :])
        getattr(path, name)(*([other] if relative else []), *values)
        return columns(path.get_mat())

    bound = first_order_bound(matrix_after, up + down)
    assume(bound.max() < 0.1)
    twins, a, b = Twins.branches(up, down)
    arguments = [panda.LQuaternionf(*value) if np.size(value) == 4 else value for value in values]
    getattr(twins.theirs[b], name)(*([twins.theirs[a]] if relative else []), *arguments)
    assert_near(matrix_after(up + down), columns(twins.theirs[b].get_mat()), bound)


up_vectors = vectors(-1, 1).filter(lambda up: not any(up) or np.linalg.norm(up) > 0.1)
LOOKS = {
    "a point": lambda eye, other, point, up: eye.look_at(point),
    "a point, and up": lambda eye, other, point, up: eye.look_at(point, up),
    "another": lambda eye, other, point, up: eye.look_at(other),
    "another's point": lambda eye, other, point, up: eye.look_at(other, point),
    "another's point, and up": lambda eye, other, point, up: eye.look_at(other, point, up),
}


@given(chains, chains, vectors(-10, 10), up_vectors, st.sampled_from(sorted(LOOKS)))
def test_look_at(up, down, point, up_vector, how):
    def matrix_after(given_):
        other, eye = our_branches(given_[: len(up)], given_[len(up) :])
        LOOKS[how](eye, other, point, up_vector)
        return columns(eye.get_mat())

    bound = first_order_bound(matrix_after, up + down)
    assume(bound.max() < 0.1)
    twins, a, b = Twins.branches(up, down)
    LOOKS[how](twins.theirs[b], twins.theirs[a], panda.LPoint3f(*point), panda.LVector3f(*up_vector))
    assert_near(matrix_after(up + down), columns(twins.theirs[b].get_mat()), bound)


def test_lights_begin_as_pandas_do():
    pairs = [
        (AmbientLight("a"), panda.AmbientLight("a")),
        (PointLight("p"), panda.PointLight("p")),
        (DirectionalLight("d"), panda.DirectionalLight("d")),
        (Spotlight("s"), panda.Spotlight("s")),
    ]
    for ours, theirs in pairs:
        assert tuple(ours.get_color()) == tuple(theirs.get_color())[:3]
        if not isinstance(ours, AmbientLight):
            assert ours.is_shadow_caster() == theirs.is_shadow_caster()
            assert tuple(ours.get_specular_color()) == tuple(theirs.get_specular_color())[:3]
        if isinstance(ours, PointLight | Spotlight):
            assert tuple(ours.get_attenuation()) == tuple(theirs.get_attenuation())
            assert ours.get_max_distance() == theirs.get_max_distance()
    spot, theirs = pairs[-1]
    assert spot.get_exponent() == theirs.get_exponent()
    assert abs(spot.get_lens().get_hfov() - theirs.get_lens().get_hfov()) < 1e-12
