"""Visible and whole masks of crowds of objects against ray casting."""

import numpy as np
import pytest

from firefly_sample.capture.datasets.instances import find_instances, instance_records, owner_image
from firefly_sample.capture.datasets.silhouettes import draw_silhouettes
from tests.capture.objects import crowd, rays, sure_hits, sure_owner
from tests.conftest import borrow_renderer

SIZE = 64, 48


@pytest.mark.parametrize(("seed", "count"), [(0, 12), (1, 9), (2, 8), (3, 5)])
def test_masks_are_what_rays_meet(seed, count):
    scene, meshes, to_pixels = crowd(seed, SIZE, count)
    with borrow_renderer(SIZE) as renderer:
        plan = renderer.plan(scene, 0.0, ("id", "position"))
        frame = renderer.draw(plan)
        instances = find_instances(plan)
        whole = draw_silhouettes(renderer, plan, instances)
    assert [instance.name for instance in instances] == [f"root/place {i}/thing {i}" for i in range(count)]

    owners = owner_image(frame["id"], instances)
    expected, sure = sure_owner(meshes, *rays(to_pixels, SIZE))
    assert np.array_equal(owners.ravel()[sure], expected[sure])
    assert (~sure).sum() <= 12  # of 3,072 pixels, with an edge within a hair of their centre

    # the whole silhouettes, on a canvas of nine pictures
    width, height = SIZE
    canvas = rays(to_pixels, SIZE, tiles=1)
    inside = np.s_[height : 2 * height, width : 2 * width]
    records = instance_records(frame["id"], instances, whole)
    overlapping = outside = left_out = pixels = 0
    for number, (mesh, silhouette) in enumerate(zip(meshes, whole, strict=True)):
        met, sure = (each.reshape(3 * height, 3 * width) for each in sure_hits(mesh, *canvas))
        doubtful = int((~sure).sum())
        left_out += doubtful
        mask = silhouette.mask()
        assert np.array_equal(mask[sure[inside]], met[inside][sure[inside]])
        certain = int((met & sure).sum())
        assert certain <= silhouette.pixels <= certain + doubtful
        rows, columns = np.nonzero(met)
        if len(rows):
            box = columns.min() - width, rows.min() - height, np.ptp(columns) + 1, np.ptp(rows) + 1
            assert np.abs(np.subtract(silhouette.box, box)).max() <= 1
        record = records[number]
        assert record["whole"]["pixels"] == silhouette.pixels >= record["visible"]["pixels"]
        assert not (owners == number)[~mask].any()  # what is visible is a part of it
        pixels += silhouette.pixels
        overlapping += 0 < record["visible"]["pixels"] < record["whole"]["in_picture"]
        outside += 0 < record["whole"]["in_picture"] < record["whole"]["pixels"]
    assert overlapping >= 1
    assert outside >= 1
    assert left_out <= 24 < pixels / 30  # of all instances' 27,648 pixels each
