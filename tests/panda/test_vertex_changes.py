"""Vertices that move, and the numbers by which this is seen."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from firefly_sample.model.panda3d.vertices import animated_data, vertex_revision
from tests.panda.geoms import (
    NORMAL,
    POSITION,
    E,
    geom_of,
    panda_rows,
    read,
    triangle,
    vertex_data,
    vertex_format,
)
from tests.panda.scenes import load


def test_what_does_not_change_keeps_its_revision():
    geom = geom_of(vertex_data(vertex_format([[POSITION]]), 3), triangle())
    before = vertex_revision(geom)
    read(geom)
    panda_rows(geom.get_vertex_data(), "vertex", 3)
    assert vertex_revision(geom) == before
    assert hash(before) == hash(vertex_revision(geom))


def written(geom):
    core.GeomVertexWriter(geom.modify_vertex_data(), "vertex").set_data3(1, 2, 3)


def rewritten(geom):
    rewriter = core.GeomVertexRewriter(geom.modify_vertex_data(), "normal")
    rewriter.set_row(1)
    rewriter.set_data3(1, 0, 0)


def poked(geom):
    memoryview(geom.modify_vertex_data().modify_array(0)).cast("B")[:4] = b"1234"


def poked_by_handle(geom):
    data = geom.modify_vertex_data()
    data.modify_array_handle(1).copy_data_from(data.get_array_handle(1))


def replaced(geom):
    geom.set_vertex_data(vertex_data(vertex_format([[POSITION]]), 5))


def replaced_array(geom):
    data = geom.modify_vertex_data()
    data.set_array(0, core.GeomVertexArrayData(data.get_format().get_array(0), E.UH_static))


def lengthened(geom):
    data = geom.modify_vertex_data()
    data.set_num_rows(data.get_num_rows() + 1)


def added_to(geom):
    geom.modify_primitive(0).add_vertices(2, 1, 0)


def offset(geom):
    geom.offset_vertices(geom.get_vertex_data(), 1)


def reversed_(geom):
    geom.reverse_in_place()


def another(geom):
    geom.add_primitive(triangle(2, 1, 0))


def removed(geom):
    geom.remove_primitive(0)


def cleared(geom):
    geom.clear_primitives()


def transformed(geom):
    geom.transform_vertices(core.LMatrix4.translate_mat(1, 2, 3))


CHANGES = (
    written,
    rewritten,
    poked,
    poked_by_handle,
    replaced,
    replaced_array,
    lengthened,
    added_to,
    offset,
    reversed_,
    another,
    removed,
    cleared,
    transformed,
)


@pytest.mark.parametrize("change", CHANGES)
def test_every_change_has_a_revision_of_its_own(change):
    geom = geom_of(vertex_data(vertex_format([[POSITION], [NORMAL]]), 4), triangle())
    before = vertex_revision(geom)
    change(geom)
    after = vertex_revision(geom)
    assert after != before
    if change not in (offset, removed, cleared):  # which need what is gone then
        change(geom)
        assert vertex_revision(geom) not in (before, after)


def test_a_writer_that_goes_back_to_a_row_is_seen_again():
    geom = geom_of(vertex_data(vertex_format([[POSITION]]), 3), triangle())
    writer = core.GeomVertexWriter(geom.modify_vertex_data(), "vertex")
    seen = set()
    for number in range(3):
        writer.set_row(1)
        writer.set_data3(number, 0, 0)
        seen.add(vertex_revision(geom))
    assert len(seen) == 3


def test_a_kept_primitive_that_grows_is_seen():
    geom = geom_of(vertex_data(vertex_format([[POSITION]]), 3), triangle())
    primitive = geom.modify_primitive(0)
    before = vertex_revision(geom)
    primitive.add_vertices(2, 1, 0)
    assert vertex_revision(geom) != before


REST = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1]], dtype=float)
HELD = "vertices that a shader is to move by joints stay where they are: 'node'"


def jointed():
    """A Geom with two joints, of which every other vertex follows the second by three quarters, and a slider
    that lifts vertices by their row."""
    animation = core.GeomVertexAnimationSpec()
    animation.set_panda()
    morph = core.InternalName.get_morph("vertex", "lift")
    layout = vertex_format(
        [
            [POSITION, NORMAL, (morph, 3, E.NT_float32, E.C_morph_delta)],
            [("transform_blend", 1, E.NT_uint16, E.C_index)],
        ],
        animation=animation,
    )
    data = vertex_data(layout, 4, vertex=REST, normal=[(0, -1, 0)] * 4, transform_blend=[(0,), (1,)] * 2)
    writer = core.GeomVertexWriter(data, morph)
    for row in range(4):
        writer.set_data3(0, 0, row)
    joints = [core.UserVertexTransform("still"), core.UserVertexTransform("moving")]
    blends = core.TransformBlendTable()
    blends.add_blend(core.TransformBlend(joints[0], 1.0))
    blends.add_blend(core.TransformBlend(joints[0], 0.25, joints[1], 0.75))
    rows = core.SparseArray()
    rows.set_range(0, 4)
    blends.set_rows(rows)
    data.set_transform_blend_table(blends)
    slider = core.UserVertexSlider("lift")
    sliders = core.SliderTable()
    sliders.add_slider(slider, rows)
    data.set_slider_table(core.SliderTable.register_table(sliders))
    strip = core.GeomTristrips(E.UH_static)
    strip.add_consecutive_vertices(0, 4)
    strip.close_primitive()
    return geom_of(data, strip), joints[1], slider


@pytest.mark.parametrize("hardware", [False, True])
def test_joints_and_sliders_move_vertices(hardware):
    option = core.ConfigVariableBool("hardware-animated-vertices")
    option.set_value(hardware)
    try:
        source, joint, slider = jointed()
        revisions = [vertex_revision(source)]
        (geom,), lost = read(source)
        assert np.array_equal(geom.vertices, REST)
        joint.set_matrix(core.LMatrix4.translate_mat(4, 0, 0) * core.LMatrix4.rotate_mat(0, (0, 0, 1)))
        revisions.append(vertex_revision(source))
        expected = REST + np.outer([0, 3, 0, 3], [1, 0, 0])
        assert np.allclose(read(source)[0][0].vertices, expected, atol=1e-6)
        slider.set_slider(2.0)
        revisions.append(vertex_revision(source))
        expected += np.outer([0, 2, 4, 6], [0, 0, 1])
        assert np.allclose(read(source)[0][0].vertices, expected, atol=1e-6)
        assert len(set(revisions)) == 3
        assert vertex_revision(source) == revisions[-1]
        assert lost == []
    finally:
        option.clear_local_value()


def test_vertices_for_a_shader_that_moves_them_are_named():
    animation = core.GeomVertexAnimationSpec()
    animation.set_hardware(2, True)
    data = vertex_data(vertex_format([[POSITION]], animation=animation), 4, vertex=REST)
    (geom,), lost = read(geom_of(data, triangle()))
    assert np.array_equal(geom.vertices, REST[:3])
    assert lost == [HELD]


def test_a_character_moves_as_panda3d_moves_it():
    path = load("models/panda-model.egg.pz")
    character = path.find("**/+Character").node()
    bundle = character.get_bundle(0)
    walk = load("models/panda-walk4.egg.pz").find("**/+AnimBundleNode").node().get_bundle()
    control = bundle.bind_anim(walk, -1)
    assert control is not None
    (node,) = path.find_all_matches("**/+GeomNode")
    source = node.node().get_geom(0)
    seen = []
    for frame in (0, 7):
        control.pose(frame)
        character.force_update()
        revision = vertex_revision(source)
        (geom,), lost = read(source)
        assert lost == []
        moved = source.get_animated_vertex_data(True, core.Thread.get_current_thread())
        corners = source.decompose().get_primitive(0)
        first = [corners.get_vertex(corner) for corner in range(3)]
        assert animated_data(source).this == moved.this
        assert np.array_equal(geom.vertices[geom.triangles[0]], panda_rows(moved, "vertex", 3)[first])
        seen.append((revision, geom.vertices))
    assert seen[0][0] != seen[1][0]
    assert np.abs(seen[0][1] - seen[1][1]).max() > 1.0
