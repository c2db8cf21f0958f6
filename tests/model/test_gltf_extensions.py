"""Extensions that a file requires or uses: implemented, named, or refused by name."""

from __future__ import annotations

import pytest

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.extensions import HARMLESS, IMPLEMENTED, NAMED_ELSEWHERE, NEUTRAL
from tests.model.gltf_files import GltfFile
from tests.model.quads import read, shaded

PLAIN = {"pbrMetallicRoughness": {"metallicFactor": 0}}


def test_each_extension_has_one_place():
    assert IMPLEMENTED.isdisjoint(NAMED_ELSEWHERE | HARMLESS)
    assert NAMED_ELSEWHERE.isdisjoint(HARMLESS)


@pytest.mark.parametrize("name", sorted(IMPLEMENTED))
def test_what_is_implemented_may_be_required(tmp_path, name):
    file = shaded(GltfFile(), **PLAIN)
    file.json["extensionsUsed"] = file.json["extensionsRequired"] = [name]
    assert read(file, tmp_path).losses == []


def test_what_is_required_and_not_implemented_is_refused_by_name(tmp_path):
    file = shaded(GltfFile(), **PLAIN)
    file.json["extensionsRequired"] = ["KHR_mesh_quantization", "KHR_texture_basisu", "ACME_magic"]
    with pytest.raises(ModelError, match="extensionsRequired: KHR_texture_basisu, ACME_magic cannot be read"):
        read(file, tmp_path)


def test_what_is_used_and_unknown_is_named(tmp_path):
    file = shaded(GltfFile(), **PLAIN)
    file.json["extensionsUsed"] = ["ACME_magic", "KHR_materials_ior", "KHR_xmp_json_ld", "MSFT_lod"]
    assert read(file, tmp_path).losses == [
        "unknown extensions are not drawn: 'ACME_magic'",
        "of the levels of detail in MSFT_lod the first one is drawn",
    ]


@pytest.mark.parametrize("name", sorted(NEUTRAL))
def test_an_extension_of_a_material_is_named_where_it_changes_something(tmp_path, name):
    for changed in (False, True):
        values = dict(NEUTRAL[name]) if not changed else dict.fromkeys(NEUTRAL[name], 0.25)
        file = shaded(GltfFile(), extensions={name: values}, **PLAIN)
        file.json["extensionsUsed"] = [name]
        expected = [f"{name} is not drawn, of materials: 'paint'"] if changed else []
        assert read(file, tmp_path).losses == expected
