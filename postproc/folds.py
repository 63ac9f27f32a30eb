#!/usr/bin/python3
"""How a sheet is folded, and whether its folds are stitches of the mesh: postproc/folds.py RUN.pvd [--frame N] [--json]

Of the net of corners: a cell is four drawn triangles round a lattice point, its normal that of the area between its four
corners. Cells that are cut or have lost a triangle are left out. Where two cells share a side, the fold is the angle by
which the normal turns from one to the other [degrees], positive where the sheet bends one way, negative where it bends
the other. Printed of the last frame, or of frame N (0 is the first, -1 the last):

  rms_fold   root mean square of all folds [degrees],
  rms_bend   root mean square of all folds over the distance of the two cells' middles [1/m]: the curvature across sides,
             which does not depend on the mesh where this is fine enough,
  extents    how far the corners reach along x, y and z [m],
  stitch     share of zigzag in the folds. A pair are the folds a and b along two opposite sides of one cell; those count
             of which one exceeds 10 degrees. Over these

                 stitch = sum of max(0, -a b) / sum of (a^2 + b^2) / 2,

             0 where neighbouring parallel folds turn the same way or one of two is flat, such as in a cylinder or in
             pleats of two cells; 1 where all of them are equal and opposite, pleats of a cell each,
  pairs      how many pairs count; without one stitch is 0.

Of a run of several objects a line each. --json prints a list with an entry an object.
"""

import argparse
import json

import numpy
from vtk.util.numpy_support import vtk_to_numpy

from run_frames import fail, frames, surface

SHARP = 10  # [degrees]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pvd", metavar="RUN.pvd")
    parser.add_argument("--frame", type=int, default=-1, metavar="N", help="number of the frame (-1, the last)")
    parser.add_argument("--json", action="store_true", help="print JSON in place of lines")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    return parser.parse_args()


def whole_cells(path):
    """Returns the places of the vertices (n, 3) [m] and the corners of the cells that are whole (m, 4), each in order."""
    data = surface(path)
    empty = numpy.zeros((0, 3)), numpy.zeros((0, 4), int)
    if data.GetNumberOfCells() == 0:
        return empty
    ids, of_cell = data.GetPointData().GetArray("vertex_id"), data.GetCellData().GetArray("cell_id")
    if ids is None or of_cell is None:
        fail(f"{path}: no vertex_id and cell_id; expected a frame of a run")
    # Every rank has its own copy of a vertex; a cut point has a negative id.
    known, first, number = numpy.unique(vtk_to_numpy(ids), return_index=True, return_inverse=True)
    place = vtk_to_numpy(data.GetPoints().GetData()).astype(float)[first]
    polygons = data.GetPolys()
    sizes = numpy.diff(vtk_to_numpy(polygons.GetOffsetsArray()))
    of_cell, is_triangle = vtk_to_numpy(of_cell), sizes == 3
    whole = numpy.repeat(is_triangle, sizes)
    triangles = number[vtk_to_numpy(polygons.GetConnectivityArray())[whole].reshape(-1, 3)]
    # Cells that have a cut point or a polygon of another size are not whole.
    broken = numpy.union1d(of_cell[~is_triangle], of_cell[is_triangle][(known[triangles] < 0).any(axis=1)])
    of_cell, inverse, count = numpy.unique(of_cell[is_triangle], return_inverse=True, return_counts=True)
    four = (count == 4) & ~numpy.isin(of_cell, broken)
    order = numpy.argsort(inverse[four[inverse]], kind="stable")
    triangles = triangles[four[inverse]][order].reshape(-1, 4, 3)
    if not len(triangles):
        return empty
    # The lattice point is the one that all four have; it is put last.
    points = triangles.reshape(-1, 12)
    shared = (points[:, :, None] == points[:, None, :]).sum(axis=2) == 4
    if not (shared.sum(axis=1) == 4).all():
        fail(f"{path}: cells are not four triangles round a lattice point; expected a frame of a sheet")
    turn = shared.reshape(-1, 4, 3).argmax(axis=2)[:, :, None]
    sides = numpy.take_along_axis(triangles, (turn + 1 + numpy.arange(2)) % 3, axis=2)
    corners = [sides[:, 0, 0], sides[:, 0, 1]]
    for _ in range(2):  # from each corner to the next
        corners.append((sides[:, :, 1] * (sides[:, :, 0] == corners[-1][:, None])).sum(axis=1))
    return place, numpy.stack(corners, axis=1)


def measures(place, cells):
    """What is printed, see above."""
    x = place[cells]
    normal = numpy.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    begin, end = cells.reshape(-1), numpy.roll(cells, -1, axis=1).reshape(-1)  # of side k of cell c at 4 c + k
    key = numpy.minimum(begin, end) * len(place) + numpy.maximum(begin, end)
    order = numpy.argsort(key, kind="stable")
    _, first, count = numpy.unique(key[order], return_index=True, return_counts=True)
    here, beyond = order[first[count == 2]], order[first[count == 2] + 1]
    along = place[end[here]] - place[begin[here]]
    along /= numpy.linalg.norm(along, axis=1)[:, None]
    one, other = normal[here // 4], normal[beyond // 4]
    angle = numpy.degrees(numpy.arctan2((numpy.cross(one, other) * along).sum(axis=1), (one * other).sum(axis=1)))
    middle = x.mean(axis=1)
    bend = numpy.radians(angle) / numpy.linalg.norm(middle[here // 4] - middle[beyond // 4], axis=1)
    fold = numpy.full(len(key), numpy.nan)  # of every side of every cell
    fold[here] = fold[beyond] = angle
    sides = fold.reshape(-1, 4)
    a, b = sides[:, :2].reshape(-1), sides[:, 2:].reshape(-1)  # opposite ones
    counts = numpy.maximum(abs(a), abs(b)) > SHARP  # False where one is not known
    a, b = a[counts], b[counts]
    corners = place[numpy.unique(cells)]
    rms = lambda values: float(numpy.sqrt(numpy.mean(values**2))) if len(values) else 0.0
    return {"cells": len(cells), "rms_fold": rms(angle), "rms_bend": rms(bend),
            "extents": [float(e) for e in numpy.ptp(corners, axis=0)],
            "pairs": len(a),
            "stitch": float(numpy.maximum(0, -a * b).sum() / ((a**2 + b**2) / 2).sum()) if len(a) else 0.0}


def main():
    options = arguments()
    found = []
    for name, series in frames(options.pvd).items():
        if not -len(series) <= options.frame < len(series):
            fail(f"--frame {options.frame}: {options.pvd} has {len(series)}")
        time, path = series[options.frame]
        place, cells = whole_cells(path)
        if len(cells):
            found.append({"object": name, "time": time, **measures(place, cells)})
    if not found:
        fail(f"{options.pvd}: no whole cell in the frame; expected a sheet of which something is left")
    if options.json:
        print(json.dumps(found, indent=1))
        return
    for entry in found:
        extents = " x ".join(f"{extent:.4g}" for extent in entry["extents"])
        print(f"{entry['object'] + ': ' if entry['object'] else ''}{entry['time']:g} s: rms_fold "
              f"{entry['rms_fold']:.3f} degrees, rms_bend {entry['rms_bend']:.4g} 1/m, extents {extents} m, stitch {entry['stitch']:.4f} "
              f"of {entry['pairs']} pairs, {entry['cells']} cells")


if __name__ == "__main__":
    main()
