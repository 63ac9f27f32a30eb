#!/usr/bin/python3
"""Writes the frames of a run for other programs, one file a frame: postproc/export.py OUT --format obj|ply|stl|gltf

  postproc/export.py output/burning_paper --format obj               # output/burning_paper/obj/burning_paper_0000.obj ...
  postproc/export.py output/leaking_balloon --format gltf --frames 5 --to models
  postproc/export.py output/sheet_and_balloon --format ply --frames 1

OUT is the folder of a run. Files have the number of their frame. What has burnt away is not in them, and cells that are
cut are cut. A vertex on which pieces of several ranks meet is written once.

  format  file            positions normals uv colours ids  objects of a run
  obj     text            yes       yes     yes yes    no   each a group with its name
  ply     binary          yes       yes     yes yes    yes  one mesh; a vertex has the number of its object
  stl     binary          yes       no      no  no     no   one mesh
  gltf    .glb, binary    yes       yes     yes yes    no   each a node with its name
  usd     no library in Debian writes it: refused

Normals are the mean of the triangles', weighted by area. Colours are char to paper by mass_ratio and pale to red rubber by
thickness_ratio, from the least that any of the written frames has to 1. uv are 0 where the frames have none. Ids are
vertex_id, negative where a cell is cut. Lengths are metres; z is up, in gltf by the rotation of a root node, since its
files have y up.
"""

import argparse
import json
import os
import struct
import sys

import run_folder

FORMATS = ("obj", "ply", "stl", "gltf", "usd")


def at_least_one(text):
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text}; expected a number, at least 1")
    return int(text)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="OUT")
    parser.add_argument("--format", choices=FORMATS, required=True)
    parser.add_argument("--frames", type=at_least_one, metavar="N",
                        help="how many, spread evenly from the first to the last (all)")
    parser.add_argument("--to", metavar="FOLDER", help="where the files go (OUT/FORMAT)")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    if options.format == "usd":
        parser.error("--format usd: no library in Debian 12 writes it; expected obj, ply, stl or gltf")
    options.pvd = run_folder.series(options.folder).get("")
    if options.pvd is None:
        parser.error(f"{options.folder}: no .pvd of a run in it; expected the folder of a run")
    options.to = options.to or os.path.join(options.folder, options.format)
    try:
        os.makedirs(options.to, exist_ok=True)
    except OSError as error:
        parser.error(f"--to {options.to}: {error.strerror}; expected a folder")
    return options


OPTIONS = arguments()

# After the arguments, since they take a while.
import numpy  # noqa: E402
import vtk  # noqa: E402
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray  # noqa: E402

import materials  # noqa: E402
import run_frames  # noqa: E402


class Mesh(run_frames.Mesh):
    """What is left of an object in a frame, and its name."""

    def __init__(self, name, path):
        super().__init__(path)
        self.name = name
        uv = self.of_vertices("TCoords")
        self.uv = self.places[:, :2] * 0 if uv is None else uv
        self.ratios = {"mass_ratio": self.of_vertices("mass_ratio"), "thickness_ratio": self.means("thickness_ratio")}

    def colours(self, least):
        return materials.colours(len(self.ids), *self.ratios.values(), least)


def write_obj(meshes, least, path):
    with open(path, "w", encoding="utf-8") as file:
        start = 1
        for mesh in meshes:
            file.write(f"o {mesh.name}\n")
            numpy.savetxt(file, numpy.hstack([mesh.places, mesh.colours(least)]), "v" + " %.9g" * 3 + " %.4f" * 3)
            numpy.savetxt(file, mesh.uv, "vt %.7g %.7g")
            numpy.savetxt(file, mesh.normals(), "vn %.5f %.5f %.5f")
            numpy.savetxt(file, numpy.repeat(mesh.triangles + start, 3, axis=1), "f" + " %d/%d/%d" * 3)
            start += len(mesh.ids)


def write_ply(meshes, least, path):
    vertex = numpy.dtype([*((name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz", "s", "t")),
                          *((name, "u1") for name in ("red", "green", "blue")), ("vertex_id", "<f8"), ("object", "<i4")])
    rows, faces, start = [], [], 0
    for number, mesh in enumerate(meshes):
        row = numpy.zeros(len(mesh.ids), vertex)
        columns = [*mesh.places.T, *mesh.normals().T, *mesh.uv.T, *numpy.rint(255 * mesh.colours(least)).T, mesh.ids, number]
        for name, values in zip(vertex.names, columns):
            row[name] = values
        rows.append(row)
        face = numpy.zeros(len(mesh.triangles), numpy.dtype([("count", "u1"), ("corners", "<i4", 3)]))
        face["count"], face["corners"] = 3, mesh.triangles + start
        faces.append(face)
        start += len(row)
    types = {"<f4": "float", "<f8": "double", "<i4": "int", "|u1": "uchar"}
    header = ["ply", "format binary_little_endian 1.0",
              *(f"comment object {i}: {mesh.name}" for i, mesh in enumerate(meshes)),
              f"element vertex {start}", *(f"property {types[vertex[name].str]} {name}" for name in vertex.names),
              f"element face {sum(map(len, faces))}", "property list uchar int vertex_indices", "end_header", ""]
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        for block in rows + faces:
            file.write(block.tobytes())


def write_stl(meshes, _, path):
    append = vtk.vtkAppendPolyData()
    for mesh in meshes:
        data = vtk.vtkPolyData()
        points, cells = vtk.vtkPoints(), vtk.vtkCellArray()
        points.SetData(numpy_to_vtk(mesh.places, deep=True))
        cells.SetData(3, numpy_to_vtkIdTypeArray(mesh.triangles.ravel(), deep=True))
        data.SetPoints(points)
        data.SetPolys(cells)
        append.AddInputData(data)
    writer = vtk.vtkSTLWriter()
    writer.SetInputConnection(append.GetOutputPort())
    writer.SetFileName(path)
    writer.SetFileTypeToBinary()
    vtk.vtkObject.GlobalWarningDisplayOff()  # It would print its fault, too.
    writer.Write()
    if writer.GetErrorCode() != 0:
        raise OSError(0, vtk.vtkErrorCode.GetStringFromErrorCode(writer.GetErrorCode()))


def linear(srgb):
    return numpy.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def write_gltf(meshes, least, path):
    """A .glb: a chunk of JSON that says what is where in a chunk of numbers."""
    numbers, views, accessors, nodes, of_meshes = b"", [], [], [], []

    def accessor(values, kind, target):
        nonlocal numbers
        views.append({"buffer": 0, "byteOffset": len(numbers), "byteLength": values.nbytes, "target": target})
        numbers += values.tobytes()
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126 if values.dtype == "<f4" else 5125,
                          "count": len(values), "type": kind})
        return len(accessors) - 1

    def of_vertices(values, kind):
        return accessor(numpy.ascontiguousarray(values, "<f4"), kind, 34962)

    for mesh in meshes:
        if not len(mesh.triangles):  # An accessor cannot be empty.
            continue
        attributes = {"POSITION": of_vertices(mesh.places, "VEC3"), "NORMAL": of_vertices(mesh.normals(), "VEC3"),
                      "COLOR_0": of_vertices(linear(mesh.colours(least)), "VEC3"),
                      # whose origin is the upper left corner of a picture
                      "TEXCOORD_0": of_vertices(numpy.stack([mesh.uv[:, 0], 1 - mesh.uv[:, 1]], axis=1), "VEC2")}
        places = mesh.places.astype("<f4")
        accessors[attributes["POSITION"]].update(min=places.min(axis=0).tolist(), max=places.max(axis=0).tolist())
        indices = accessor(numpy.ascontiguousarray(mesh.triangles.ravel(), "<u4"), "SCALAR", 34963)
        of_meshes.append({"name": mesh.name, "primitives": [{"attributes": attributes, "indices": indices, "material": 0}]})
        nodes.append({"name": mesh.name, "mesh": len(of_meshes) - 1})
    scene = {"asset": {"version": "2.0", "generator": "pellicle"}, "scene": 0, "scenes": [{"nodes": [len(nodes)]}]}
    scene["nodes"] = nodes + [{"name": "z_up", "rotation": [-0.5 ** 0.5, 0, 0, 0.5 ** 0.5]}]
    if nodes:
        scene["nodes"][-1]["children"] = list(range(len(nodes)))
        scene["materials"] = [{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.9}}]
        scene.update(meshes=of_meshes, accessors=accessors, bufferViews=views, buffers=[{"byteLength": len(numbers)}])
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if numbers:
        chunks += struct.pack("<I4s", len(numbers), b"BIN\0") + numbers
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


WRITERS = {"obj": (write_obj, "obj"), "ply": (write_ply, "ply"), "stl": (write_stl, "stl"), "gltf": (write_gltf, "glb")}


def main():
    name = os.path.basename(OPTIONS.pvd)[:-len(".pvd")]
    times = run_frames.frames_by_time(OPTIONS.pvd)
    chosen = run_folder.evenly(len(times), OPTIONS.frames or len(times))

    def meshes_of(frame):
        return [Mesh(label or name, path) for label, path in times[frame][1].items()]

    least = dict.fromkeys(("mass_ratio", "thickness_ratio"), 1.0)
    for frame in chosen if OPTIONS.format != "stl" else []:
        for mesh in meshes_of(frame):
            for field, values in mesh.ratios.items():
                if values is not None and len(values):
                    least[field] = min(least[field], float(values.min()))
    write, end = WRITERS[OPTIONS.format]
    for frame in chosen:
        path = os.path.join(OPTIONS.to, f"{name}_{frame:04d}.{end}")
        part = path + ".part"  # so that no file of its own name is ever cut
        try:
            write(meshes_of(frame), least, part)
            os.replace(part, path)
        except OSError as error:
            if os.path.exists(part):
                os.remove(part)
            sys.exit(f"export.py: {path}: {error.strerror}; expected a folder with space for it")
        print(path)


main()
