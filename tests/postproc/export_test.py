"""That exported files, read by others, are the frames of their run: export_test.py SOURCE_FOLDER MPIEXEC PROGRAM"""

import json
import pathlib
import shutil
import struct
import sys
import tempfile

import numpy
import vtk
from tiny_run import Faults, run, tiny_run
from vtk.util.numpy_support import vtk_to_numpy

OBJECTS = ("paper", "balloon")


def frame_of(folder, number):
    """The triangles of each object of a frame, the places (n, 3, 3), ids (n, 3), uv, mass_ratio of their corners."""
    frame = {}
    for name in OBJECTS:
        reader = vtk.vtkXMLPPolyDataReader()
        reader.SetFileName(str(folder / f"tiny_{name}_{number:06d}.pvtp"))
        reader.Update()
        data = reader.GetOutput()
        corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        fields = {"place": vtk_to_numpy(data.GetPoints().GetData())[corners]}
        for field in ("vertex_id", "TCoords", "mass_ratio"):
            if data.GetPointData().HasArray(field):
                fields[field] = vtk_to_numpy(data.GetPointData().GetArray(field))[corners]
        frame[name] = fields
    return frame


def read_obj(path):
    """The fields of the vertices, and the triangles of each object."""
    rows, triangles, name = {"v": [], "vt": [], "vn": []}, {}, None
    for line in path.read_text(encoding="utf-8").splitlines():
        kind, *values = line.split()
        if kind == "o":
            name = values[0]
            triangles[name] = []
        elif kind == "f":
            corners = [[int(number) - 1 for number in value.split("/")] for value in values]
            assert all(len(set(corner)) == 1 for corner in corners)
            triangles[name].append([corner[0] for corner in corners])
        else:
            rows[kind].append([float(value) for value in values])
    v = numpy.array(rows["v"])
    fields = {"place": v[:, :3], "colour": v[:, 3:], "uv": numpy.array(rows["vt"]),
              "normal": numpy.array(rows["vn"])}
    return fields, {name: numpy.array(corners, int).reshape(-1, 3) for name, corners in triangles.items()}


def read_ply(path):
    head, body = path.read_bytes().split(b"end_header\n", 1)
    lines = [line.split() for line in head.decode().splitlines()]
    counts = {line[1]: int(line[2]) for line in lines if line[0] == "element"}
    types = {"float": "<f4", "double": "<f8", "int": "<i4", "uchar": "u1"}
    vertex = numpy.dtype([(line[2], types[line[1]]) for line in lines if line[0] == "property" and line[1] != "list"])
    points = numpy.frombuffer(body, vertex, counts["vertex"])
    faces = numpy.frombuffer(body, numpy.dtype([("n", "u1"), ("corners", "<i4", 3)]), counts["face"], points.nbytes)
    assert (faces["n"] == 3).all() and len(body) == points.nbytes + faces.nbytes
    fields = {"place": ["x", "y", "z"], "normal": ["nx", "ny", "nz"], "uv": ["s", "t"],
              "colour": ["red", "green", "blue"]}
    fields = {name: numpy.stack([points[column].astype(float) for column in columns], axis=1)
              for name, columns in fields.items()}
    fields["colour"] /= 255
    fields["vertex_id"] = points["vertex_id"]
    of_object = points["object"][faces["corners"][:, 0]]
    return fields, {name: faces["corners"][of_object == number] for number, name in enumerate(OBJECTS)}


def read_glb(path):
    bytes_ = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", bytes_)
    assert (magic, version, length) == (b"glTF", 2, len(bytes_))
    size, kind = struct.unpack_from("<I4s", bytes_, 12)
    assert kind == b"JSON"
    scene = json.loads(bytes_[20:20 + size])
    assert struct.unpack_from("<I4s", bytes_, 20 + size) == (len(bytes_) - 28 - size, b"BIN\0")
    numbers = bytes_[28 + size:]

    def values(accessor):
        entry = scene["accessors"][accessor]
        view = scene["bufferViews"][entry["bufferView"]]
        components = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[entry["type"]]
        kind = {5126: "<f4", 5125: "<u4"}[entry["componentType"]]
        array = numpy.frombuffer(numbers, kind, entry["count"] * components, view["byteOffset"]).reshape(-1, components)
        assert array.nbytes == view["byteLength"]
        return array, entry

    fields, triangles, start = {}, {}, 0
    assert scene["nodes"][scene["scenes"][0]["nodes"][0]]["children"] == [0, 1]
    for node in scene["nodes"][:2]:
        part = scene["meshes"][node["mesh"]]["primitives"][0]
        for name, accessor in part["attributes"].items():
            array, entry = values(accessor)
            if name == "POSITION":
                assert numpy.array_equal([array.min(axis=0), array.max(axis=0)], [entry["min"], entry["max"]])
            fields.setdefault(name, []).append(array)
        triangles[node["name"]] = values(part["indices"])[0].reshape(-1, 3).astype(int) + start
        start += len(fields["POSITION"][-1])
    fields = {name: numpy.concatenate(arrays).astype(float) for name, arrays in fields.items()}
    colour = fields["COLOR_0"]  # linear
    return {"place": fields["POSITION"], "normal": fields["NORMAL"],
            "uv": numpy.stack([fields["TEXCOORD_0"][:, 0], 1 - fields["TEXCOORD_0"][:, 1]], axis=1),
            "colour": numpy.where(colour <= 0.0031308, 12.92 * colour, 1.055 * colour ** (1 / 2.4) - 0.055)}, triangles


def check(faults, what, fields, triangles, frame):
    points = sum(len(numpy.unique(frame[name]["vertex_id"])) for name in OBJECTS)
    faults.unless(len(fields["place"]) == points, f"{what}: {len(fields['place'])} points, expected {points}")
    for name in OBJECTS:
        expected, corners = frame[name], triangles[name]
        faults.unless(len(corners) == len(expected["place"]), f"{what}: {len(corners)} triangles of {name}")
        if len(corners) != len(expected["place"]):
            continue
        def near(field, of_frame, tolerance):
            error = numpy.abs(fields[field][corners] - expected[of_frame]).max()
            faults.unless(error <= tolerance, f"{what}: {field} of {name} differs by {error}")
        near("place", "place", 1e-7)
        if "TCoords" in expected:
            near("uv", "TCoords", 1e-6)
        if "vertex_id" in fields:
            near("vertex_id", "vertex_id", 0)
        normals = fields["normal"][corners]
        a, b, c = (expected["place"][:, k] for k in range(3))
        flat = numpy.cross(b - a, c - a)
        faults.unless(numpy.allclose(numpy.linalg.norm(normals, axis=2), 1, atol=1e-4), f"{what}: lengths of normals")
        aligned = (normals * flat[:, None]).sum(axis=2) > 0
        faults.unless(aligned.mean() > 0.95, f"{what}: normals of {name} point to the other side")
    # Ash is grey, paper pale.
    mass, colour = frame["paper"]["mass_ratio"].ravel(), fields["colour"][triangles["paper"]].reshape(-1, 3)
    for place, expected in ((mass.argmin(), (0.40, 0.385, 0.37)), (mass.argmax(), (0.93, 0.89, 0.80))):
        faults.unless(numpy.abs(colour[place] - expected).max() < 0.03,
                      f"{what}: mass ratio {mass[place]} has the colour {colour[place]}")


def check_with_vtk(faults, path, points, triangles):
    reader = {".obj": vtk.vtkOBJReader, ".ply": vtk.vtkPLYReader, ".stl": vtk.vtkSTLReader,
              ".glb": vtk.vtkGLTFReader}[path.suffix]()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    if data.IsA("vtkMultiBlockDataSet"):
        append, iterator = vtk.vtkAppendPolyData(), data.NewIterator()
        while not iterator.IsDoneWithTraversal():
            append.AddInputData(iterator.GetCurrentDataObject())
            iterator.GoToNextItem()
        append.Update()
        data = append.GetOutput()
    found = data.GetNumberOfPoints(), data.GetNumberOfCells()
    faults.unless(found == (points, triangles), f"{path.name}: VTK reads {found}, expected {(points, triangles)}")
    return data


def check_with_blender(faults, path, triangles):
    command = {".obj": "import_scene.obj", ".ply": "import_mesh.ply", ".stl": "import_mesh.stl",
               ".glb": "import_scene.gltf"}
    # Debian's importer of glTF asks for numpy.bool, which its numpy has no more.
    script = ("import bpy, numpy\nnumpy.bool = bool\nbpy.ops.wm.read_factory_settings(use_empty=True)\n"
              f"bpy.ops.{command[path.suffix]}(filepath={str(path)!r})\n"
              "print('TRIANGLES', sum(len(mesh.polygons) for mesh in bpy.data.meshes))")
    told = run(["blender", "--background", "--factory-startup", "--python-expr", script])
    faults.unless(f"TRIANGLES {triangles}\n" in told.stdout, f"{path.name}: Blender: {told}")


def check_cut_frames(faults, source, out, folder):
    """That no file is made of a frame that is cut or lacks a piece, and none is cut where the disk is full."""
    piece = min((out / "tiny_paper_000004").glob("*.vtp"))
    whole = piece.read_bytes()
    for what, content in (("cut before its end", whole[:len(whole) // 2]), ("No such file", None)):
        piece.unlink()
        if content is not None:
            piece.write_bytes(content)
        told = run([sys.executable, f"{source}/postproc/export.py", out, "--format", "ply", "--to", folder])
        is_told = what in told.stderr and str(piece) in told.stderr and told.stderr.count("\n") == 1
        faults.unless(told.returncode == 1 and is_told, f"{what}: {told}")
        faults.unless(not list(folder.glob("*_0004*")), f"{what}: {list(folder.iterdir())}")
    piece.write_bytes(whole)
    for kind in ("obj", "ply", "stl", "gltf"):
        to = folder / kind
        told = run(["sh", "-c", 'ulimit -f 2; exec "$0" "$@"', sys.executable, f"{source}/postproc/export.py", out,
                    "--format", kind, "--frames", "1", "--to", to])
        faults.unless(told.returncode == 1 and told.stderr.count("\n") == 1, f"{kind} on a full disk: {told}")
        faults.unless(not list(to.iterdir()), f"{kind} on a full disk: {list(to.iterdir())}")


def main():
    source, mpiexec, program = sys.argv[1:]
    faults = Faults()
    has_blender = shutil.which("blender") is not None
    if not has_blender:
        print("no Blender here: what it reads is not tested")
    with tempfile.TemporaryDirectory() as folder:
        out, models = tiny_run(mpiexec, program, folder), pathlib.Path(folder) / "models"
        last = 4
        frame = frame_of(out, last)
        faults.unless((frame["paper"]["vertex_id"] < 0).any(), "no cell is cut in the last frame")
        faults.unless(len(frame["paper"]["place"]) < 8 * 8 * 4, "no triangle has gone in the last frame")
        points = sum(len(numpy.unique(frame[name]["vertex_id"])) for name in OBJECTS)
        triangles = sum(len(frame[name]["place"]) for name in OBJECTS)
        for kind, end, read in (("obj", "obj", read_obj), ("ply", "ply", read_ply), ("gltf", "glb", read_glb),
                                ("stl", "stl", None)):
            told = run([sys.executable, f"{source}/postproc/export.py", out, "--format", kind, "--frames", "2",
                        "--to", models])
            names = sorted(path.name for path in models.glob(f"*.{end}"))
            faults.unless(names == [f"tiny_0000.{end}", f"tiny_{last:04d}.{end}"], f"{kind}: {names}, {told}")
            path = models / f"tiny_{last:04d}.{end}"
            if read:
                fields, corners = read(path)
                check(faults, kind, fields, corners, frame)
                check_with_vtk(faults, path, points, triangles)
            else:  # VTK's reader of STL merges points of equal place.
                data = check_with_vtk(faults, path, points, triangles)
                corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
                places = vtk_to_numpy(data.GetPoints().GetData())[corners]
                error = numpy.abs(places - numpy.concatenate([frame[name]["place"] for name in OBJECTS])).max()
                faults.unless(error < 1e-7, f"stl: places differ by {error}")
            if has_blender:
                check_with_blender(faults, path, triangles)
        check_cut_frames(faults, source, out, pathlib.Path(folder) / "cut")
    faults.end()


main()
