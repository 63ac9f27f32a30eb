"""What scripts beside this one know of the frames of a run."""

import os
import sys
import xml.etree.ElementTree

import vtk


def fail(problem):
    sys.exit(f"{os.path.basename(sys.argv[0])}: {problem}")


def frames(pvd):
    """Returns {object: [(time, file)]}; the object is "" where a run has one without a name."""
    series = {}
    try:
        for entry in xml.etree.ElementTree.parse(pvd).getroot().iter("DataSet"):
            series.setdefault(entry.get("name") or "", []).append(
                (float(entry.get("timestep")), os.path.join(os.path.dirname(pvd), entry.get("file"))))
    except (OSError, TypeError, ValueError, xml.etree.ElementTree.ParseError) as error:
        fail(f"{pvd}: {error}; expected the .pvd of a run")
    if not series:
        fail(f"{pvd}: no frame; expected one at least")
    return series


def surface(path):
    """Returns the surface of a frame, a vtkPolyData."""
    if not os.path.isfile(path):
        fail(f"{path}: no such file, which the .pvd names")
    reader = vtk.vtkXMLPPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()
