#!/usr/bin/python3
"""Runs a deck with every combination of solver options and compares them: postproc/ensemble.py DECK [DECK ...] OPTIONS

  postproc/ensemble.py input/hot_ball.yaml -mesh_cells 30,30 -time_end 0.1 -elastic_pc_type jacobi,pbjacobi,gamg
  postproc/ensemble.py input/hot_sphere_b.yaml -dynamics projection -mesh_cells 40,40 -time_end 0.1 -np 2 \\
    -project_pc_type icc,jacobi,gamg -project_ksp_type cg,minres
  postproc/ensemble.py input/leaking_balloon.yaml -time_end 1 -prism_pc_type jacobi,pbjacobi -tight "-prism_snes_rtol 1e-11"

In an option of a solver (-project_, -elastic_, -spring_, -heat_, -prism_; of one object -objects_NAME_project_ and so on) a
comma separates values, of which each is run with each of the others'. Other options are pellicle's, and go to all runs. Of
ensemble.py itself:

  -np N           ranks (1)
  -tight OPTIONS  the run that the others are compared with has these besides (tolerances of the solvers that are tried:
                  see TIGHT in the script)
  -to FOLDER      where the runs go (output/ensemble_DECK); the table is FOLDER/table.csv, the plot table.png and table.svg
  -program FILE   the program (build/release/pellicle)

Prints of each run the iterations of the linear solver and of Newton's method, sums of all steps; the seconds of its stage
and of the whole step; and how far a vertex is at most from where it is in the tight run [m], in all frames, by vertex_id;
also of how many vertices, summed over the frames, only one of the runs has.
"""

import csv
import itertools
import os
import re
import shlex
import subprocess
import sys

import run_folder

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SOLVER = re.compile(r"-(?:objects_.*_)?(project|elastic|spring|heat|prism)_")
TIGHT = {"project": "ksp_rtol 1e-12", "elastic": "ksp_rtol 1e-10 newton_tolerance 1e-9",
         "spring": "ksp_rtol 1e-12 newton_tolerance 1e-10", "heat": "ksp_rtol 1e-13",
         "prism": "ksp_rtol 1e-12 snes_rtol 1e-11"}
ITERATIONS = {"heat": "heat_iterations", "prism": "linear_iterations"}  # else projection_iterations
STAGES = {"heat": "seconds_heat", "prism": "seconds_implicit_step"}  # else seconds_projection
COLUMNS = ["linear iterations", "newton iterations", "seconds of stage", "seconds of step", "error [m]",
           "vertices of one only"]


def refuse(problem):
    print(f"ensemble.py: {problem}", file=sys.stderr)
    sys.exit(2)


class Options:
    """decks, varied {option: values}, passed (arguments), np, tight, to, program"""

    def __init__(self, arguments):
        if {"-h", "--help", "-help"} & set(arguments):
            print(__doc__)
            sys.exit()
        self.decks, self.varied, self.passed = list(itertools.takewhile(lambda text: text[0] != "-", arguments)), {}, []
        own = {"-np": "1", "-tight": None, "-to": None, "-program": os.path.join(ROOT, "build/release/pellicle")}
        rest = arguments[len(self.decks):]
        while rest:
            name, *rest = rest
            values = list(itertools.takewhile(lambda text: not re.match("-[A-Za-z]", text), rest))
            if name in own:
                values = rest[:1]  # also options, after -tight
                if not values:
                    refuse(f"{name}: expected a value")
                own[name] = values[0]
            elif values and SOLVER.match(name) and "," in values[0]:
                self.varied[name] = values[0].split(",")
            else:
                self.passed += [name, *values]
            rest = rest[len(values):]
        for deck in self.decks:
            if not os.path.isfile(deck):
                refuse(f"{deck}: no such deck")
        if not self.decks:
            refuse("no deck; expected ensemble.py DECK -project_pc_type icc,jacobi")
        if not self.varied:
            refuse("nothing to try; expected an option of a solver with several values, -project_pc_type icc,jacobi")
        if not own["-np"].isdecimal() or int(own["-np"]) < 1:
            refuse(f"-np {own['-np']}: expected a number of ranks, at least 1")
        if not os.access(own["-program"], os.X_OK) or os.path.isdir(own["-program"]):
            refuse(f"-program {own['-program']}: expected a program")
        self.np, self.program = own["-np"], own["-program"]
        name = os.path.basename(self.decks[0])
        self.to = own["-to"] or os.path.join("output", "ensemble_" + os.path.splitext(name)[0])
        self.tight = shlex.split(own["-tight"]) if own["-tight"] else tight_of(self.varied)


def tight_of(varied):
    """Tolerances for the solvers whose options are tried."""
    options = []
    for prefix in dict.fromkeys(SOLVER.match(name).group() for name in varied):
        words = TIGHT[SOLVER.match(prefix).group(1)].split()
        for name, value in zip(words[::2], words[1::2]):
            options += [prefix + name, value]
    return options


OPTIONS = Options(sys.argv[1:])

# After the arguments, since they take a while.
import matplotlib  # noqa: E402
import numpy  # noqa: E402

import run_frames  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


def run(folder, options):
    """@returns None, or why the run failed"""
    mpirun = ["mpirun", "-n", OPTIONS.np] if int(OPTIONS.np) > 1 else []
    told = subprocess.run([*mpirun, OPTIONS.program, *OPTIONS.decks, *OPTIONS.passed, *options, "-output_directory", folder],
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if told.returncode == 0:
        return None
    lines = [line for line in (told.stderr + told.stdout).splitlines() if line.strip()]
    named = [line for line in lines if re.match(r"pellicle: |step \d+ at time ", line)]
    return (named or lines or ["no word"])[-1]


def measures(folder, solvers):
    """The sums of COLUMNS but the errors."""
    sums = dict.fromkeys(COLUMNS[:4], 0.0)
    for path in run_folder.histories(folder).values():
        with open(path, encoding="utf-8") as file:
            for row in csv.DictReader(file):
                row = {name.split(" [")[0]: float(value) for name, value in row.items()}
                for name in {ITERATIONS.get(solver, "projection_iterations") for solver in solvers}:
                    sums["linear iterations"] += row.get(name, 0)
                for name in {STAGES.get(solver, "seconds_projection") for solver in solvers}:
                    sums["seconds of stage"] += row.get(name, 0)
                sums["newton iterations"] += row.get("newton_iterations", 0)
                sums["seconds of step"] += sum(value for name, value in row.items()
                                               if name.startswith("seconds_") and name != "seconds_output")
    return sums


def difference(folder, other):
    """Largest distance of a vertex in two runs, in all frames, and how many vertices one of them lacks."""
    largest, lacking = 0.0, 0
    frames = [dict(((round(time, 12), name), path) for time, files in
                   run_frames.frames_by_time(run_folder.series(each)[""]) for name, path in files.items())
              for each in (folder, other)]
    for key in frames[0].keys() | frames[1].keys():
        a, b = (run_frames.Mesh(of_run[key]) if key in of_run else None for of_run in frames)
        if a is None or b is None:
            lacking += len((a or b).ids)
            continue
        common, of_a, of_b = numpy.intersect1d(a.ids[a.ids >= 0], b.ids[b.ids >= 0], return_indices=True)
        lacking += (a.ids >= 0).sum() + (b.ids >= 0).sum() - 2 * len(common)
        if len(common):
            distances = numpy.linalg.norm(a.places[a.ids >= 0][of_a] - b.places[b.ids >= 0][of_b], axis=1)
            largest = max(largest, float(distances.max()))
    return {"error [m]": largest, "vertices of one only": int(lacking)}


PANELS = [("linear iterations", "linear iterations, all steps", "linear"),
          ("seconds of stage", "time in the stage [s]", "linear"),
          ("error [m]", "largest distance from the tight run [m]", "log")]


def plot(rows, path):
    figure, panels = pyplot.subplots(1, 3, figsize=(12, 1.2 + 0.35 * len(rows)), sharey=True)
    names = [name for name, _ in rows]
    for axes, (column, label, scale) in zip(panels, PANELS):
        values = [row[column] if row else numpy.nan for _, row in rows]
        if scale == "log":  # on which bars have no lower end
            axes.set_xscale("log")
            axes.plot([value if value > 0 else numpy.nan for value in values], range(len(rows)), "o", color="tab:red")
            axes.xaxis.set_minor_formatter("")
            known = [value for value in values if value > 0] or [1]
            axes.set_xlim(10 ** numpy.floor(numpy.log10(min(known)) - 0.1), 10 ** numpy.ceil(numpy.log10(max(known)) + 0.1))
        else:
            axes.barh(range(len(rows)), values, color="tab:red")
        for place, value in enumerate(values):
            if numpy.isnan(value):
                axes.text(0.02, place, "failed", va="center", transform=axes.get_yaxis_transform())
        axes.set(xlabel=label, ylim=(len(rows) - 0.5, -0.5))
        axes.grid(axis="x", alpha=0.3)
    panels[0].set_yticks(range(len(rows)), names)
    figure.suptitle(" ".join(os.path.basename(deck) for deck in OPTIONS.decks) + f", {OPTIONS.np} rank" + "s" * (OPTIONS.np != "1"))
    figure.tight_layout()
    for end in ("png", "svg"):
        figure.savefig(f"{path}.{end}", dpi=110)
        print(f"{path}.{end}")


def main():
    names = list(OPTIONS.varied)
    solvers = {SOLVER.match(name).group(1) for name in names}
    tight = os.path.join(OPTIONS.to, "tight")
    fault = run(tight, OPTIONS.tight)
    if fault:
        sys.exit(f"ensemble.py: the tight run, {' '.join(OPTIONS.tight)}, failed: {fault}")
    widths = [max(len(name.lstrip("-")), *map(len, OPTIONS.varied[name])) for name in names]
    print(*(name.lstrip("-").ljust(width) for name, width in zip(names, widths)), "linear it  newton it  stage [s]   step [s]"
          "  error [m]  of one only", sep="  ")
    rows = []
    for values in itertools.product(*OPTIONS.varied.values()):
        folder = os.path.join(OPTIONS.to, "_".join(re.sub(r"[^\w.+-]", "_", value) for value in values))
        fault = run(folder, [word for pair in zip(names, values) for word in pair])
        row = None if fault else {**measures(folder, solvers), **difference(folder, tight)}
        rows.append((", ".join(values), row))
        numbers = f"failed: {fault}" if fault else ("{:9.0f}  {:9.0f}  {:9.2f}  {:9.2f}  {:9.2e}  {:11d}".format(
            *(row[column] for column in COLUMNS)))
        print(*(value.ljust(width) for value, width in zip(values, widths)), numbers, sep="  ", flush=True)
    with open(os.path.join(OPTIONS.to, "table.csv"), "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names + COLUMNS)
        for values, (_, row) in zip(itertools.product(*OPTIONS.varied.values()), rows):
            writer.writerow([*values, *([row[column] for column in COLUMNS] if row else ["failed"] * len(COLUMNS))])
    plot(rows, os.path.join(OPTIONS.to, "table"))
    if all(row is None for _, row in rows):
        sys.exit("ensemble.py: no run went through")


main()
