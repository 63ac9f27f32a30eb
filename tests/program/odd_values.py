"""Gives every numeric option odd values, and judges what comes out: odd_values.py PROGRAM [PART_OF_A_KEY ...]

Every deck of tests/program/odd_values is run as it is, with floating-point exceptions trapped; the options.yaml of the
run says which options act in it. Each of these gets numbers below zero, zero, tiny and huge ones, and key points whose
times fall. What comes out must be one of these:

- a refusal: exit code 1, no file, one line that names the option, or the object that has it, and what was expected;
- a step that fails, by exit code 1 and one line, behind a run as in the next case;
- a run whose tables have finite numbers only, in which mass does not grow or get lost, nothing is hotter than sources
  and fire make it, nothing is below 0 K, and no energy, volume, pressure or amount is below 0. A tolerance must not
  change the result by much.

An option that acts in no deck is a fault, too.
"""

import concurrent.futures
import csv
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import vtk
import yaml
from vtk.util.numpy_support import vtk_to_numpy

DECKS = pathlib.Path(__file__).parent / "odd_values"
TINY, HUGE = "1e-200", "1e200"
# Of an option, the first deck counts in which it acts: those with most going on come first, but for meshes.
FIRST = ("flat", "sheet", "balloon")
NEVER_BELOW_ZERO = ("mass_left", "mass_burnt", "kinetic_energy", "elastic_energy", "temperature_max", "heat_in",
                    "heat_content", "gas_volume", "gas_absolute_pressure", "gas_amount", "gas_temperature",
                    "thickness_min", "mean_strain")
MESHES = ("rectangle", "torus", "roof", "shirt", "tube", "ellipsoid", "icosphere", "disc", "blobs", "the mesh")


def run(command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL,
                              timeout=60)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 124, "", "no end within a minute")


def declared(program):
    """The numeric options. @returns {key: (unit, range)}, of named objects with NAME in the key"""
    options = {}
    for line in run([program, "-options_table"]).stdout.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if not line.startswith("| `"):
            continue
        key, default, unit, allowed = cells[0].strip("`"), *cells[3:6]
        has_range = re.match(r"\d+ numbers|at |more |less |[-\d.e]+ to ", allowed)
        if re.match(r"[-\d]", default) or unit or has_range:
            options[key] = unit, allowed
    return options


def acting(tree, options, path=()):
    """The numeric options in an options.yaml. @returns [(key, key with NAME, value)]"""
    found = []
    for name, value in tree.items():
        if isinstance(value, dict):
            found += acting(value, options, (*path, str(name)))
            continue
        words = (*path, str(name))
        keys = [".".join(words), *(".".join((*words[:i], "NAME", *words[i + 1:])) for i in range(1, len(words) - 1))]
        found += [(keys[0], key, value) for key in keys if key in options]
    return found


def odd_values(unit, allowed, value):
    """Words of the command line for an option. @param value that it has in its deck"""
    def word(number):
        return number + " rad" if unit == "rad" else number

    count = re.search(r"(\d+) numbers", allowed)
    if "," in unit:  # key points
        columns = unit.count(",")
        points = value if value else [[0] + columns * [1], [1] + columns * [1]]
        first, last = (list(map(str, points[i])) for i in (0, -1))
        last[0] = str(points[0][0] + 1)
        for number in ("-1", TINY, HUGE):
            yield ";".join(",".join([row[0]] + columns * [number]) for row in (first, last))
        yield ";".join(",".join(row) for row in (last, first))
    elif count or isinstance(value, list):
        size = int(count[1]) if count else max(1, len(value))
        is_whole = value and all(isinstance(entry, int) for entry in value) and not unit
        for number in ("-1", "0", *(("2147483647", "1.5") if is_whole else (TINY, HUGE))):
            yield ",".join(size * [word(number)])
        if size > 1 and len(value or []) == size:
            yield ",".join([*map(str, value[:-1]), word("-1")])
    else:
        is_whole = isinstance(value, int) and not unit and "." not in allowed
        for number in ("-1", "0", TINY, HUGE, *(("2147483647",) if is_whole else ())):
            yield word(number)


def columns_of(path):
    """Of a table {column without its unit: [number]}."""
    with open(path, encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    columns = {name.split(" [")[0]: [] for name in head}
    for row in rows:
        for name, text in zip(columns, row):
            try:
                columns[name].append(float(text))
            except ValueError:
                pass
    return columns


def hottest(tree):
    """The highest temperature that a deck gives, and what fire adds [K]."""
    highest = 293.15
    for name, value in tree.items():
        if isinstance(value, dict):
            highest = max(highest, hottest(value))
        elif name.endswith("temperature") and value not in ("none", []):
            highest = max(highest, *([row[1] for row in value] if isinstance(value, list) else [float(value)]))
    return highest + float(tree.get("burning_heat", 0))


def faults_of_tables(folder):
    for path in sorted(folder.glob("*.csv")):
        columns = columns_of(path)
        for name, column in columns.items():
            if not all(map(math.isfinite, column)):
                yield f"{path.name}: {name} is not finite"
            if name.startswith(NEVER_BELOW_ZERO) and column and min(column) < -1e-12 * max(1, *map(abs, column)):
                yield f"{path.name}: {name} is {min(column)}"
        left = columns.get("mass_left", [])
        if any(after > before * (1 + 1e-12) for before, after in zip(left, left[1:])):
            yield f"{path.name}: the mass grows, {left}"
        masses = [sum(pair) for pair in zip(left, columns.get("mass_burnt", []))]
        if masses and max(masses) - min(masses) > 1e-9 * max(masses):
            yield f"{path.name}: mass is lost or made, {masses}"
        limit = hottest(yaml.safe_load((folder / "options.yaml").read_text(encoding="utf-8")))
        if max(columns.get("temperature_max") or [0]) > limit * (1 + 1e-6):
            yield f"{path.name}: {max(columns['temperature_max'])} K, sources and fire make {limit} K at most"


def faults_of_frames(folder):
    for path in sorted(set(folder.glob("*.pvtp")) - set(folder.glob("*_failed_*"))):
        reader = vtk.vtkXMLPPolyDataReader()
        reader.SetFileName(str(path))
        reader.Update()
        points = reader.GetOutput().GetPointData()
        if points.HasArray("temperature") and vtk_to_numpy(points.GetArray("temperature")).min(initial=1) <= 0:
            yield f"{path.name}: not above 0 K"


def changes(folder, usual):
    """What a tolerance has changed. @param usual folder of the run without it"""
    here, there = (columns_of(next(path.glob("history*.csv"))) for path in (folder, usual))
    if here["time"][-1:] != there["time"][-1:]:
        return
    for name in ("largest_strain", "temperature_max", "gas_volume", "mass_left"):
        if here.get(name) and there.get(name):
            change = abs(here[name][-1] - there[name][-1])
            if change > 0.1 * abs(there[name][-1]) + 1e-3:
                yield f"{name} is {here[name][-1]} in place of {there[name][-1]}"


def faults_of(told, folder, key, usual):
    """What is wrong with a run that was given an odd value of an option. @param usual folder of the run without it"""
    lines = told.stderr.splitlines()
    if told.returncode not in (0, 1) or len(lines) != told.returncode:
        return [f"exit code {told.returncode} with {lines[:3]}"]
    if not folder.exists():
        owner = key.rsplit(".", 1)[0]
        names = [key, "-" + key.replace(".", "_"), *([owner] if "." in owner else [])]
        if key.startswith("mesh."):  # whose faults are those of the mesh that was made with it
            names += MESHES
        is_clear = told.returncode == 1 and "expected" in lines[0] and any(name in lines[0] for name in names)
        return [] if is_clear else [f"not clear: {lines}"]
    if not (folder / "history.csv").exists():
        return [f"refused, but wrote {sorted(path.name for path in folder.iterdir())}: {lines}"]
    faults = [*faults_of_tables(folder), *faults_of_frames(folder)]
    if told.returncode == 0 and re.search("tolerance|threshold|rtol", key):
        faults += changes(folder, usual)
    return faults


def main():
    program, parts = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:]
    options = declared(program)
    faults, jobs, tried = [], [], set()
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        decks = sorted(DECKS.glob("*.yaml"))
        for deck in sorted(decks, key=lambda deck: [deck.stem != name for name in FIRST]):
            usual = work / deck.stem
            told = run([program, deck, "-output_directory", usual, "-fp_trap"])
            faults += [f"{deck.stem}: {fault}" for fault in faults_of(told, usual, "", usual)]
            if told.returncode != 0:
                continue
            tree = yaml.safe_load((usual / "options.yaml").read_text(encoding="utf-8"))
            for key, name, value in acting(tree, options):
                if name in tried or (deck.stem == "flat" and not key.startswith("mesh.")):
                    continue
                tried.add(name)
                if not parts or any(part in key for part in parts):
                    jobs += [(deck, usual, key, word) for word in odd_values(*options[name], value)]

        def try_one(number_and_job):
            number, (deck, usual, key, word) = number_and_job
            place = work / str(number)
            steps = [] if key == "time.max_steps" else ["-time_max_steps", "2"]
            given = ["-" + key.replace(".", "_"), word]
            told = run([program, deck, "-output_directory", place, *steps, *given])
            return [f"{deck.stem}.yaml {' '.join(given)}: {fault}" for fault in faults_of(told, place, key, usual)]

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for found in pool.map(try_one, enumerate(jobs)):
                for fault in found:
                    print("FAULT:", fault, flush=True)
                faults += found
    faults += [f"{name}: acts in no deck of {DECKS}" for name in sorted(options.keys() - tried)]
    print("\n".join(["", *faults, f"{len(tried)} options, {len(jobs)} values, {len(faults)} faults"]))
    sys.exit(1 if faults else 0)


main()
