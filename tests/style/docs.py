"""That README.md and docs/ agree with this repository: docs.py SOURCE_FOLDER

Links and anchors, scenes, names of files and options (also in comments of decks), columns and fields of the output,
blocks of yaml, cpp, diff and console, long lines; not what the blocks of sh do, which docs_commands.py runs. Prints
every fault as file:line: text.
"""

import pathlib
import sys

import pages


def main():
    root = pathlib.Path(sys.argv[1])
    book = pages.Book(root)
    faults = []
    for check in (book.faults_of_links, book.faults_of_scenes, book.faults_of_options, book.faults_of_output,
                  book.faults_of_paths, book.faults_of_decks, book.faults_of_blocks, book.faults_of_lines):
        faults += check()
    readme = (root / "README.md").read_text(encoding="utf-8").count("\n")
    if readme > 150:
        faults.append(f"README.md:{readme}: {readme} lines, expected at most 150")
    for fault in faults:
        print(fault)
    print(f"{len(book.pages)} pages, {len(faults)} faults")
    sys.exit(1 if faults else 0)


main()
