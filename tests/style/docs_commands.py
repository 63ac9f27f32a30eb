"""That the commands of README.md and docs/ do what they should: docs_commands.py SOURCE_FOLDER BUILD_FOLDER

In a folder of its own, in which the sources and the build lie as in a clone, it runs every block of sh, two steps a run
unless the command says otherwise, and looks up every column and field that comes out in docs/output.md. It runs the
batch job, a block of bash, with a stand-in for SLURM that sends the signal. It applies every diff to a copy of the
sources and compiles what they touch. Prints every fault and ends with 1 if there is one.
"""

import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile

import pages

# Options that a command of its own does not give, read between its decks and its command line.
SHORT_RUNS = "-time_max_steps 2"
SHORT_JOB = "-mesh_cells 20,20 -time_end 0.5 -output_interval_time 1 -checkpoint_keep 1"
# In place of srun: as SLURM, it sends SIGUSR1 when the time is up, here when the first part has written some rows.
SRUN = """#!/bin/bash
mpirun -n 2 "$@" </dev/null &
job=$!
if [[ " $* " != *" -restart "* ]]; then
  for ((i = 0; i < 600; ++i)); do
    [[ -f output/hot_ball/history.csv && $(wc -l <output/hot_ball/history.csv) -gt 3 ]] && break
    sleep 0.05
  done
  kill -USR1 $job
fi
while true; do
  wait $job
  status=$?
  kill -0 $job 2>/dev/null || exit $status
done
"""
SCONTROL = """#!/bin/bash
echo "$*" >scontrol.txt
"""


def make_clone(source, build, folder):
    """A folder in which commands find everything as in a clone, and write nothing into the sources."""
    for name in ("input", "meshes", "postproc", "tools", "tests", "README.md"):
        (folder / name).symlink_to(source / name)
    (folder / "build").mkdir()
    (folder / "build" / "release").symlink_to(build)


def run(command, folder, **environment):
    return subprocess.run(["bash", "-c", command], cwd=folder, env={**os.environ, **environment}, text=True,
                          check=False, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def faults_of_runs(book, folder):
    for block in book.blocks:
        if block.language == "yaml" and block.file_name():
            (folder / block.file_name()).write_text(block.text, encoding="utf-8")
    for block in book.blocks:
        if block.language == "sh":
            for words in block.commands():
                told = run(shlex.join(words), folder, PETSC_OPTIONS=SHORT_RUNS)
                if told.returncode != 0:
                    yield f"{block.where()}: {shlex.join(words)}: ended with {told.returncode}: {told.stdout[-400:]}"


def faults_of_files(book, folder):
    """What the runs have written is what docs/output.md says."""
    found = set()
    for table in sorted(folder.glob("output/*/*.csv")):
        with table.open(encoding="utf-8") as lines:
            for column in next(lines).strip().split(","):
                name, _, unit = column.rstrip("]").partition(" [")
                found.add((name, unit))
    for frame in sorted(folder.glob("output/*/*.pvtp")):
        text = frame.read_text(encoding="utf-8", errors="replace")
        for arrays in re.findall(r"<P(?:Point|Cell)Data.*?</P(?:Point|Cell)Data>", text, re.DOTALL):
            found.update((name, None) for name in re.findall(r'Name="(\w+)"', arrays) if name != "vtkGhostType")
    expected = {"mass_left", "gas_pressure", "temperature", "stress", "self_contacts", "through_tube"}
    if not expected <= {name for name, _ in found}:
        yield "docs: the runs have written too few tables and fields to look up"
    for name, unit in sorted(found, key=str):
        fault = book.unit_fault(name, unit)
        if fault:
            yield fault


def faults_of_job(block, folder):
    (folder / "job.sh").write_text(block.text, encoding="utf-8")
    shutil.rmtree(folder / "output" / "hot_ball", ignore_errors=True)
    stand_ins = folder / "stand_ins"
    stand_ins.mkdir(exist_ok=True)
    for name, text in (("srun", SRUN), ("scontrol", SCONTROL)):
        (stand_ins / name).write_text(text, encoding="utf-8")
        (stand_ins / name).chmod(0o755)
    asked = folder / "scontrol.txt"
    ends = []
    for _ in range(2):
        asked.unlink(missing_ok=True)
        told = run("bash job.sh", folder, PETSC_OPTIONS=SHORT_JOB, SLURM_JOB_ID="17",
                   PATH=f"{stand_ins}:{os.environ['PATH']}")
        last = (folder / "output" / "hot_ball" / "history.csv").read_text(encoding="utf-8").splitlines()[-1]
        ends.append((told.returncode, asked.read_text(encoding="utf-8").strip() if asked.exists() else "",
                     abs(float(last.split(",")[0]) - 0.5) < 1e-9))
    if ends != [(128 + signal.SIGUSR1, "requeue 17", False), (0, "", True)]:
        yield f"{block.where()}: parts of the job: exit code, requeued, at its end: {ends}: {told.stdout[-400:]}"


def faults_of_changes(book, source, build, folder):
    """All diffs together, applied to a copy of the sources, compile."""
    copy = folder / "changed"
    shutil.copytree(source / "src", copy / "src")
    changes = [block for block in book.blocks if block.language == "diff"]
    for block in changes:
        told = subprocess.run(["git", "apply", "-C1", "-"], input=block.text, cwd=copy, text=True, check=False,
                              env={**os.environ, "GIT_CEILING_DIRECTORIES": str(folder)}, stderr=subprocess.PIPE)
        if told.returncode != 0:
            yield f"{block.where()}: does not apply: {told.stderr}"
    entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    entry = next(entry for entry in entries if "pellicle_world.dir" in entry["command"])
    words = shlex.split(entry["command"])
    del words[words.index("-o"):]
    words = [f"-I{copy / 'src'}" if word == f"-I{source / 'src'}" else word for word in words]
    touched = sorted({name for block in changes
                      for name in re.findall(r"^\+\+\+ b/(\S+\.cpp)$", block.text, re.MULTILINE)})

    def compiled(name):
        return subprocess.run([*words, "-Werror=switch", "-fsyntax-only", copy / name], cwd=entry["directory"],
                              capture_output=True, text=True, check=False)

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for name, told in zip(touched, pool.map(compiled, touched)):
            if told.returncode != 0:
                yield f"docs: the changed {name} does not compile: {told.stderr[:600]}"


def main():
    source, build = (pathlib.Path(folder).resolve() for folder in sys.argv[1:3])
    book = pages.Book(source)
    faults = []
    with tempfile.TemporaryDirectory(prefix="pellicle_docs_") as name:
        folder = pathlib.Path(name)
        make_clone(source, build, folder)
        faults += faults_of_runs(book, folder)
        faults += faults_of_files(book, folder)
        for block in book.blocks:
            if block.language == "bash":
                faults += faults_of_job(block, folder)
        faults += faults_of_changes(book, source, build, folder)
    for fault in faults:
        print(fault)
    print(f"{len(book.blocks)} blocks, {len(faults)} faults")
    sys.exit(1 if faults else 0)


main()
