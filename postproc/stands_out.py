#!/usr/bin/python3
"""How far small parts of a balloon still stand out from a big one: postproc/stands_out.py OUTPUT_FOLDER [OUTPUT_FOLDER ...]

For balloons made of blobs, such as the teddy and its ears (balloon paper, Fig. 7). In the undeformed mesh a vertex
belongs to the part whose sphere is nearer than the base's; the seam is where both are as near. At each frame

  height      of the part's top above a sphere fitted to that side of the base that the parts are on [m],
  seam        radius of the seam: root mean square of the distance from its middle [m],
  stands_out  height over seam, relative to the undeformed one: 1 undeformed, 0 merged with the base,
  stretch_part, stretch_seam, stretch_base   square root of the area ratio of part and base, ratio of the seam's radius,

the mean of all parts. Written to OUTPUT_FOLDER/stands_out.csv; what several runs give is printed side by side, at the
same times and at the same volumes (s_part: stretch_part).
"""

import argparse
import csv
import os

import numpy
import yaml
from vtk.util.numpy_support import vtk_to_numpy

from run_folder import series
from run_frames import fail, frames, surface

COLUMNS = ["time", "volume_ratio", "height", "seam", "stands_out", "stretch_part", "stretch_seam", "stretch_base"]
SHOWN = ["stands_out", "stretch_part", "stretch_seam", "stretch_base"]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUTPUT_FOLDER")
    parser.add_argument("--parts", nargs="+", default=["left_ear", "right_ear"], help="names of blobs, spheres "
                        "(left_ear right_ear)")
    parser.add_argument("--base", default="head", help="the blob that they stand on, a sphere (head)")
    parser.add_argument("--rows", type=int, default=8, help="of the printed tables, at least 1 (8)")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    if options.rows < 1:
        parser.error(f"argument --rows: {options.rows}; expected at least 1")
    if options.base in options.parts:
        parser.error(f"argument --parts: {options.base} is the base; expected other blobs")
    return options


def the_pvd(folder):
    """Returns the .pvd of the run in a folder."""
    files = series(folder)
    if "" not in files:
        fail(f"{folder}: no .pvd of a run, or of several; expected the folder of one")
    return files[""]


def read_frame(path):
    """Returns the points by vertex_id [m] and the triangles as three of these numbers each, sorted by cell_id."""
    data = surface(path)
    if data.GetPointData().GetArray("vertex_id") is None or data.GetNumberOfCells() == 0:
        fail(f"{path}: no triangles with vertex_id; expected a frame of a balloon")
    if data.GetPolys().GetNumberOfConnectivityIds() != 3 * data.GetNumberOfCells() or \
            vtk_to_numpy(data.GetPointData().GetArray("vertex_id")).min() < 0:
        fail(f"{path}: not the triangles of a mesh; expected a frame of a balloon")
    number = vtk_to_numpy(data.GetPointData().GetArray("vertex_id")).astype(int)
    points = numpy.empty((number.max() + 1, 3))
    points[number] = vtk_to_numpy(data.GetPoints().GetData())
    triangles = number[vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)]
    order = numpy.argsort(vtk_to_numpy(data.GetCellData().GetArray("cell_id")))
    return points, triangles[order]


def volume(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return numpy.einsum("ij,ij->", a, numpy.cross(b, c)) / 6


def areas(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1) / 2


def read_sphere(folder, name):
    """Returns centre and radius of a blob as the deck has them [m]."""
    path = os.path.join(folder, "options.yaml")
    try:
        with open(path, encoding="utf-8") as deck:
            mesh = yaml.safe_load(deck)["mesh"]
    except (OSError, KeyError, TypeError, yaml.YAMLError):
        fail(f"{path}: cannot be read; expected the options of a run")
    if mesh["shape"] != "blobs" or mesh["file"]:
        fail(f"{folder}: its mesh is {mesh['file'] or mesh['shape']}; expected one of blobs, mesh.shape: blobs")
    blob = (mesh.get("blobs") or {}).get(name)
    if not blob or blob["shape"] != "sphere":
        fail(f"{folder}: mesh.blobs.{name} is no sphere; the spheres are "
             + ", ".join(known for known, other in mesh["blobs"].items() if other["shape"] == "sphere"))
    return numpy.array(blob["centre"], float), float(blob["radius"])


def distance(points, sphere):
    return numpy.linalg.norm(points - sphere[0], axis=1) - sphere[1]


def fit_sphere(points):
    """Returns centre and radius of the sphere |x|^2 = 2 c.x + k that fits best by least squares."""
    middle = points.mean(axis=0)
    arms = points - middle
    system = numpy.hstack([2 * arms, numpy.ones((len(arms), 1))])
    solution = numpy.linalg.lstsq(system, (arms**2).sum(axis=1), rcond=None)[0]
    return middle + solution[:3], numpy.sqrt(solution[3] + solution[:3] @ solution[:3])


class Part:
    """A small part: its vertices, triangles, seam and top, chosen in the undeformed mesh."""

    def __init__(self, points, triangles, sphere, base):
        members = distance(points, sphere) < distance(points, base)
        inside = members[triangles]
        self.triangles = triangles[inside.all(axis=1)]
        self.seam = numpy.unique(triangles[inside.any(axis=1) & ~inside.all(axis=1)])
        axis = (sphere[0] - base[0]) / numpy.linalg.norm(sphere[0] - base[0])
        self.members = numpy.flatnonzero(members)
        # The top: within 20 degrees of the axis, seen from the part's own middle.
        arms = points[members] - sphere[0]
        self.top = self.members[arms @ axis > numpy.cos(numpy.radians(20)) * numpy.linalg.norm(arms, axis=1)]

    def measure(self, points, base):
        """Returns height, radius of the seam and area."""
        seam = points[self.seam] - points[self.seam].mean(axis=0)
        return distance(points[self.top], base).mean(), numpy.sqrt((seam**2).sum(axis=1).mean()), \
            areas(points, self.triangles).sum()


def measure(folder, options):
    """Returns the rows of COLUMNS of a run."""
    series = [frame for of_object in frames(the_pvd(folder)).values() for frame in of_object]
    points, triangles = read_frame(series[0][1])
    base = read_sphere(folder, options.base)
    spheres = [read_sphere(folder, name) for name in options.parts]
    # The deck's blobs were scaled about the origin to the volume asked for. A part is what reaches farthest along the
    # line from the base to it: that gives the factor.
    axis = spheres[0][0] - base[0]
    axis /= numpy.linalg.norm(axis)
    factor = (points @ axis).max() / (spheres[0][0] @ axis + spheres[0][1])
    base = tuple(factor * value for value in base)
    parts = [Part(points, triangles, tuple(factor * value for value in sphere), base) for sphere in spheres]

    # The base: what lies within a twentieth of its radius from its sphere, on the parts' side.
    side = numpy.mean([sphere[0] for sphere in spheres], axis=0) * factor - base[0]
    of_base = (abs(distance(points, base)) < 0.05 * base[1]) & ((points - base[0]) @ side > 0)
    for part in parts:
        of_base[part.members] = False
    base_vertices = numpy.flatnonzero(of_base)
    base_triangles = triangles[of_base[triangles].all(axis=1)]
    for name, part in zip(options.parts, parts):
        if not (len(part.triangles) and len(part.seam) and len(part.top)):
            fail(f"{folder}: {name} has no triangles, no seam with {options.base}, or no top in this mesh; expected a "
                 "finer mesh, or a part that stands on the base")
    if len(base_vertices) < 4 or not len(base_triangles):
        fail(f"{folder}: {len(base_vertices)} vertices on the sphere of {options.base} on the parts' side; expected a "
             "finer mesh, or another base")

    rows = []
    first = None
    for time, path in series:
        points, triangles = read_frame(path)
        sphere = fit_sphere(points[base_vertices])
        height, seam, part_area = numpy.mean([part.measure(points, sphere) for part in parts], axis=0)
        now = [volume(points, triangles), height / seam, part_area, seam, areas(points, base_triangles).sum()]
        first = first or now
        ratio = [value / start for value, start in zip(now, first)]
        rows.append([time, ratio[0], height, seam, ratio[1], ratio[2]**0.5, ratio[3], ratio[4]**0.5])
        if not numpy.isfinite(rows[-1]).all():
            fail(f"{path}: its points give no finite figures")
    with open(os.path.join(folder, "stands_out.csv"), "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        units = {"time": " [s]", "height": " [m]", "seam": " [m]"}
        writer.writerow([name + units.get(name, "") for name in COLUMNS])
        writer.writerows([f"{value:.6g}" for value in row] for row in rows)
    return numpy.array(rows)


def print_table(runs, by, values):
    """A line for each value of the column `by`, the columns SHOWN of each run; "-" where a run did not get there."""
    width = 10 * len(SHOWN)
    print(f"\n{'':>12}" + "".join(f"   {name[-width:]:<{width}}" for name in runs))
    heads = "".join(f"{figure.replace('stretch_', 's_'):>10}" for figure in SHOWN)
    print(f"{by:>12}" + len(runs) * f"   {heads}")
    for value in values:
        line = f"{value:12.4g}"
        for rows in runs.values():
            reached = numpy.maximum.accumulate(rows[:, COLUMNS.index(by)])
            line += "   "
            for figure in SHOWN:
                number = numpy.interp(value, reached, rows[:, COLUMNS.index(figure)])
                line += f"{number:10.3f}" if value <= reached[-1] else f"{'-':>10}"
        print(line)


def main():
    options = arguments()
    runs = {os.path.normpath(folder): measure(folder, options) for folder in options.folders}
    end = min(rows[-1, 0] for rows in runs.values())
    print_table(runs, "time", numpy.linspace(0, end, options.rows))
    largest = max(rows[:, 1].max() for rows in runs.values())
    print_table(runs, "volume_ratio", numpy.linspace(1, largest, options.rows))


main()
