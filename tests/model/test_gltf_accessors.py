"""Accessors of every component type and type, packed, interleaved, normalised and sparse, against NumPy."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.accessors import read_accessor
from firefly_sample.model.gltf.document import Document
from tests.model.gltf_files import COMPONENT_TYPES, TYPES, GltfFile, packed

FOLDER = tempfile.TemporaryDirectory(prefix="firefly-tests-")
INTEGERS = ("i1", "u1", "i2", "u2", "u4")


def read(file: GltfFile, index: int = 0) -> np.ndarray:
    return read_accessor(Document.open(file.write(Path(FOLDER.name) / "a.glb")), index, "here")


def random_array(seed: int, dtype: str, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of the whole range of a type, its ends among them."""
    generator = np.random.default_rng(seed)
    if dtype == "f4":
        return generator.normal(size=shape).astype("<f4")
    limits = np.iinfo(dtype)
    array = generator.integers(limits.min, limits.max, size=shape, dtype=dtype, endpoint=True)
    array.reshape(-1)[:2] = (limits.min, limits.max)[: array.size]
    return array.astype(f"<{dtype}")


arrays = st.builds(
    lambda seed, dtype, count, shape: random_array(seed, dtype, (count, *shape)),
    st.integers(0, 10**6),
    st.sampled_from(sorted(COMPONENT_TYPES)),
    st.integers(1, 9),
    st.sampled_from(list(TYPES)),
)


@settings(max_examples=40)
@given(arrays)
def test_every_type_comes_back(array: np.ndarray) -> None:
    file = GltfFile()
    file.accessor(array)
    found = read(file)
    np.testing.assert_array_equal(found, array)
    assert found.dtype == (np.float64 if array.dtype.kind == "f" else array.dtype)


def test_columns_of_small_matrices_start_at_multiples_of_four_bytes() -> None:
    """The layouts of section 3.6.2.4: two 2x2 matrices of bytes, and one of 3x3 shorts."""
    file = GltfFile()
    file.add("accessors", bufferView=0, componentType=5121, count=2, type="MAT2")
    file.view(bytes([1, 2, 99, 99, 3, 4, 99, 99, 5, 6, 99, 99, 7, 8]))  # no padding behind the last
    file.add("accessors", bufferView=1, componentType=5123, count=1, type="MAT3")
    file.view(struct.pack("<11H", 1, 2, 3, 99, 4, 5, 6, 99, 7, 8, 9))
    np.testing.assert_array_equal(read(file, 0), [[[1, 3], [2, 4]], [[5, 7], [6, 8]]])
    np.testing.assert_array_equal(read(file, 1), [[[1, 4, 7], [2, 5, 8], [3, 6, 9]]])


@settings(max_examples=40)
@given(arrays, arrays, st.integers(0, 3), st.integers(0, 5), st.integers(0, 5))
def test_interleaved_accessors_of_one_view(
    first: np.ndarray, second: np.ndarray, before: int, between: int, behind: int
) -> None:
    """Two accessors share a view by stride and byteOffset, with filler that is never read."""
    count = min(len(first), len(second))
    rows = []
    for i in range(count):
        one, two = packed(first[i : i + 1]), packed(second[i : i + 1])
        rows.append(one + b"\xff" * between + two + b"\xff" * behind)
    file = GltfFile()
    view = file.view(b"\xff" * before + b"".join(rows), byteStride=len(rows[0]))
    offset = before
    for array in (first, second):
        file.add(
            "accessors",
            bufferView=view,
            byteOffset=offset,
            componentType=COMPONENT_TYPES[array.dtype.str[1:]],
            count=count,
            type=TYPES[array.shape[1:]],
        )
        offset += len(packed(array[:1])) + between
    np.testing.assert_array_equal(read(file, 0), first[:count])
    np.testing.assert_array_equal(read(file, 1), second[:count])


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2"])
def test_normalised_integers_are_those_of_the_specification(dtype: str) -> None:
    """Every code: c / max, and not below -1; the ends and zero are exact."""
    limits = np.iinfo(dtype)
    codes = np.arange(limits.min, limits.max + 1).astype(f"<{dtype}")
    file = GltfFile()
    file.accessor(codes, normalized=True)
    found = read(file)
    np.testing.assert_array_equal(found, [max(code / limits.max, -1.0) for code in codes.tolist()])
    assert (found[0], found[-1], found[codes == 0]) == (-1.0 if limits.min else 0.0, 1.0, 0.0)


@pytest.mark.parametrize("dtype", ["f4", "u4"])
def test_types_that_cannot_be_normalised_are_as_they_are(dtype: str) -> None:
    array = random_array(1, dtype, (4, 3))
    file = GltfFile()
    file.accessor(array, normalized=True)
    np.testing.assert_array_equal(read(file), array)


def sparse(file: GltfFile, places: np.ndarray, values: np.ndarray, **properties: object) -> int:
    """Append a sparse accessor; `properties` are those of the accessor itself."""
    return file.add(
        "accessors",
        **{
            "componentType": COMPONENT_TYPES[values.dtype.str[1:]],
            "type": TYPES[values.shape[1:]],
            "sparse": {
                "count": len(places),
                "indices": {
                    "bufferView": file.view(places.tobytes()),
                    "componentType": COMPONENT_TYPES[places.dtype.str[1:]],
                },
                "values": {"bufferView": file.view(packed(values))},
            },
            **properties,
        },
    )


@settings(max_examples=40)
@given(arrays, st.sampled_from(["u1", "u2", "u4"]), st.booleans(), st.data())
def test_sparse_elements_replace_others_or_zeros(
    base: np.ndarray, dtype: str, has_base: bool, data: st.DataObject
) -> None:
    places = np.array(
        sorted(data.draw(st.sets(st.integers(0, len(base) - 1), min_size=1))), dtype=f"<{dtype}"
    )
    values = random_array(7, base.dtype.str[1:], (len(places), *base.shape[1:]))
    file = GltfFile()
    view = {"bufferView": file.view(packed(base))} if has_base else {}
    expected = base.copy() if has_base else np.zeros_like(base)
    expected[places] = values
    np.testing.assert_array_equal(read(file, sparse(file, places, values, count=len(base), **view)), expected)


def test_sparse_elements_may_have_offsets_and_are_normalised_with_the_others() -> None:
    file = GltfFile()
    places = file.view(bytes([99, 0, 2]))
    values = file.view(bytes([99, 99, 127, 0x80]))
    file.add(
        "accessors",
        componentType=5120,
        count=3,
        type="SCALAR",
        normalized=True,
        sparse={
            "count": 2,
            "indices": {"bufferView": places, "byteOffset": 1, "componentType": 5121},
            "values": {"bufferView": values, "byteOffset": 2},
        },
    )
    np.testing.assert_array_equal(read(file), [1.0, 0.0, -1.0])


def test_an_accessor_without_a_view_is_zero() -> None:
    file = GltfFile()
    file.add("accessors", componentType=5126, count=5, type="MAT4")
    np.testing.assert_array_equal(read(file), np.zeros((5, 4, 4)))


def test_extremes_of_the_file_are_not_trusted() -> None:
    file = GltfFile()
    file.accessor(np.array([[1.0, 2.0]]), min=["a"], max=[-1e30, 0.0])
    np.testing.assert_array_equal(read(file), [[1.0, 2.0]])


HALF = b"\0" * 6
LIES = [
    ({"count": 10**15}, "ends at byte 2000000000000000 of a view that has 6 bytes"),
    ({"count": 10**40}, "ends at byte a number above 1e20"),
    ({"count": 4}, "ends at byte 8 of a view that has 6 bytes"),
    ({"byteOffset": 2}, "ends at byte 8"),
    ({"byteOffset": 10**30, "count": 0}, "ends at byte a number above 1e20"),
    ({"count": -1}, "count: must be at least 0"),
    ({"count": True}, "count: must be a whole number, got true"),
    ({"componentType": 5124}, "componentType: must be one of 5120, 5121, 5122, 5123, 5125, 5126, got 5124"),
    ({"componentType": "5123"}, "componentType: must be a whole number"),
    ({"type": "VEC5"}, "type: must be one of SCALAR, VEC2"),
    ({"type": 3}, "type: must be a text"),
    ({"normalized": 1}, "normalized: must be true or false"),
    ({"bufferView": 1}, r"bufferView: refers to bufferViews\[1\], but the file has 1 bufferViews"),
    ({"bufferView": None}, "bufferView: must be a whole number"),
    ({"sparse": {}}, "sparse.count: is missing"),
    ({"sparse": {"count": 4}}, "sparse.count: must be 0 to 3, got 4"),
    ({"sparse": {"count": 1}}, "sparse.indices: is missing"),
]


@pytest.mark.parametrize(("lie", "message"), LIES)
def test_lies_are_errors_with_their_place(lie: dict[str, object], message: str) -> None:
    file = GltfFile()
    file.view(HALF)
    file.add("accessors", **({"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"} | lie))
    with pytest.raises(ModelError, match=rf"a.glb: accessors\[0\].*{message}"):
        read(file)


@pytest.mark.parametrize("count", [10**9, 10**15, 10**40])
def test_zeros_without_a_view_are_limited(count: int) -> None:
    file = GltfFile()
    file.add("accessors", componentType=5126, count=count, type="VEC3")
    with pytest.raises(ModelError, match=r"accessors\[0\]: too large"):
        read(file)


def test_a_stride_below_the_size_of_an_element() -> None:
    file = GltfFile()
    file.accessor(np.zeros((4, 3)))
    file.json["bufferViews"][0]["byteStride"] = 8
    with pytest.raises(ModelError, match="its elements have 12 bytes, but its view's stride is 8"):
        read(file)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_floats_are_finite(value: float) -> None:
    array = np.zeros((4, 2))
    array[2, 1] = value
    file = GltfFile()
    file.accessor(array, min=[0, 0], max=[0, 0])
    with pytest.raises(ModelError, match=r"accessors\[0\]: element 2 has a number that is not finite"):
        read(file)


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ([1, 1], "must ascend strictly"),
        ([2, 1], "must ascend strictly"),
        ([1, 3], "an index is 3, but the accessor has 3 elements"),
    ],
)
def test_sparse_indices(places: list[int], message: str) -> None:
    file = GltfFile()
    sparse(file, np.array(places, "<u2"), np.zeros((2, 2), "<f4"), count=3)
    with pytest.raises(ModelError, match=rf"accessors\[0\]\.sparse\.indices: {message}"):
        read(file)


def test_sparse_indices_are_unsigned() -> None:
    file = GltfFile()
    sparse(file, np.array([0, 1], "<i2"), np.zeros((2, 2), "<f4"), count=3)
    with pytest.raises(ModelError, match=r"sparse\.indices\.componentType: must be 5121, 5123 or 5125"):
        read(file)


def test_types_that_are_not_allowed_there() -> None:
    file = GltfFile()
    file.accessor(np.zeros((4, 2)))
    document = Document.open(file.write(Path(FOLDER.name) / "a.glb"))
    assert read_accessor(document, 0, "here", ("VEC2", "VEC3")).shape == (4, 2)
    with pytest.raises(ModelError, match="here: must be of type VEC3 or VEC4, got VEC2"):
        read_accessor(document, 0, "here", ("VEC3", "VEC4"))
