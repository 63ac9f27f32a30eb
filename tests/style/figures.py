#!/usr/bin/env python3
"""That figures and pictures are not older than what they were made from.

figures.py SOURCE_FOLDER [--renew PAGE|SCENE ...]

A line "<!-- figures of input/a.yaml tools/b: 0123456789ab -->" in a page names the files from which the figures
below it come, with a digest of what these were like then. Likewise docs/pictures/gallery/sources.txt for the
pictures of docs/gallery.md, which tools/gallery keeps. Comments in decks and scripts do not count. Where a file has
changed, make the figures anew by the commands of the page, or see that they stay, then renew the digests of the
page, or of the scene.

A second comment, between the first and the table, says how figures are made, so that measure_figures.py can make them
again. It is YAML:

  <!-- measured by
  rows:
    (\\w+): pellicle input/\\1.yaml
    (\\w+), on (\\d) ranks: mpirun -n \\2 pellicle input/\\1.yaml
  figures:
    mean strain: 100 * mean_strain[-1] within 3 %
    at half the step: 100 * mean_strain[-1] within 0.1 with -time_step 1ms
  -->

The keys of rows are regular expressions, the first of which that matches the beginning of a row (its cells joined by
" | ", without backticks) gives the row's command. Rows that none matches are not measured. The keys of figures are
headings of columns; the value is an expression of Python (measure_figures.py says of what), how far it may be from the
first number of the cell, in per cent of that number or absolutely, and options that are added to the command.
"""

import argparse
import ast
import hashlib
import json
import pathlib
import re
import sys

import yaml

MARK = re.compile(r"^<!-- figures of ([^:]+): (\w+) -->$", re.MULTILINE)
SCENE = re.compile(r"^## `(\w+)`.*?^```console\n(.*?)^```", re.MULTILINE | re.DOTALL)
FILE_OF_A_DECK = re.compile(r"\w*(?:file|texture): ([\w./]+\.\w+)")
PAGES = ("README.md", "docs/*.md", "tests/benchmark/README.md", "postproc/plots/README.md")
PICTURES = "docs/pictures/gallery/sources.txt"
MEASURED = re.compile(r"^<!-- measured by\n(.*?)^-->\n+((?:^\|[^\n]*\n)+)", re.MULTILINE | re.DOTALL)
FIGURE = re.compile(r"(?P<expression>.+?) within (?P<tolerance>[\d.e-]+)(?P<per_cent> %)?(?: with (?P<options>.+))?")
NUMBER = re.compile(r"-?\d[\d,]*(?:\.\d+)?(?:e-?\d+)?")


def meaning(path):
    """What of a file counts: of decks and scripts not the comments."""
    content = path.read_bytes()
    if path.suffix == ".yaml":
        return json.dumps(yaml.safe_load(content), sort_keys=True, default=str).encode()
    if path.suffix == ".py" or content.startswith((b"#!/usr/bin/env python3", b"#!/usr/bin/python3")):
        return ast.dump(ast.parse(content)).encode()
    return content


def digest(root, names):
    total = hashlib.sha256()
    for name in names:
        total.update(meaning(root / name) if (root / name).is_file() else b"no such file")
    return total.hexdigest()[:12]


class Figure:
    """A number of a table: where it is, the command that makes it, the expression that it is of what comes out."""

    def __init__(self, where, command, told, cell):
        parts = FIGURE.fullmatch(told)
        if not parts:
            raise ValueError(f"{told}: expected EXPRESSION within NUMBER[ %][ with OPTIONS]")
        if not NUMBER.search(cell):
            raise ValueError(f"{where}: '{cell}': expected a number")
        self.where, self.expression = where, parts["expression"]
        self.command = command + (" " + parts["options"] if parts["options"] else "")
        self.printed = float(NUMBER.search(cell)[0].replace(",", ""))
        self.tolerance = float(parts["tolerance"]) * (abs(self.printed) / 100 if parts["per_cent"] else 1)


def measured_rows(page, text):
    """The figures of each row of the page's tables that can be measured. Throws ValueError for a comment that cannot be
    read or does not fit its table."""
    rows = []
    for found in MEASURED.finditer(text):
        told, line = yaml.safe_load(found[1]), text.count("\n", 0, found.start(2)) + 1
        lines = [[cell.strip() for cell in row.strip("|").split("|")] for row in found[2].splitlines()]
        headings, unused = lines[0], set(told["rows"])
        missing = told["figures"].keys() - set(headings)
        if missing:
            raise ValueError(f"{page}:{line}: no column {', '.join(sorted(missing))}")
        for number, cells in enumerate(lines[2:], line + 2):
            row = " | ".join(cells).replace("`", "")
            matches = ((pattern, re.match(pattern, row)) for pattern in told["rows"])
            pattern, match = next(((pattern, match) for pattern, match in matches if match), (None, None))
            if match:
                unused.discard(pattern)
                command = match.expand(told["rows"][pattern])
                rows.append([Figure(f"{page}:{number}: {row.split(' | ')[0]}: {heading}", command, figure,
                                    cells[headings.index(heading)])
                             for heading, figure in told["figures"].items() if cells[headings.index(heading)]])
        if unused:
            raise ValueError(f"{page}:{line}: no row begins with {', '.join(sorted(unused))}")
    return rows


def faults_of_readme(root):
    """The README's table of other programs repeats figures of docs/performance.md."""
    tables = {page: re.findall(r"^\|.*$", (root / page).read_text(encoding="utf-8").split("<!-- figures of", 1)[1],
                               re.MULTILINE) for page in ("README.md", "docs/performance.md")}
    known = {number for row in tables["docs/performance.md"] for number in NUMBER.findall(row)}
    for row in tables["README.md"]:
        for number in NUMBER.findall(row.split("|", 2)[2]):
            if number not in known:
                yield f"README.md:1: {number}, of '{row.split('|')[1].strip()}', is not in docs/performance.md"


def sources_of_scenes(root):
    """{scene: the decks of its commands, and the files that these name}"""
    sources = {}
    for scene, commands in SCENE.findall((root / "docs/gallery.md").read_text(encoding="utf-8")):
        decks = sorted(set(re.findall(r"input/\w+\.yaml", commands)))
        named = {(root / deck).parent.joinpath(name).resolve().relative_to(root).as_posix() for deck in decks
                 for name in FILE_OF_A_DECK.findall((root / deck).read_text(encoding="utf-8"))}
        sources[scene] = [*decks, *sorted(named)]
    return sources


def renew_scenes(root, scenes):
    """Notes what the decks of these scenes are like now, when their pictures have been made. Scenes that are not in the
    page any more are left out."""
    path, sources = root / PICTURES, sources_of_scenes(root)
    known = dict(line.split() for line in path.read_text(encoding="utf-8").splitlines()) if path.is_file() else {}
    known.update((scene, digest(root, sources[scene])) for scene in scenes)
    lines = [f"{scene} {known[scene]}\n" for scene in sorted(known.keys() & sources.keys())]
    path.write_text("".join(lines), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--renew", nargs="+", default=[], metavar="PAGE|SCENE")
    options = parser.parse_args()
    root, faults, marks, rows = options.root.resolve(), [], 0, 0
    sources = sources_of_scenes(root)
    renew_scenes(root, [name for name in options.renew if name in sources])
    for path in sorted(path for pattern in PAGES for path in root.glob(pattern)):
        page, text = path.relative_to(root).as_posix(), path.read_text(encoding="utf-8")
        if page in options.renew:
            text = MARK.sub(lambda mark: f"<!-- figures of {mark[1]}: {digest(root, mark[1].split())} -->", text)
            path.write_text(text, encoding="utf-8")
        for mark in MARK.finditer(text):
            marks += 1
            line = text.count("\n", 0, mark.start()) + 1
            missing = [name for name in mark[1].split() if not (root / name).is_file()]
            faults += [f"{page}:{line}: {name}: no such file" for name in missing]
            if mark[2] != digest(root, mark[1].split()):
                faults.append(f"{page}:{line}: the figures below are older than one of {mark[1]} (figures.py --help)")
        try:
            rows += len(measured_rows(page, text))
        except ValueError as fault:
            faults.append(f"{page}: {fault}")
    faults += faults_of_readme(root)
    known = dict(line.split() for line in (root / PICTURES).read_text(encoding="utf-8").splitlines())
    faults += [f"docs/gallery.md:1: the picture of {scene} is older than one of {' '.join(names)} (figures.py --help)"
               for scene, names in sources.items() if known.get(scene) != digest(root, names)]
    print(*faults, f"{marks} tables, {rows} rows that can be measured, {len(sources)} pictures, {len(faults)} faults",
          sep="\n")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
