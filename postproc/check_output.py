"""What ParaView finds in a run, as JSON: tools/pvbatch postproc/check_output.py FILE.pvd

{"times": [...], "frames": [{"points": n, "cells": n, "fields": {"temperature": [[low, high], ...one a component]}}, ...]}
Points that are marked as duplicates (corners of other ranks' pieces) are counted once.
"""

import json
import sys

from paraview import simple
from paraview.vtk.util.numpy_support import vtk_to_numpy


def describe(data):
    points = data.GetPointData()
    ghosts = points.GetArray("vtkGhostType")
    own = vtk_to_numpy(ghosts) == 0 if ghosts else slice(None)
    fields = {}
    for i in range(points.GetNumberOfArrays()):
        array = points.GetArray(i)
        values = vtk_to_numpy(array)[own].reshape(-1, array.GetNumberOfComponents())
        fields[array.GetName()] = [[float(column.min()), float(column.max())] for column in values.T] if len(values) else []
    count = data.GetNumberOfPoints() if not ghosts else int(own.sum())
    return {"points": count, "cells": data.GetNumberOfCells(), "fields": fields}


def main():
    reader = simple.PVDReader(FileName=sys.argv[1])
    times = list(reader.TimestepValues)
    frames = []
    for time in times:
        simple.UpdatePipeline(time=time, proxy=reader)
        frames.append(describe(simple.servermanager.Fetch(reader)))
    print(json.dumps({"times": times, "frames": frames}))


main()
