"""What ParaView finds in a run, as JSON: tools/pvbatch postproc/check_output.py FILE.pvd

{"times": [...], "frames": [{"points": n, "cells": n, "fields": {"temperature": [[low, high], ...one a component]},
"cell_fields": {"rank": [[0, 3]]}}, ...]}
Of a run of several objects a frame is {"paper": {"points": ...}, ...}, by the names of ParaView's blocks.
Points that are marked as duplicates (corners of other ranks' pieces) are counted once.
"""

import argparse
import json
import os
import sys


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", metavar="FILE.pvd")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    if not options.file.endswith(".pvd") or not os.path.isfile(options.file):
        parser.error(f"{options.file}: no such file; expected the .pvd of a run")
    return options


# Before ParaView is loaded, which takes seconds.
OPTIONS = arguments()

try:
    from paraview import simple
    from paraview.vtk.util.numpy_support import vtk_to_numpy
except ImportError:
    sys.exit("check_output.py: no ParaView here; expected to be run by tools/pvbatch")


def ranges(data, own):
    """Smallest and largest value of each component of each array."""
    fields = {}
    for i in range(data.GetNumberOfArrays()):
        array = data.GetArray(i)
        values = vtk_to_numpy(array)[own].reshape(-1, array.GetNumberOfComponents())
        fields[array.GetName()] = [[float(column.min()), float(column.max())] for column in values.T] if len(values) else []
    return fields


def describe(data):
    ghosts = data.GetPointData().GetArray("vtkGhostType")
    own = vtk_to_numpy(ghosts) == 0 if ghosts else slice(None)
    count = data.GetNumberOfPoints() if not ghosts else int(own.sum())
    return {"points": count, "cells": data.GetNumberOfCells(), "fields": ranges(data.GetPointData(), own),
            "cell_fields": ranges(data.GetCellData(), slice(None))}


def frame(data):
    if not data.IsA("vtkMultiBlockDataSet"):
        return describe(data)
    objects = {}
    for i in range(data.GetNumberOfBlocks()):
        block = data.GetBlock(i)
        while block is not None and block.IsA("vtkMultiBlockDataSet"):
            block = block.GetBlock(0)
        if block is not None:
            objects[data.GetMetaData(i).Get(data.NAME())] = describe(block)
    return objects


def main():
    reader = simple.PVDReader(FileName=OPTIONS.file)
    times = list(reader.TimestepValues)
    frames = []
    for time in times:
        simple.UpdatePipeline(time=time, proxy=reader)
        frames.append(frame(simple.servermanager.Fetch(reader)))
    print(json.dumps({"times": times, "frames": frames}))


main()
