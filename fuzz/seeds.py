#!/usr/bin/env python3
"""Writes seeds for the fuzz targets into corpus/TARGET: small files of each format and variant."""

import base64
import gzip
import struct
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
BETWEEN = b"\n%%%%\n"  # between the files of a format of several files, see src/lib.rs
POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]
TETS = [(0, 1, 2, 3), (1, 2, 3, 4)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)]

# The same mesh of second order: nodes on edges follow the points, one of them off the middle of its edge.
EDGES = sorted({tuple(sorted((tet[i], tet[j]))) for tet in TETS for i in range(4) for j in range(i)})
POINTS2 = POINTS + [tuple((x + y) / 2 + (0.01 if k == 0 else 0) for x, y in zip(POINTS[a], POINTS[b]))
                    for k, (a, b) in enumerate(EDGES)]


def curved(elements, *ends):
    """Elements with the nodes on their edges, whose ends are given in the order of a format."""
    return [(*element, *(len(POINTS) + EDGES.index(tuple(sorted((element[i], element[j])))) for i, j in ends))
            for element in elements]


# In the order of VTK, which most formats have.
TETS2 = curved(TETS, (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
FACES2 = curved(FACES, (0, 1), (1, 2), (2, 0))


def save(target, name, *files):
    folder = HERE / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    parts = [part.encode() if isinstance(part, str) else part for part in files]
    (folder / name).write_bytes(BETWEEN.join(parts))


def rows(items, base=0, begin="", end=""):
    return "".join(f"{begin}{' '.join(str(n + base) for n in item)}{end}\n" for item in items)


def numbered(items, base=0, end=""):
    return "".join(f"{k} {' '.join(str(n + base) for n in item)}{end}\n" for k, item in enumerate(items))


def ints(*numbers, order="<", kind="i"):
    return b"".join(struct.pack(order + kind, n) for n in numbers)


def stl():
    text = "solid a b\n"
    for face in FACES:
        corners = "".join(f"vertex {x} {y} {z}\n" for x, y, z in (POINTS[v] for v in face))
        text += f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n"
    save("stl", "text", text + "endsolid\nsolid\nendsolid\n")
    save("stl", "gap", text.replace("vertex 1 0 0", "vertex 1.0000001 0 0", 1) + "endsolid\n")
    binary = bytes(80) + ints(len(FACES), kind="I")
    for face in FACES:
        binary += bytes(12) + b"".join(struct.pack("<3f", *POINTS[v]) for v in face) + bytes(2)
    save("stl", "binary", binary)


def polygons():
    save("obj", "faces", rows(POINTS, begin="v ") + "vn 0 0 1\no part\ng wall\nusemtl steel\n" + rows(FACES, 1, "f ")
         + "l 1 2\n")
    save("obj", "polygon", "v 0 0 0\nv 2 0 0\nv 0.5 0.5 0\nv 0 2 0\ng a\nf 1/1 -3//2 \\\n 3 4\n")
    save("off", "faces", "OFF # a\n5 6 0\n" + rows(POINTS) + rows(FACES, begin="3 ", end=" 1 0 0"))
    save("off", "polygon", "STCNOFF\n4 1 0\n0 0 0 1\n2 0 0 1\n0.5 0.5 0 1\n0 2 0 1\n4 0 1 2 3\n")
    window = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (1, 1, 0), (3, 1, 0), (3, 3, 0), (1, 3, 0)]
    poly = "2 1\n2 1 7\n4 0 1 2 3\n4 4 5 6 7\n1 2 2 0\n1 0 3\n2 1 5\n1\n1 2 2 2\n1\n1 1 1 1 5 0.1\n"
    save("poly", "window", "8 3 0 0\n" + numbered(window) + poly)
    save("poly", "beside", "0 3 0 0\n" + poly, "8 3 0 0\n" + numbered(window))
    smesh = "6 1\n" + rows(FACES, begin="3 ", end=" 4") + "0\n0\n"
    save("smesh", "faces", "5 3 1 1\n" + numbered(POINTS, end=" 7 1") + smesh)
    save("smesh", "beside", "0 3 0 0\n" + smesh, "5 3 0 0\n" + numbered(POINTS))


def ply():
    strip = [0, 1, 2, 3, -1, 1, 2, 4]
    for name, order in [("ascii", ""), ("binary_little_endian", "<"), ("binary_big_endian", ">")]:
        head = (f"ply\nformat {name} 1.0\ncomment a\nelement vertex 5\nproperty float x\nproperty double y\n"
                "property float z\nproperty uchar red\n")
        faces = "element face 6\nproperty list uchar int vertex_indices\nproperty list short float more\n"
        strips = "element tristrips 1\nproperty list int int vertex_indices\n"
        if order:
            points = b"".join(struct.pack(order + "fdfB", *p, 7) for p in POINTS)
            body = b"".join(struct.pack(order + "B3ih", 3, *face, 0) for face in FACES)
            last = struct.pack(f"{order}i{len(strip)}i", len(strip), *strip)
        else:
            points = rows(POINTS, end=" 7").encode()
            body = rows(FACES, begin="3 ", end=" 1 nan").encode()
            last = f"{len(strip)} {' '.join(map(str, strip))}\n".encode()
        save("ply", name, (head + faces + "end_header\n").encode() + points + body)
        save("ply", "strips_" + name, (head + strips + "end_header\n").encode() + points + last)


def gmsh():
    names = '$PhysicalNames\n2\n2 5 "skin"\n3 7 "body a"\n$EndPhysicalNames\n'
    elements = [(k + 1, 2, 2, 5, 1, *(v + 1 for v in face)) for k, face in enumerate(FACES)]
    elements += [(k + 7, 4, 2, 7, 1, *(v + 1 for v in tet)) for k, tet in enumerate(TETS)]
    points = "".join(f"{k + 1} {x} {y} {z}\n" for k, (x, y, z) in enumerate(POINTS))
    periodic = "$Periodic\n1\n2 1 1\nAffine 1 0 0\n2\n1 2\n3 4\n$EndPeriodic\n"
    save("msh", "22", f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{names}$Nodes\n5\n{points}$EndNodes\n"
         f"$Comments\na\n$EndComments\n$Elements\n9\n9 1 2 0 1 1 2\n{rows(elements)}$EndElements\n{periodic}")
    for order in "<>":
        binary = b"$MeshFormat\n2.2 1 8\n" + ints(1, order=order) + b"\n$EndMeshFormat\n$Nodes\n5\n"
        binary += b"".join(struct.pack(order + "i3d", k + 1, *p) for k, p in enumerate(POINTS))
        binary += b"\n$EndNodes\n$Elements\n8\n"
        binary += ints(2, 6, 2, order=order) + b"".join(ints(*e[:1], *e[3:], order=order) for e in elements[:6])
        binary += ints(4, 2, 2, order=order) + b"".join(ints(*e[:1], *e[3:], order=order) for e in elements[6:])
        save("msh", "22_binary" + str(ord(order)), binary + b"\n$EndElements\n")
    text = (f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{names}$Entities\n1 0 1 1\n1 0 0 0 0\n3 0 0 0 1 1 1 1 5 0\n"
            "4 0 0 0 1 1 1 1 7 1 -3\n$EndEntities\n$Nodes\n2 5 1 5\n2 3 1 2\n1\n2\n0 0 0 0.5 0.5\n1 0 0 0.5 0.5\n"
            "3 4 0 3\n3\n4\n5\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n$Elements\n2 8 1 8\n2 3 2 6\n"
            + numbered(FACES, 1) + "3 4 4 2\n" + numbered(TETS, 1) + "$EndElements\n")
    save("msh", "41", text + "$Periodic\n1\n2 3 3\n0\n2\n1 2\n3 4\n$EndPeriodic\n")
    partitioned = ("$PartitionedEntities\n2 0\n0 0 1 1\n9 3 4 2 1 2 0 0 0 1 1 1 0 0\n"
                   "5 3 4 1 1 0 0 0 1 1 1 1 7 0\n$EndPartitionedEntities\n")
    save("msh", "41_parts", text.replace("$Nodes", partitioned + "$Nodes"))
    # One of two parts: a tet of its own and a ghost.
    ghosts = ("$PartitionedEntities\n2\n1\n6 1\n0 0 1 1\n9 2 3 1 1 0 0 0 1 1 1 1 5 0\n"
              "5 3 4 1 1 0 0 0 1 1 1 1 7 0\n$EndPartitionedEntities\n")
    of_part = text.replace("$Nodes", ghosts + "$Nodes").replace("2 8 1 8\n2 3 2 6\n", "3 8 1 8\n2 9 2 6\n")
    of_part = of_part.replace("3 4 4 2\n" + numbered(TETS, 1), "3 5 4 1\n0 1 2 3 4\n3 6 4 1\n1 2 3 4 5\n")
    save("msh", "41_ghosts", of_part + "$GhostElements\n1\n1 2 1 1\n$EndGhostElements\n")
    sizes = lambda *numbers: ints(*numbers, kind="Q")
    binary = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Entities\n" + sizes(0, 0, 1, 1)
    for tag, physical, bounds in [(3, 5, ()), (4, 7, (-3,))]:
        binary += ints(tag) + struct.pack("<6d", *[0.5] * 6) + sizes(1) + ints(physical) + sizes(len(bounds)) + ints(*bounds)
    binary += b"\n$EndEntities\n$Nodes\n" + sizes(1, 5, 1, 5) + ints(3, 4, 0) + sizes(5, 1, 2, 3, 4, 5)
    binary += b"".join(struct.pack("<3d", *p) for p in POINTS) + b"\n$EndNodes\n$Elements\n" + sizes(2, 8, 1, 8)
    for head, items in [((2, 3, 2), FACES), ((3, 4, 4), TETS)]:
        binary += ints(*head) + sizes(len(items)) + b"".join(sizes(1, *(v + 1 for v in item)) for item in items)
    save("msh", "41_binary", binary + b"\n$EndElements\n")
    section = b"$PartitionedEntities\n" + sizes(2, 1) + ints(6, 1) + sizes(0, 0, 1, 1)
    for tag, dimension, parent, physical in [(9, 2, 3, 5), (5, 3, 4, 7)]:
        section += ints(tag, dimension, parent) + sizes(1) + ints(1) + struct.pack("<6d", *[0.5] * 6)
        section += sizes(1) + ints(physical) + sizes(0)
    binary = binary.replace(b"$Nodes\n", section + b"\n$EndPartitionedEntities\n$Nodes\n")
    head = b"$Elements\n"
    binary = binary[: binary.index(head) + len(head)] + sizes(3, 8, 1, 8)
    for block, items in [((2, 9, 2), FACES), ((3, 5, 4), TETS[:1]), ((3, 6, 4), TETS[1:])]:
        binary += ints(*block) + sizes(len(items)) + b"".join(sizes(1, *(v + 1 for v in item)) for item in items)
    binary += b"\n$EndElements\n$GhostElements\n" + sizes(1, 1) + ints(2) + sizes(1) + ints(1)
    save("msh", "41_binary_ghosts", binary + b"\n$EndGhostElements\n")


def gmsh_second_order():
    swapped = [(*tet[:8], tet[9], tet[8]) for tet in TETS2]
    count = len(POINTS2)
    elements = [(k + 1, 9, 2, 5, 1, *(v + 1 for v in face)) for k, face in enumerate(FACES2)]
    elements += [(k + 7, 11, 2, 7, 1, *(v + 1 for v in tet)) for k, tet in enumerate(swapped)]
    points = "".join(f"{k + 1} {x} {y} {z}\n" for k, (x, y, z) in enumerate(POINTS2))
    save("msh", "22_second", f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{count}\n{points}$EndNodes\n"
         f"$Elements\n8\n{rows(elements)}$EndElements\n")
    for order in "<>":
        binary = b"$MeshFormat\n2.2 1 8\n" + ints(1, order=order) + b"\n$EndMeshFormat\n$Nodes\n%d\n" % count
        binary += b"".join(struct.pack(order + "i3d", k + 1, *p) for k, p in enumerate(POINTS2))
        binary += b"\n$EndNodes\n$Elements\n8\n"
        binary += ints(9, 6, 2, order=order) + b"".join(ints(*e[:1], *e[3:], order=order) for e in elements[:6])
        binary += ints(11, 2, 2, order=order) + b"".join(ints(*e[:1], *e[3:], order=order) for e in elements[6:])
        save("msh", "22_binary_second" + str(ord(order)), binary + b"\n$EndElements\n")
    tags = "".join(f"{k}\n" for k in range(1, count + 1))
    save("msh", "41_second", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 1\n3 0 0 0 1 1 1 1 5 0\n"
         f"4 0 0 0 1 1 1 1 7 1 -3\n$EndEntities\n$Nodes\n1 {count} 1 {count}\n3 4 0 {count}\n{tags}{rows(POINTS2)}$EndNodes\n"
         "$Elements\n2 8 1 8\n2 3 9 6\n" + "".join(f"{k + 1} {rows([face], 1)}" for k, face in enumerate(FACES2))
         + "3 4 11 2\n" + "".join(f"{k + 7} {rows([tet], 1)}" for k, tet in enumerate(swapped)) + "$EndElements\n")
    sizes = lambda *numbers: ints(*numbers, kind="Q")
    binary = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Entities\n" + sizes(0, 0, 1, 1)
    for tag, physical, bounds in [(3, 5, ()), (4, 7, (-3,))]:
        binary += ints(tag) + struct.pack("<6d", *[0.5] * 6) + sizes(1) + ints(physical) + sizes(len(bounds)) + ints(*bounds)
    binary += b"\n$EndEntities\n$Nodes\n" + sizes(1, count, 1, count) + ints(3, 4, 0) + sizes(count, *range(1, count + 1))
    binary += b"".join(struct.pack("<3d", *p) for p in POINTS2) + b"\n$EndNodes\n$Elements\n" + sizes(2, 8, 1, 8)
    for head, items in [((2, 3, 9), FACES2), ((3, 4, 11), swapped)]:
        binary += ints(*head) + sizes(len(items)) + b"".join(sizes(1, *(v + 1 for v in item)) for item in items)
    save("msh", "41_binary_second", binary + b"\n$EndElements\n")


def medit():
    save("mesh", "second", f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(POINTS2)}\n" + rows(POINTS2, end=" 0")
         + "TrianglesP2\n6\n" + rows(FACES2, 1, end=" 5") + "TetrahedraP2\n2\n" + rows(TETS2, 1, end=" 7") + "End\n")
    save("mesh", "text", "MeshVersionFormatted 2\nDimension\n3\nVertices\n5\n" + rows(POINTS, end=" 1")
         + "Corners\n1\n1\nEdges\n1\n1 2 3\nTriangles\n6\n" + rows(FACES, 1, end=" 5") + "Tetrahedra\n2\n"
         + rows(TETS, 1, end=" 7") + "End\n")
    for version in range(1, 5):
        for order in "<>":
            name = f"{version}{ord(order)}"
            save("meshb", name, meshb(version, order, POINTS, [(20, b"abc")], [(6, FACES, 5), (8, TETS, 7)]))
            save("meshb", name + "_second", meshb(version, order, POINTS2, [], [(24, FACES2, 5), (30, TETS2, 7)]))


def meshb(version, order, points, others, elements):
    """Medit's binary file with blocks of vertices, of others, and of elements by code, with their number."""
    place, size = ("Q" if version >= 3 else "I"), ("q" if version == 4 else "i")
    real = "f" if version == 1 else "d"
    binary = ints(1, version, order=order)
    blocks = [(3, ints(3, order=order)), (4, ints(len(points), order=order, kind=size) + b"".join(
        struct.pack(order + 3 * real + size, *p, 0) for p in points)), *others]
    for code, items, number in elements:
        blocks.append((code, ints(len(items), *(n for item in items for n in (*(v + 1 for v in item), number)),
                                  order=order, kind=size)))
    for code, data in blocks:
        after = len(binary) + 4 + struct.calcsize("=" + place) + len(data)
        binary += ints(code, order=order) + ints(after, order=order, kind=place) + data
    return binary + ints(54, order=order) + ints(0, order=order, kind=place)


def netgen():
    text = ("# a\nmesh3d\ndimension\n3\ngeomtype\n0\nsurfaceelementsgi\n6\n"
         + rows(FACES, 1, "1 5 7 0 3 ", " 0 0 0") + "volumeelements\n2\n" + rows(TETS, 1, "7 4 ")
         + "edgesegmentsgi2\n1\n1 0 1 2 -1 -1 1 2 3 0 3 1.5\nedgesegmentsgi3\n1\n1 2 0 0 0 0 3 1 1\npoints\n5\n"
         + rows(POINTS) + "materials\n1\n7 points\nbcnames\n1\n5 skin of it\nidentifications\n2\n1 2 1\n3 4 1\n"
         "identificationtypes\n1\n2\nendmesh\n")
    save("vol", "text", text)
    # NETGEN's order: of tets 01 02 03 12 13 23 with two corners swapped, of triangles 12 20 01.
    tets = curved([(b, a, c, d) for a, b, c, d in TETS], (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
    second = ("mesh3d\ndimension\n3\ngeomtype\n0\nsurfaceelements\n6\n"
              + rows(curved(FACES, (1, 2), (2, 0), (0, 1)), 1, "1 5 7 0 6 ") + "volumeelements\n2\n" + rows(tets, 1, "7 10 ")
              + f"points\n{len(POINTS2)}\n" + rows(POINTS2) + "endmesh\n")
    save("vol", "second", second)
    save("vol_gz", "second", b"\0" + gzip.compress(second.encode(), mtime=0))
    save("vol_gz", "file", b"\0" + gzip.compress(text.encode(), mtime=0))
    save("vol_gz", "damaged", b"\1\0\x40\1" + text.encode())
    save("vol_gz", "cut", b"\1\0\x40\0" + text.encode())
    save("vol_gz", "text", b"\2" + text.encode())


def vtu(stored, tets=TETS, ids=False, faces=FACES, points=POINTS):
    cells = [*faces, *tets]
    corners = [v for cell in cells for v in cell]
    ends = [sum(map(len, cells[:k + 1])) for k in range(len(cells))]
    numbers = [5] * len(faces) + [7] * len(tets)
    kinds = {3: 5, 4: 10, 6: 22, 10: 24}
    arrays = [("FieldData", "Body a &amp; b", "Int32", "i", [7]),
              ("Points", "", "Float64", "d", [x for p in points for x in p]),
              ("Cells", "connectivity", "Int32", "i", corners), ("Cells", "offsets", "Int64", "q", ends),
              ("Cells", "types", "UInt8", "B", [kinds[len(cell)] for cell in cells]),
              ("CellData", "BodyId", "Int32", "i", numbers)]
    if ids:
        arrays += [("PointData", "GlobalNodeId", "Int64", "q", range(len(points))),
                   ("CellData", "GlobalElementId", "Int64", "q", [-1] * len(faces) + [0] * len(tets)),
                   ("CellData", "vtkGhostType", "UInt8", "B", [0] * len(cells))]
    zipped = ' compressor="vtkZLibDataCompressor"' if stored == "zlib" else ""
    text, body, appended, piece = "", "", b"", False
    for section, name, kind, code, values in arrays:
        data = struct.pack(f"<{len(values)}{code}", *values)
        data = (ints(1, len(data), 0, len(zlib.compress(data)), kind="I"), zlib.compress(data)) if zipped else (
            ints(len(data), kind="I"), data)
        tag = f'<DataArray type="{kind}" Name="{name}" NumberOfTuples="{len(values)}" '
        if name == "":
            tag = f'<DataArray type="{kind}" NumberOfComponents="3" '
        if stored == "text":
            array = f'{tag}format="ascii">{" ".join(map(str, values))}</DataArray>'
        elif stored in ("raw", "base64"):
            array = f'{tag}format="appended" offset="{len(appended)}"/>'
            appended += data[0] + data[1] if stored == "raw" else base64.b64encode(data[0] + data[1])
        else:
            array = f'{tag}format="binary">{"".join(base64.b64encode(part).decode() for part in data)}</DataArray>'
        if section != "FieldData" and not piece:
            body += f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n'
            piece = True
        body += f"<{section}>{array}</{section}>\n"
    text = (f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"{zipped}>\n'
            f"<UnstructuredGrid>\n{body}</Piece>\n</UnstructuredGrid>\n")
    end = b"</VTKFile>\n"
    if appended:
        encoding = "raw" if stored == "raw" else "base64"
        return text.encode() + f'<AppendedData encoding="{encoding}">\n_'.encode() + appended + b"\n</AppendedData>\n" + end
    return text.encode() + end


def vtk():
    for stored in ["text", "inline", "zlib", "raw", "base64"]:
        save("vtu", stored, vtu(stored))
        index = ('<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid GhostLevel="0"><PPoints><PDataArray type="Float64"/>'
                 '</PPoints><Piece Source="1.vtu"/><Piece Source="2.vtu"/></PUnstructuredGrid></VTKFile>')
        save("pvtu", stored, index, vtu(stored, TETS[:1]), vtu(stored, TETS[1:]))
        save("pvtu", stored + "_ids", index, vtu(stored, TETS[:1], True), vtu(stored, TETS[1:], True))
    for stored in ["text", "raw"]:
        second = lambda tets, ids: vtu(stored, tets, ids, FACES2, POINTS2)
        save("vtu", stored + "_second", second(TETS2, True))
        save("pvtu", stored + "_second", index, second(TETS2[:1], False), second(TETS2[1:], False))
    grid = vtu("text", ids=True)
    save("vtu", "beside", grid, grid)


def tetgen():
    node = "5 3 0 0\n" + numbered(POINTS)
    ele = "2 4 1\n" + numbered(TETS, end=" 7")
    save("tetgen", "faces", node, ele, "6 1\n" + numbered(FACES, end=" 5"))
    save("tetgen", "alone", node, ele)
    second = "".join(f"{k} {' '.join(map(str, tet))} 0 1 2 3 4 0 7\n" for k, tet in enumerate(TETS))
    save("tetgen", "second", node, "2 10 1\n" + second, "1 1\n0 0 2 1 0 1 2 5\n")
    tets = curved(TETS, (2, 3), (0, 2), (0, 1), (1, 3), (1, 2), (0, 3))
    save("tetgen", "curved", f"{len(POINTS2)} 3 0 0\n" + numbered(POINTS2), "2 10 1\n" + numbered(tets, end=" 7"),
         "6 1\n" + numbered(curved(FACES, (1, 2), (2, 0), (0, 1)), end=" 5"))


def elmer():
    nodes = "".join(f"{k + 1} -1 {x} {y} {z}\n" for k, (x, y, z) in enumerate(POINTS))
    elements = "".join(f"{k + 1} 7 504 {' '.join(str(v + 1) for v in tet)}\n" for k, tet in enumerate(TETS))
    parents = [(1, 0), (1, 0), (1, 0), (2, 0), (2, 0), (2, 0)]
    boundary = "".join(f"{k + 1} 5 {a} {b} 303 {' '.join(str(v + 1) for v in face)}\n"
                       for k, (face, (a, b)) in enumerate(zip(FACES, parents)))
    names = "! ----- names for bodies -----\n$ body = 7\n! ----- names for boundaries -----\n$ skin = 5\n"
    header = "5 2 6\n2\n504 2\n303 6\n"
    nodes2 = "".join(f"{k + 1} -1 {x} {y} {z}\n" for k, (x, y, z) in enumerate(POINTS2))
    elements2 = "".join(f"{k + 1} 7 510 {' '.join(str(v + 1) for v in tet)}\n" for k, tet in enumerate(TETS2))
    boundary2 = "".join(f"{k + 1} 5 {a} {b} 306 {' '.join(str(v + 1) for v in face)}\n"
                        for k, (face, (a, b)) in enumerate(zip(FACES2, parents)))
    header2 = f"{len(POINTS2)} 2 6\n2\n510 2\n306 6\n"
    save("elmer", "serial_second", "0" + header2, nodes2, elements2, boundary2, names)
    save("elmer", "part_second", "1" + header2 + "3 0\n", nodes2, elements2, boundary2, "1 2 1 2\n2 2 2 1\n6 2 1 2\n")
    save("elmer", "halo_second", "1" + header2 + "3 0\n", nodes2, elements2.replace("2 7", "2/2 7"), boundary2,
         "1 2 1 2\n2 2 1 2\n6 2 1 2\n")
    save("elmer", "serial", "0" + header, nodes, elements, boundary, names, "# a\n1 2 1\n")
    save("elmer", "part", "1" + header + "2 0\n", nodes, elements, boundary, "1 2 1 2\n2 2 2 1\n")
    save("elmer", "halo", "1" + header + "2 0\n", nodes, elements.replace("2 7", "2/2 7"), boundary, "1 2 1 2\n2 2 1 2\n")


def size():
    save("size", "points", "2 # a\n0 0 0 0.1\n1 0 0 5e-2\n1\n0 0 0 1 1 1 0.2\n")


for write in [stl, polygons, ply, gmsh, gmsh_second_order, medit, netgen, vtk, tetgen, elmer, size]:
    write()
