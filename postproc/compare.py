"""How far the frames of two runs differ: tools/pvbatch postproc/compare.py OUT1 OUT2 [--tolerance 1e-6]

Frames of equal time are compared, object by object, points by vertex_id and cells by cell_id, so that runs on any numbers
of ranks can be.
For every field the largest difference is printed: as a share of the field's range in the frame of OUT1, where this is
largest, and as a number. Ends with 1 if a share is above the tolerance, where only one run has a frame, a field, a
point or a cell, and where a frame or a piece of it is not there or is cut. `rank`, who computed it, is not compared.
"""

import argparse
import os
import sys
import xml.etree.ElementTree

import run_folder


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs=2, metavar="OUT")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="share of a field's range (1e-6)")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    for folder in options.folders:
        if not run_folder.series(folder):
            parser.error(f"{folder}: no .pvd of a run in it; expected the folder of a run")
    if not options.tolerance >= 0:
        parser.error(f"--tolerance {options.tolerance}: expected a share, at least 0")
    return options


# Before ParaView is loaded, which takes seconds.
OPTIONS = arguments()

try:
    import numpy
    from paraview.vtk.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPPolyDataReader
except ImportError:
    sys.exit("compare.py: no ParaView here; expected to be run by tools/pvbatch")

POINT_KEY, CELL_KEY = "vertex_id", "cell_id"
NOT_COMPARED = {POINT_KEY, CELL_KEY, "rank", "vtkGhostType"}


def series(folder):
    """What the .pvd files of a run name. @returns {(end, object): {time: file}}; the end as in run_folder.series, the object
    (or body) "" where a run has one without a name"""
    found = {}
    for end, path in run_folder.series(folder).items():
        for entry in xml.etree.ElementTree.parse(path).iter("DataSet"):
            files = found.setdefault((end, entry.get("name") or ""), {})
            files[round(float(entry.get("timestep")), 12)] = os.path.join(folder, entry.get("file"))
    return found


def rows(data, ids, own):
    """The arrays of points or cells in the order of their ids. @returns the ids, {name: (rows x components)}"""
    order = numpy.argsort(ids[own], kind="stable")  # the triangles of a cell keep their order
    arrays = {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}
    return ids[own][order], {name: array[own].reshape(len(order), -1)[order].astype(float)
                             for name, array in arrays.items() if name not in NOT_COMPARED}


def frame(path):
    """@returns {"points": (ids, fields), "cells": (ids, fields)}"""
    reader = vtkXMLPPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    mesh = reader.GetOutput()
    points, cells = mesh.GetPointData(), mesh.GetCellData()
    if mesh.GetNumberOfPoints() == 0:
        return {"points": (numpy.zeros(0), {}), "cells": (numpy.zeros(0), {})}
    vertices = vtk_to_numpy(points.GetArray(POINT_KEY))
    if cells.HasArray(CELL_KEY):
        elements = vtk_to_numpy(cells.GetArray(CELL_KEY))
    else:  # springs, by their ends
        ends = numpy.sort(vertices[vtk_to_numpy(mesh.GetLines().GetConnectivityArray()).reshape(-1, 2)], axis=1)
        elements = ends[:, 0] * (vertices.max() + 1) + ends[:, 1]
    ghosts = points.GetArray("vtkGhostType")
    own = vtk_to_numpy(ghosts) == 0 if ghosts else numpy.ones(len(vertices), bool)
    result = {"points": rows(points, vertices, own), "cells": rows(cells, elements, numpy.ones(len(elements), bool))}
    place = vtk_to_numpy(mesh.GetPoints().GetData())[own]
    result["points"][1]["position"] = place[numpy.argsort(vertices[own], kind="stable")].astype(float)
    return result


class Comparison:
    def __init__(self):
        self.worst = {}  # of each field: share, number, time, id
        self.faults = []

    def add(self, time, label, kind, first, second):
        (ids, fields), (other_ids, other_fields) = first[kind], second[kind]
        if not numpy.array_equal(ids, other_ids):
            only = numpy.setxor1d(ids, other_ids)
            self.faults.append(f"{time:g} s{label}: {len(ids)} and {len(other_ids)} {kind}"
                               + (f", of which {len(only)} in one run only, such as {only[0]}" if len(only) else ""))
            return
        for name in fields.keys() ^ other_fields.keys():
            self.faults.append(f"{time:g} s{label}: field {name} of {kind} in one run only")
        for name in fields.keys() & other_fields.keys():
            a, b = fields[name], other_fields[name]
            if a.shape != b.shape or not a.size:
                if a.shape != b.shape:
                    self.faults.append(f"{time:g} s{label}: field {name} has {a.shape[1]} and {b.shape[1]} components")
                continue
            difference = numpy.abs(a - b)
            difference[numpy.isnan(a) != numpy.isnan(b)] = numpy.inf
            difference = numpy.nan_to_num(difference, nan=0, posinf=numpy.inf).max(axis=1)
            place = int(difference.argmax())
            extent = float((a.max(axis=0) - a.min(axis=0)).max())
            share = difference[place] / extent if extent > 0 else difference[place]
            best = self.worst.get(name + label)
            if best is None or share > best[0]:
                self.worst[name + label] = (share, difference[place], time, int(ids[place]))


def main():
    comparison = Comparison()
    runs = [series(folder) for folder in OPTIONS.folders]
    for which in sorted(runs[0].keys() | runs[1].keys()):
        frames = [run.get(which, {}) for run in runs]
        end, of_object = which
        label = (f" of {of_object}" if of_object else "") + (f" ({end[1:]})" if end else "")
        for time in sorted(frames[0].keys() ^ frames[1].keys()):
            comparison.faults.append(f"{time:g} s{label}: a frame in {OPTIONS.folders[time in frames[1]]} only")
        for time in sorted(frames[0].keys() & frames[1].keys()):
            cut = [fault for fault in (run_folder.fault_of_frame(each[time]) for each in frames) if fault]
            if cut:
                comparison.faults += [f"{time:g} s{label}: {fault}" for fault in cut]
                continue
            first, second = (frame(each[time]) for each in frames)
            for kind in ("points", "cells"):
                comparison.add(time, label, kind, first, second)
    if not any(times for run in runs for times in run.values()):
        comparison.faults.append("no frame in either run")
    print(f"{'field':32} {'share':>9} {'difference':>11}")
    for name, (share, number, time, place) in sorted(comparison.worst.items()):
        print(f"{name:32} {share:9.2e} {number:11.3e}  at {time:g} s, id {place}")
    for fault in comparison.faults[:20]:
        print(fault)
    if len(comparison.faults) > 20:
        print(f"... {len(comparison.faults)} such lines in all")
    same = not comparison.faults and all(share <= OPTIONS.tolerance for share, *_ in comparison.worst.values())
    print("equal" if same else "different", f"(tolerance {OPTIONS.tolerance:g})")
    sys.stdout.flush()
    os._exit(0 if same else 1)  # pvbatch would end with 0


main()
