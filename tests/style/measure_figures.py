#!/usr/bin/python3
"""That the figures of the pages' tables come out again: of one row in ten, or of all rows that a text is found in.

measure_figures.py SOURCE_FOLDER PROGRAM [--seed SEED] [--rows TEXT]

Reads the comments "<!-- measured by" (figures.py says how they are written), runs the commands of the rows that the
seed chooses, unless given the commit, and compares. An expression of a figure knows numpy, the columns of history.csv,
arrays by step, and fold(NAME), an array by frame of what postproc/folds.py measures, and of the frames' time.
"""

import argparse
import concurrent.futures
import csv
import functools
import os
import pathlib
import random
import shlex
import subprocess
import sys
import tempfile

import figures
import numpy

RUNS_AT_ONCE = 2


def folds_of(pvd, name):
    import folds  # of postproc
    measured = ((time, *folds.whole_cells(path)) for time, path in folds.frames(str(pvd))[""])
    found = [{"time": time, **folds.measures(place, cells)} for time, place, cells in measured if len(cells)]
    return numpy.array([frame[name] for frame in found])


@functools.lru_cache(None)
def names_of_run(root, program, command):
    """What expressions know of a run, which is made in a folder of its own that is left for them."""
    folder = pathlib.Path(tempfile.mkdtemp(dir=FOLDER))
    words = [str(program) if word == "pellicle" else word for word in shlex.split(command)]
    told = subprocess.run([*words, "-output_directory", folder, "-checkpoint_keep", "0"], cwd=root, capture_output=True,
                          text=True, check=False)
    if told.returncode != 0:
        raise ValueError(f"{command}: ended with {told.returncode}: {(told.stdout + told.stderr)[-400:]}")
    with open(folder / "history.csv", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    columns = numpy.array([[float(cell) for cell in row] for row in rows[1:]]).T
    pvd = next(path for path in folder.glob("*.pvd") if not path.stem.endswith("_bodies"))
    return {"numpy": numpy, "fold": functools.partial(folds_of, pvd),
            **{heading.split(" ")[0]: column for heading, column in zip(rows[0], columns)}}


def measure(root, program, row):
    """Lines about a row's figures, and how many of them are faults."""
    lines, faults = [], 0
    for figure in row:
        try:
            value = float(eval(figure.expression, {}, names_of_run(root, program, figure.command)))
            is_near = abs(value - figure.printed) <= figure.tolerance
            verdict = "" if is_near else f", expected within {figure.tolerance:.3g}"
            lines.append(f"{figure.where}: {figure.printed:g} printed, {value:.5g} measured{verdict}")
        except (ValueError, NameError, LookupError) as fault:
            is_near = False
            lines.append(f"{figure.where}: {fault}")
        faults += not is_near
    return lines, faults


def commit(root):
    told = subprocess.run(["git", "-C", root, "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    return told.stdout.strip() if told.returncode == 0 else "no commit"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--seed", help="a text that chooses the rows (the commit)")
    parser.add_argument("--rows", metavar="TEXT", help="all rows whose place, command or expressions have TEXT")
    options = parser.parse_args()
    root, program = options.root.resolve(), options.program.resolve()
    sys.path.insert(0, str(root / "postproc"))
    rows = [row for pattern in figures.PAGES for path in sorted(root.glob(pattern))
            for row in figures.measured_rows(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))]
    if options.rows is not None:
        chosen = [row for row in rows if any(options.rows in text for figure in row
                                             for text in (figure.where, figure.command, figure.expression))]
    else:
        seed = options.seed or commit(root)
        chosen = random.Random(seed).sample(rows, -(-len(rows) // 10))
        print(f"{len(chosen)} of {len(rows)} rows by the seed {seed}")
    faults = 0
    with concurrent.futures.ThreadPoolExecutor(RUNS_AT_ONCE) as pool:
        for lines, found in pool.map(functools.partial(measure, root, program), chosen):
            faults += found
            print(*lines, sep="\n", flush=True)
    print(f"{len(chosen)} rows, {faults} faults")
    sys.exit(1 if faults or not chosen else 0)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="pellicle_figures_") as FOLDER:
        main()
