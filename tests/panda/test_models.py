"""Every model that Panda3D's wheel brings, under lights of all kinds, beside Panda3D's own picture."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.interop.panda3d import from_panda3d
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.traversal import iter_visible
from tests.panda.compare import agreement, draw_ours
from tests.panda.scenes import MODELS, load, model_scene

ANIMATIONS = {"models/panda-walk.egg.pz", "models/panda-walk4.egg.pz"}
"""Files without geometry."""
OVERLAPPING = {"models/gui/dialog_box_gui.egg.pz", "models/misc/objectHandles.egg.pz"}
"""Models with blended surfaces. In Panda3D, which keeps their depth, those that are drawn first hide others.
Ours are all seen."""


@pytest.mark.parametrize("name", [name for name in MODELS if name not in ANIMATIONS])
def test_the_picture_is_panda3ds(by_panda, name):
    theirs = by_panda(model_scene, name)
    ours, warned = draw_ours(model_scene, name)
    found = agreement(theirs, ours)
    check_coverage(found, theirs)
    assert found.covered > 0.009
    if any("without normals" in line for line in warned):
        # lit by us, black there: what is left to compare is the picture without lights
        theirs = by_panda(model_scene, name, False)
        found = agreement(theirs, draw_ours(model_scene, name, False)[0])
        check_coverage(found, theirs)
    assert name in OVERLAPPING or found.mean <= 0.1


def check_coverage(found, theirs) -> None:
    """No pixel differs but on edges, and of those at most one in a hundred of the picture's."""
    assert found.strays == 0
    assert found.edges <= 0.02 * theirs.covered.sum()


@pytest.mark.parametrize("name", sorted(ANIMATIONS))
def test_a_file_of_an_animation_alone_has_nothing_to_draw(name):
    scene = from_panda3d(load(name))
    nodes = [visit.node for visit in iter_visible(scene.root)]
    assert len(nodes) == len(load(name).find_all_matches("**")) + 1  # and a camera
    assert not any(isinstance(node, GeomNode) and node.geoms for node in nodes)
    assert np.array_equal(scene.camera.get_net_mat(), np.eye(4))
