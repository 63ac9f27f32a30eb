#!/usr/bin/python3
"""Draws how elastic sheets agree with formulas and with themselves: postproc/elastic_plots.py [NAME ...] [--program FILE]

Runs what a plot needs, in a folder that goes afterwards, and writes postproc/plots/NAME.png. Names (all unless given):

  cantilever  shapes of input/cantilever.yaml beside the heavy elastica,
  strip       how far the points of a hanging strip move, beside w (L s - s^2/2) / K,
  frequency   momentum of a cantilever that swings, beside its first frequency,
  crumpling   input/crumpling.yaml on three meshes and with three steps: bend, extent and strain over time,
  folds       stitches of the decks whose folders of a run lie in the folder --runs.

postproc/plots/README.md says what they show.
"""

import argparse
import csv
import os
import subprocess
import sys
import tempfile

import numpy

import folds

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
STRIP = """
mesh: {cells: [20, 4], size: [1 m, 0.2 m]}
sheet: {areal_density: 1 kg/m^2, tensile_stiffness: 500 N/m, bending_stiffness: 0.1 N m, damping: 20 ms}
pins: {top: {box: [-0.501, -1, -1, -0.499, 1, 1]}}
force: {gravity: [9.81 m/s^2, 0, 0], damping: 0}
time: {step: 20 ms, end: 2}
output: {interval_time: 2}
"""


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--program", default=os.path.join(ROOT, "build/release/pellicle"), metavar="FILE",
                        help="the program (build/release/pellicle)")
    parser.add_argument("--runs", default=os.path.join(ROOT, "output"), metavar="FOLDER",
                        help="where the plot folds finds runs (output)")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    for name in options.names:
        if name not in PLOTS:
            parser.error(f"{name}: no such plot; expected some of {', '.join(PLOTS)}")
    if not os.access(options.program, os.X_OK):
        parser.error(f"--program {options.program}: expected a program")
    return options


def run(deck, *more):
    """Runs a deck, a name in input/ or text. Returns the path of its .pvd and the columns of its history."""
    folder = tempfile.mkdtemp(dir=WORK)
    path = os.path.join(ROOT, "input", deck + ".yaml")
    if "\n" in deck:
        path = os.path.join(folder, "scene.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(deck)
    output = os.path.join(folder, "out")
    subprocess.run([OPTIONS.program, path, "-output_directory", output, "-output_name", "run", *more], check=True,
                   stdout=subprocess.DEVNULL)
    with open(os.path.join(output, "history.csv"), encoding="utf-8") as file:
        rows = list(csv.reader(file))
    columns = numpy.array([[float(value) for value in row] for row in rows[1:]]).T
    return os.path.join(output, "run.pvd"), dict(zip((name.split(" [")[0] for name in rows[0]), columns))


def corners(pvd, frame=-1):
    """Returns the places of the corners of a frame [m]."""
    place, cells = folds.whole_cells(folds.frames(pvd)[""][frame][1])
    return place[numpy.unique(cells)]


def elastica(stiffness, weight, steps=2000):
    """Returns x and z [m] of the strip of 1 m: D theta'' = w (1 - s) cos(theta), theta(0) = theta'(1) = 0, by shooting."""
    def shoot(bend):
        s, h = numpy.linspace(0, 1, steps + 1), 1 / steps
        state, path = numpy.array([0.0, bend, 0.0, 0.0]), []
        def slope(at, y):
            return numpy.array([y[1], weight / stiffness * (1 - at) * numpy.cos(y[0]), numpy.cos(y[0]),
                                -numpy.sin(y[0])])
        for at in s:
            path.append(state)
            one = slope(at, state)
            two = slope(at + h / 2, state + h / 2 * one)
            three = slope(at + h / 2, state + h / 2 * two)
            state = state + h / 6 * (one + 2 * two + 2 * three + slope(at + h, state + h * three))
        return numpy.array(path)
    low, high = -weight / stiffness, 0.0  # the curvature at the clamp
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if shoot(middle)[-1, 1] < 0 else (low, middle)
    path = shoot((low + high) / 2)
    return path[:, 2], -numpy.abs(path[:, 3])


def save(figure, name):
    figure.tight_layout()
    figure.savefig(os.path.join(ROOT, "postproc", "plots", name + ".png"), dpi=80)
    pyplot.close(figure)


def cantilever():
    figure, axes = pyplot.subplots(figsize=(6, 5))
    for colour, stiffness in zip("rgb", ("10", "1", "0.1")):
        pvd, _ = run("cantilever", "-mesh_cells", "20,4", "-sheet_bending_stiffness", stiffness, "-output_interval_time",
                     "10")
        place = corners(pvd)
        axes.plot(place[:, 0] + 0.5, place[:, 2], colour + "o", markersize=4, label=f"D = {stiffness} N m, 20 cells")
        x, z = elastica(float(stiffness), 9.81)
        axes.plot(x, z, colour + "-", linewidth=1)
    axes.set(xlabel="x [m]", ylabel="z [m]", title="Cantilever under its weight; lines: elastica", aspect="equal")
    axes.legend()
    save(figure, "cantilever")


def strip():
    pvd, _ = run(STRIP)
    first, last = corners(pvd, 0), corners(pvd)
    s = numpy.linspace(0, 1, 100)
    figure, axes = pyplot.subplots(figsize=(6, 4))
    axes.plot(first[:, 0] + 0.5, 1e3 * (last - first)[:, 0], "ro", markersize=4, label="20 cells")
    axes.plot(s, 1e3 * 9.81 / 500 * (s - s**2 / 2), "k-", linewidth=1, label="w (L s - s^2/2) / K")
    axes.set(xlabel="s [m]", ylabel="displacement [mm]", title="Hanging strip, 1 kg/m^2, K = 500 N/m")
    axes.legend()
    save(figure, "strip")


def frequency():
    _, history = run("cantilever", "-force_gravity", "0,0,-0.01", "-force_damping", "0", "-sheet_damping", "0",
                     "-mesh_cells", "20,4", "-time_step", "2e-3", "-time_end", "3", "-output_interval_time", "10")
    figure, axes = pyplot.subplots(figsize=(6, 4))
    axes.plot(history["time"], 1e6 * history["momentum_z"], "r-", label="20 cells, 2 ms")
    period = 2 * numpy.pi / 1.8751**2
    for half in range(1, int(6 / period) + 1):
        axes.axvline(half * period / 2, color="k", linewidth=0.5, label="half periods, 1.8751^2 sqrt(D / rho L^4)"
                     if half == 1 else None)
    axes.set(xlabel="time [s]", ylabel="momentum along z [1e-6 kg m/s]",
             title="A cantilever of D = 1 N m, 1 kg/m^2, 1 m swings")
    axes.set_ylim(-450, 600)
    axes.legend(loc="upper right")
    save(figure, "frequency")


def crumpling():
    figure, axes = pyplot.subplots(1, 3, figsize=(12, 4))
    for style, cells, step in (("b:", "20", "2e-3"), ("r--", "40", "4e-3"), ("r-", "40", "2e-3"), ("r:", "40", "1e-3"),
                               ("k-", "80", "2e-3")):
        pvd, history = run("crumpling", "-mesh_cells", cells + "," + cells, "-time_step", step)
        series = folds.frames(pvd)[""]
        found = [folds.measures(*folds.whole_cells(path)) for _, path in series]
        times = [time for time, _ in series]
        label = f"{cells} x {cells} cells, {1e3 * float(step):g} ms"
        axes[0].plot(times, [entry["rms_bend"] for entry in found], style, label=label)
        axes[1].plot(times, [numpy.linalg.norm(entry["extents"]) for entry in found], style)
        axes[2].plot(history["time"], 100 * history["mean_strain"], style)
    for axis, title in zip(axes, ("rms_bend [1/m]", "diagonal of the extents [m]", "mean strain [%]")):
        axis.set(xlabel="time [s]", title=title)
    axes[0].legend()
    save(figure, "crumpling")


def stitches():
    found = {}
    for name in sorted(os.listdir(OPTIONS.runs)):
        pvd = os.path.join(OPTIONS.runs, name, name + ".pvd")
        if os.path.isfile(pvd):
            place, cells = folds.whole_cells(folds.frames(pvd).get("", [(0, "")])[-1][1])
            if len(cells):
                found[name] = folds.measures(place, cells)["stitch"]
    if not found:
        sys.exit(f"elastic_plots.py: --runs {OPTIONS.runs}: no run of a sheet; expected folders such as hot_ball")
    figure, axes = pyplot.subplots(figsize=(6, 1 + 0.3 * len(found)))
    axes.barh(list(found), list(found.values()), color="r")
    axes.axvline(0.05, color="k", linewidth=1)
    axes.set(xlabel="stitch of the last frame; line: the most that a test allows", xlim=(0, 0.1))
    save(figure, "folds")


PLOTS = {"cantilever": cantilever, "strip": strip, "frequency": frequency, "crumpling": crumpling, "folds": stitches}
if __name__ == "__main__":
    OPTIONS = arguments()

    import matplotlib  # after the arguments, since it takes a while

    matplotlib.use("Agg")
    from matplotlib import pyplot

    with tempfile.TemporaryDirectory() as WORK:
        for NAME in OPTIONS.names or PLOTS:
            PLOTS[NAME]()
