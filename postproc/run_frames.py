"""What scripts beside this one know of the frames of a run."""

import os
import sys
import xml.etree.ElementTree

import numpy
import run_folder
import vtk
from vtk.util.numpy_support import vtk_to_numpy


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


def frames_by_time(pvd):
    """Returns [(time, {object: file})], in the order of the times; objects as above."""
    files = {}
    for name, entries in frames(pvd).items():
        for time, path in entries:
            files.setdefault(time, {})[name] = path
    return sorted(files.items())


def surface(path):
    """Returns the surface of a frame, a vtkPolyData."""
    fault = run_folder.fault_of_frame(path)
    if fault:
        fail(fault)
    reader = vtk.vtkXMLPPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


class Mesh:
    """What is left of an object in a frame: places and ids of its vertices, each of them once, and triangles."""

    def __init__(self, path):
        triangles = vtk.vtkTriangleFilter()
        triangles.SetInputData(surface(path))
        triangles.Update()
        self.data = triangles.GetOutput()
        if self.data.GetNumberOfPoints() == 0:
            self.ids, self.first, self.places = numpy.zeros(0, int), numpy.zeros(0, int), numpy.zeros((0, 3))
            self.triangles = numpy.zeros((0, 3), int)
            return
        # Every rank has its own copy of a vertex.
        ids = vtk_to_numpy(self.data.GetPointData().GetArray("vertex_id"))
        self.ids, self.first, number = numpy.unique(ids, return_index=True, return_inverse=True)
        self.places = vtk_to_numpy(self.data.GetPoints().GetData()).astype(float)[self.first]
        self.triangles = number[vtk_to_numpy(self.data.GetPolys().GetConnectivityArray()).reshape(-1, 3)]

    def of_vertices(self, field):
        """The values of a field of the points; None where there is none."""
        array = self.data.GetPointData().GetArray(field)
        return None if array is None else vtk_to_numpy(array)[self.first]

    def of_triangles(self, field):
        """The values of a field of the cells; None where there is none."""
        array = self.data.GetCellData().GetArray(field)
        return None if array is None else vtk_to_numpy(array)

    def means(self, field):
        """Of a field of numbers of the cells the means at the vertices; None where there is none."""
        values = self.of_triangles(field)
        if values is None:
            return None
        sums, counts = (numpy.bincount(self.triangles.ravel(), weights, len(self.ids))
                        for weights in (numpy.repeat(values, 3), None))
        return sums / numpy.maximum(counts, 1)

    def normals(self):
        """At the vertices, the means of the triangles' weighted by area."""
        a, b, c = (self.places[self.triangles[:, corner]] for corner in range(3))
        of_triangles = numpy.cross(b - a, c - a)
        normals = numpy.stack([numpy.bincount(self.triangles.ravel(), numpy.repeat(of_triangles[:, axis], 3), len(self.ids))
                               for axis in range(3)], axis=1)
        lengths = numpy.linalg.norm(normals, axis=1, keepdims=True)
        return numpy.where(lengths > 0, normals / numpy.where(lengths > 0, lengths, 1), (0.0, 0.0, 1.0))
