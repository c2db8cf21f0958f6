"""One tetrahedron as a file of every format, and its picture, for tests of readers."""

from __future__ import annotations

import bz2
import io
import struct
import tarfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

VERTICES = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]])
"""1 long along X, 2 along Y and 3 along Z, from a corner with right angles at the origin."""
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
ORANGE = (255, 128, 0)
"""A display colour, of the files that have one."""


def _text(rows: Sequence[Sequence[object]], prefix: str = "") -> str:
    return "".join(f"{prefix}{' '.join(map(str, row))}\n" for row in rows)


def _corners() -> np.ndarray:
    return VERTICES[FACES]


def obj() -> bytes:
    return (_text(VERTICES.tolist(), "v ") + _text((FACES + 1).tolist(), "f ")).encode()


def ply_text() -> bytes:
    rows = [[*vertex, *ORANGE] for vertex in VERTICES.tolist()]
    header = "ply\nformat ascii 1.0\nelement vertex 4\n"
    header += "".join(f"property float {name}\n" for name in "xyz")
    header += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    return (header + _text(rows) + _text([[3, *face] for face in FACES.tolist()])).encode()


def ply_binary(order: str = "little") -> bytes:
    sign = {"little": "<", "big": ">"}[order]
    header = f"ply\nformat binary_{order}_endian 1.0\nelement vertex 4\n"
    header += "".join(f"property double {name}\n" for name in "xyz")
    header += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = b"".join(struct.pack(f"{sign}B3i", 3, *face) for face in FACES.tolist())
    return header.encode() + VERTICES.astype(f"{sign}f8").tobytes() + rows


def stl_binary() -> bytes:
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *corners.ravel(), 0) for corners in _corners())
    return b"binary".ljust(80, b" ") + struct.pack("<I", len(FACES)) + rows


def stl_text() -> bytes:
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + _text(corners.tolist(), "vertex ") + "endloop\nendfacet\n"
        for corners in _corners()
    )
    return f"solid tetra\n{facets}endsolid tetra\n".encode()


def off() -> bytes:
    faces = [[3, *face] for face in FACES.tolist()]
    return f"OFF\n4 4 0\n{_text(VERTICES.tolist())}{_text(faces)}".encode()


def dae(up: str = "Z_UP", effect: str | None = None, extra: str = "") -> bytes:
    """Return a COLLADA file with a material called Paint, on a node called Leaf below one called Branch."""
    color = " ".join(str(code / 255) for code in ORANGE)
    effect = effect or f"<lambert><diffuse><color>{color} 1</color></diffuse></lambert>"
    numbers = " ".join(map(str, VERTICES.ravel().tolist()))
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/><up_axis>{up}</up_axis></asset>{extra}
<library_images><image id="wood"><init_from>wood.png</init_from></image></library_images>
<library_effects><effect id="paint-fx"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>wood</init_from></surface></newparam>
<newparam sid="p"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="common">{effect}</technique></profile_COMMON></effect></library_effects>
<library_materials><material id="paint" name="Paint">
<instance_effect url="#paint-fx"/></material></library_materials>
<library_geometries><geometry id="tetra" name="Tetra"><mesh>
<source id="pos">
<float_array id="pos-array" count="12">{numbers}</float_array><technique_common>
<accessor source="#pos-array" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#pos"/></vertices>
<triangles count="4" material="M"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{" ".join(map(str, FACES.ravel().tolist()))}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="branch" name="Branch">
<node id="leaf" name="Leaf">
<instance_geometry url="#tetra"><bind_material><technique_common>
<instance_material symbol="M" target="#paint"/></technique_common></bind_material></instance_geometry>
</node></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>""".encode()


def zipped(files: dict[str, bytes]) -> bytes:
    kept = io.BytesIO()
    with zipfile.ZipFile(kept, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return kept.getvalue()


def tarred(files: dict[str, bytes], mode: str) -> bytes:
    kept = io.BytesIO()
    with tarfile.open(fileobj=kept, mode=f"w:{mode}") as archive:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return kept.getvalue()


def model_3mf(extra: str = "", components: str = "", items: str = '<item objectid="1"/>') -> bytes:
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*vertex) for vertex in VERTICES.tolist())
    triangles = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*face) for face in FACES.tolist())
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter"
 xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
 xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"><resources>{extra}
<object id="1" name="Tetra" type="model"><mesh><vertices>{vertices}</vertices>
<triangles>{triangles}</triangles>
</mesh></object>{components}</resources><build>{items}</build></model>"""
    return zipped({"3D/3dmodel.model": text.encode()})


def model_3dxml() -> bytes:
    space = 'xmlns="http://www.3ds.com/xsd/3DXML"'
    positions = ",".join(" ".join(map(str, vertex)) for vertex in VERTICES.tolist())
    red, green, blue = (code / 255 for code in ORANGE)
    manifest = f"<Manifest {space}><Root>root.3dxml</Root></Manifest>"
    root = f"""<Model_3dxml {space}><ProductStructure root="1"><Reference3D id="1" name="Whole"/>
<Reference3D id="2" name="Part"/><ReferenceRep id="3" name="Rep" format="TESSELLATED"
 associatedFile="urn:3DXML:part.3DRep"/>
<Instance3D id="4" name="Part.1">
<IsAggregatedBy>1</IsAggregatedBy><IsInstanceOf>2</IsInstanceOf>
<RelativeMatrix>1 0 0 0 1 0 0 0 1 0 0 0</RelativeMatrix></Instance3D>
<InstanceRep id="5" name="Rep.1">
<IsAggregatedBy>2</IsAggregatedBy><IsInstanceOf>3</IsInstanceOf></InstanceRep>
</ProductStructure></Model_3dxml>"""
    part = f"""<XMLRepresentation {space} xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><Root><Rep><Faces>
<Face triangles="{" ".join(map(str, FACES.ravel().tolist()))}"><SurfaceAttributes>
<Color xsi:type="RGBAColorType" red="{red}" green="{green}" blue="{blue}"/></SurfaceAttributes></Face></Faces>
<VertexBuffer><Positions>{positions}</Positions><Normals>{positions}</Normals></VertexBuffer></Rep></Root>
</XMLRepresentation>"""
    files = {"Manifest.xml": manifest, "root.3dxml": root, "part.3DRep": part}
    return zipped({name: text.encode() for name, text in files.items()})


def xaml() -> bytes:
    positions = " ".join(",".join(map(str, vertex)) for vertex in VERTICES.tolist())
    indices = " ".join(map(str, FACES.ravel().tolist()))
    color = "#{:02X}{:02X}{:02X}".format(*ORANGE)
    return f"""<ModelVisual3D xmlns="http://schemas.microsoft.com/winfx/2006/xaml/presentation">
<ModelVisual3D.Content>
<GeometryModel3D><GeometryModel3D.Material><DiffuseMaterial><DiffuseMaterial.Brush>
<SolidColorBrush Color="{color}" Opacity="1"/></DiffuseMaterial.Brush></DiffuseMaterial>
</GeometryModel3D.Material>
<GeometryModel3D.Geometry><MeshGeometry3D
 Positions="{positions}" Normals="{positions}" TriangleIndices="{indices}"/>
</GeometryModel3D.Geometry></GeometryModel3D></ModelVisual3D.Content></ModelVisual3D>""".encode()


def ctm() -> bytes:
    """Return an uncompressed OpenCTM file of version 5, with an empty comment."""
    head = struct.pack("<4sI4s6I", b"OCTM", 5, b"RAW\0", len(VERTICES), len(FACES), 0, 0, 0, 0)
    indices = FACES.astype("<u4").tobytes()
    return head + b"INDX" + indices + b"VERT" + VERTICES.astype("<f4").tobytes()


def step() -> bytes:
    """Return a STEP file (AP214) of a solid with plane faces, in millimetres."""
    return _Step().text().encode()


class _Step:
    """Numbers the lines of a STEP file."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.edges: dict[tuple[int, int], str] = {}

    def add(self, line: str) -> str:
        self.lines.append(line)
        return f"#{len(self.lines)}"

    def numbers(self, keyword: str, vector: np.ndarray) -> str:
        return self.add(f"{keyword}('',({','.join(f'{number:.9f}' for number in vector)}))")

    def direction(self, vector: np.ndarray) -> str:
        return self.numbers("DIRECTION", vector / np.linalg.norm(vector))

    def text(self) -> str:
        add = self.add
        context = add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')")
        add(f"APPLICATION_PROTOCOL_DEFINITION('','automotive_design',2000,{context})")
        product_context = add(f"PRODUCT_CONTEXT('',{context},'mechanical')")
        product = add(f"PRODUCT('Tetra','Tetra','',({product_context}))")
        formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        definition_context = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{context},'design')")
        definition = add(f"PRODUCT_DEFINITION('design','',{formation},{definition_context})")
        shape = add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        solid_angle = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        error = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-05),{length},'','')")
        units = add(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({error}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))REPRESENTATION_CONTEXT('',''))"
        )
        self.points = [self.numbers("CARTESIAN_POINT", vertex) for vertex in VERTICES]
        self.corners = [add(f"VERTEX_POINT('',{point})") for point in self.points]
        shell = add(f"CLOSED_SHELL('',({','.join(self.face(face) for face in FACES.tolist())}))")
        solid = add(f"MANIFOLD_SOLID_BREP('solid',{shell})")
        place = add(f"AXIS2_PLACEMENT_3D('',{self.points[0]},$,$)")
        drawn = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',({place},{solid}),{units})")
        add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{drawn})")
        self.paint(solid, units)
        body = "\n".join(f"#{number}={line};" for number, line in enumerate(self.lines, 1))
        return (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
            "FILE_NAME('','2026-01-01T00:00:00',(''),(''),'','','');\n"
            f"FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{body}\nENDSEC;\nEND-ISO-10303-21;\n"
        )

    def edge(self, start: int, end: int) -> str:
        """Return the edge between two vertices, which its two faces use in opposite directions."""
        if (end, start) in self.edges:
            return self.add(f"ORIENTED_EDGE('',*,*,{self.edges[end, start]},.F.)")
        along = self.add(f"VECTOR('',{self.direction(VERTICES[end] - VERTICES[start])},1.)")
        line = self.add(f"LINE('',{self.points[start]},{along})")
        curve = f"EDGE_CURVE('',{self.corners[start]},{self.corners[end]},{line},.T.)"
        self.edges[start, end] = self.add(curve)
        return self.add(f"ORIENTED_EDGE('',*,*,{self.edges[start, end]},.T.)")

    def face(self, face: list[int]) -> str:
        edges = [self.edge(start, end) for start, end in zip(face, [*face[1:], face[0]], strict=True)]
        bound = self.add(f"FACE_OUTER_BOUND('',{self.add(f'''EDGE_LOOP('',({','.join(edges)}))''')},.T.)")
        first, second, third = VERTICES[face]
        normal = self.direction(np.cross(second - first, third - first))
        along = self.direction(second - first)
        place = self.add(f"AXIS2_PLACEMENT_3D('',{self.points[face[0]]},{normal},{along})")
        return self.add(f"ADVANCED_FACE('',({bound}),{self.add(f'''PLANE('',{place})''')},.T.)")

    def paint(self, solid: str, units: str) -> None:
        add = self.add
        color = add("COLOUR_RGB('',{:.6f},{:.6f},{:.6f})".format(*(code / 255 for code in ORANGE)))
        fill = add(f"FILL_AREA_STYLE('',({add(f'''FILL_AREA_STYLE_COLOUR('',{color})''')}))")
        side = add(f"SURFACE_SIDE_STYLE('',({add(f'SURFACE_STYLE_FILL_AREA({fill})')}))")
        style = add(f"PRESENTATION_STYLE_ASSIGNMENT(({add(f'SURFACE_STYLE_USAGE(.BOTH.,{side})')}))")
        item = add(f"STYLED_ITEM('color',({style}),{solid})")
        add(f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({item}),{units})")


FILES = {
    "obj": obj,
    "ply": ply_text,
    "stl": stl_binary,
    "stl_ascii": stl_text,
    "off": off,
    "dae": dae,
    "zae": lambda: zipped({"doc.dae": dae()}),
    "3mf": model_3mf,
    "3dxml": model_3dxml,
    "xaml": xaml,
    "step": step,
    "stp": step,
    "ctm": ctm,
    "zip": lambda: zipped({"folder/tetra.ply": ply_text(), "readme.txt": b"a tetrahedron"}),
    "tar.gz": lambda: tarred({"tetra.ply": ply_text()}, "gz"),
    "tar.bz2": lambda: tarred({"tetra.ply": ply_text()}, "bz2"),
}
"""A file of the tetrahedron for every suffix, but for the next one."""


def write(folder: Path, suffix: str) -> Path:
    """Write the file of a suffix, and return where."""
    if suffix == "bz2":
        path = folder / "tetra.ply.bz2"
        path.write_bytes(bz2.compress(ply_text()))
        return path
    path = folder / f"tetra.{suffix}"
    path.write_bytes(FILES[suffix]())
    return path


POINTS = b"0 0 0\n1 2 3\n"
UNDRAWABLE = {
    "xyz": POINTS,
    "svg": b'<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0 L 1 1"/></svg>',
    "dxf": b"0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n",
    "binvox": b"#binvox 1\ndim 1 1 1\ndata\n\x01\x01",
}
"""Files of the formats that hold no triangles."""

SUFFIXES = (*FILES, "bz2")
"""All suffixes with a file."""

COLORED = ("ply", "dae", "zae", "3dxml", "xaml", "step", "stp", "zip", "tar.gz", "tar.bz2", "bz2")
"""Suffixes of files that are orange."""
