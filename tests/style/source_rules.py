"""The rules that src/ and tests/ keep, checked by ctest (label style): source_rules.py SOURCE_FOLDER

Who may include whom, names of files, namespaces, and where a test lies. Prints every fault as file:line: text.
"""

import pathlib
import re
import sys

# The folders of src/ that each may include, and itself: the table of the design.
FLOOR = {"base", "options", "geometry", "parallel", "surface"}  # of what acts on sheets and membranes
MAY_INCLUDE = {
    "base": set(),
    "geometry": set(),
    "parallel": {"base"},
    "options": {"base"},
    "linear": {"base", "options", "geometry", "parallel"},
    "energies": {"base", "options", "geometry", "parallel", "linear"},
    "meshing": {"base", "options", "geometry"},
    "surface": FLOOR | {"meshing"},
    "state": FLOOR,
    "io": FLOOR | {"state"},
    "heat": FLOOR | {"linear", "energies"},
    "combustion": FLOOR,
    "ablation": FLOOR | {"heat"},
    "projection": FLOOR | {"linear", "energies"},
    "prism": FLOOR | {"linear", "energies"},
    "elastic": FLOOR | {"linear", "energies"},
    "gas": FLOOR,
    "air": FLOOR | {"linear", "energies"},
    "contact": FLOOR | {"meshing", "linear", "energies"},
    "constraints": FLOOR | {"linear", "energies"},
    "equilibrium": FLOOR | {"linear", "energies", "prism", "gas", "constraints", "contact"},
    "world": FLOOR | {"meshing", "linear", "energies", "state", "io", "air", "heat", "combustion", "ablation",
                      "projection", "prism", "elastic", "gas", "contact", "constraints", "equilibrium"},
    "run": FLOOR | {"meshing", "linear", "state", "io", "world", "ablation", "heat", "contact"},
    # Of the program alone, no library:
    "main.cpp": {"run", "world", "base", "options", "io", "large_pages.h"},
    "large_pages.h": set(),
    "large_pages.cpp": {"large_pages.h"},
}
GENERATED = {"revision_text.h"}
FOR_ALL = {"base/namespaces.h"}  # It names every folder.
# These mirror none of src/.
OWN_TESTS = {"program", "allocations", "external", "fuzz", "reference", "style", "benchmark", "support", "postproc"}
INCLUDE = re.compile(r'\s*#\s*include\s*([<"])([^>"]+)[>"]')


def faults_of_source(src, path):
    folder = path.relative_to(src).parts[0]
    lines = path.read_text(encoding="utf-8").splitlines()
    if folder not in MAY_INCLUDE:
        yield 1, f"src/{folder} is not in the table of who may include whom"
        return
    allowed = MAY_INCLUDE[folder] | {folder}
    for number, line in enumerate(lines, 1):
        include = INCLUDE.match(line)
        if not include:
            continue
        bracket, name = include.groups()
        if bracket == '"' and name not in GENERATED:
            if not (src / name).is_file():
                yield number, f'"{name}" is not a file of src/; expected a path relative to src/'
            elif name.split("/")[0] not in allowed and name not in FOR_ALL:
                yield number, f"{folder} may not include {name}; allowed: {', '.join(sorted(allowed))}"
        if bracket == "<" and folder == "geometry" and re.match(r"petsc|mpi\.h|vtk", name):
            yield number, f"geometry may not include {name}: it knows neither PETSc nor MPI"
    if path.suffix == ".h" and (not lines or lines[0] != "#pragma once"):
        yield 1, "a header begins with #pragma once"
    room = "pellicle" if path.parent == src or path.name == "namespaces.h" else f"pellicle::{folder}"
    if path.name != "main.cpp" and f"namespace {room} {{" not in lines:
        yield 1, f"no namespace {room}"


def faults_of_any(path):
    if not re.fullmatch(r"[a-z][a-z0-9_]*\.(cpp|h|py|txt|cmake)|CMakeLists\.txt", path.name):
        yield 1, f"{path.name}: a file's name is snake_case"
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if line != line.rstrip():
            yield number, "blanks at the end of the line"
        if len(line) > 120 and path.suffix in {".cpp", ".h", ".py"}:
            yield number, f"{len(line)} columns; at most 120"
        if (test := re.match(r"TEST(?:_[FP])?\(\w+, (\w+)", line)) and ("_" in test[1] or test[1][0].islower()):
            yield number, f"{test[1]}: a test's name is in PascalCase"
        if "../shared" in line and path.suffix in {".cpp", ".h"} and "tests" not in path.parts:
            yield number, "src/ may not know ../shared"


def main():
    root = pathlib.Path(sys.argv[1])
    src, tests = root / "src", root / "tests"
    faults = []
    count = 0
    files = (path for folder in (src, tests) for path in folder.rglob("*"))
    for path in sorted(path for path in files if path.suffix in {".cpp", ".h", ".py", ".txt"}):
        count += 1
        faults += [(path, *fault) for fault in faults_of_any(path)]
        if src in path.parents:
            faults += [(path, *fault) for fault in faults_of_source(src, path)]
    for folder in sorted(p for p in tests.iterdir() if p.is_dir() and p.name != "__pycache__"):
        if folder.name not in OWN_TESTS and not (src / folder.name).is_dir():
            faults.append((folder, 1, f"tests/ mirrors src/, where there is no {folder.name}"))
    for path, number, text in faults:
        print(f"{path.relative_to(root)}:{number}: {text}")
    print(f"{count} files, {len(faults)} faults")
    sys.exit(1 if faults else 0)


main()
