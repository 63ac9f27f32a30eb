"""That plots show the histories of runs: plots_test.py SOURCE_FOLDER MPIEXEC PROGRAM"""

import csv
import re
import sys
import tempfile
import xml.etree.ElementTree

import numpy
from tiny_run import Faults, run, tiny_run

SVG = "{http://www.w3.org/2000/svg}"


def columns(path):
    with open(path, encoding="utf-8") as file:
        head, *lines = csv.reader(file)
    return dict(zip((name.split(" [")[0] for name in head), numpy.array(lines, float).T))


def lines_of(svg):
    """The points (n, 2) of each line, as they are drawn, y upwards."""
    lines = {}
    for group in svg.iter(SVG + "g"):
        path = group.find(SVG + "path")
        if path is not None and ": " in group.get("id", ""):
            numbers = [float(number) for number in re.findall(r"-?[\d.]+", path.get("d"))]
            lines[group.get("id")] = numpy.reshape(numbers, (-1, 2)) * (1, -1)
    return lines


def main():
    source, mpiexec, program = sys.argv[1:]
    faults = Faults()
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as other:
        runs = [tiny_run(mpiexec, program, one),
                tiny_run(mpiexec, program, other, "-objects_paper_dynamics", "projection",
                         "-objects_paper_project_monitor")]
        told = run([sys.executable, f"{source}/postproc/plots.py", *runs, "--to", f"{one}/both"])
        faults.unless(told.stdout == f"{one}/both.png\n{one}/both.svg\n" and not told.stderr, f"{told}")
        with open(f"{one}/both.png", "rb") as file:
            faults.unless(file.read(8) == b"\x89PNG\r\n\x1a\n", "no PNG")
        svg = xml.etree.ElementTree.parse(f"{one}/both.svg").getroot()
        texts = {"".join(text.itertext()).strip() for text in svg.iter(SVG + "text")}
        for text in ("mass", "mass [kg]", "heat [J]", "temperature [K]", "strain rms", "norm of the constraints [m]",
                     "pressure against outside [Pa]", "energy [J]", "iterations in a step", "time in all steps [s]",
                     "implicit step", "elastic energy", f"{runs[0]}: paper", f"{runs[1]}: balloon"):
            faults.unless(text in texts, f"{text} is not in the picture")
        lines = lines_of(svg)
        # A drawn line is the column, but for shift and scale.
        for folder, label, panel, x, y in ((0, "paper", "mass", "time", "mass_left"),
                                           (1, "paper", "temperature", "time", "temperature_max"),
                                           (1, "balloon", "pressure volume", "gas_volume", "gas_pressure")):
            history = columns(runs[folder] / f"history_{label}.csv")
            drawn = lines[f"{runs[folder]}: {label}: {panel}: {y}"]
            ends = history[x][[0, -1]]
            across = numpy.interp(drawn[:, 0], drawn[[0, -1], 0], ends)
            expected = numpy.interp(across, history[x], history[y])
            low, high = expected.argmin(), expected.argmax()
            share = (drawn[:, 1] - drawn[low, 1]) / (drawn[high, 1] - drawn[low, 1])
            error = numpy.abs(share - (expected - expected[low]) / (expected[high] - expected[low])).max()
            faults.unless(error < 0.01, f"{y} is drawn with an error of {error}")
        faults.unless(f"{runs[1]}: paper: constraint error: error_blue" in lines, "no error of the blue constraints")
        told = run([sys.executable, f"{source}/postproc/plots.py", runs[0], "--panels", "energy,mass"])
        svg = xml.etree.ElementTree.parse(runs[0] / "plots.svg").getroot()
        names = {name.split(": ")[-2] for name in lines_of(svg)}
        faults.unless(names == {"energy", "mass"}, f"{names}, {told}")
    faults.end()


main()
