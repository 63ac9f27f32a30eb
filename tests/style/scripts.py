"""Every script says what it does by --help, and refuses bad arguments in one line: scripts.py SOURCE_FOLDER"""

import pathlib
import subprocess
import sys

BAD_ARGUMENTS = {
    "input/textures/make_textures.py": [["nowhere"]],
    "postproc/check_output.py": [["nowhere.pvd"], ["README.md"]],
    "postproc/compare.py": [["nowhere", "."], ["nowhere", "nowhere", "--tolerance", "-1"]],
    "postproc/elastic_plots.py": [["nowhere"], ["strip", "--program", "nowhere"]],
    "postproc/ensemble.py": [[], ["nowhere.yaml", "-project_pc_type", "icc,jacobi"], ["input/disc.yaml"],
                             ["input/disc.yaml", "-prism_pc_type", "lu,jacobi", "-program", "nowhere"],
                             ["input/disc.yaml", "-prism_pc_type", "lu,jacobi", "-np", "0"]],
    "postproc/export.py": [["nowhere", "--format", "ply"], ["."], [".", "--format", "usd"], [".", "--format", "png"],
                           [".", "--format", "ply", "--frames", "0"]],
    "postproc/folds.py": [["nowhere.pvd"], ["README.md"], [".", "--frame", "last"]],
    "postproc/plots.py": [["nowhere"], ["."], [".", "--panels", "luck"]],
    "postproc/render.py": [["nowhere"], [".", "--size", "12"], [".", "--frames", "0"], [".", "--view", "up"],
                             [".", "--heights", "0"], [".", "--film", "nowhere/film.mp4"], [".", "--range", "0", "1"],
                             [".", "--texture", "README.md"], [".", "--at", "soon"],
                             [".", "--at", "1", "--frames", "2"]],
    "postproc/stands_out.py": [["nowhere"], [".", "--rows", "0"]],
    "tools/bench": [["--peers", "nowhere"], ["--workloads", "w9"], ["--ranks", "0"], ["--measure", "luck"],
                    ["--springs", "7"]],
    "tools/check": [],
    "tools/demo": [["nowhere.yaml"], ["README.md"], ["a.yaml", "b.yaml"], ["--frames"]],
    "tools/docs": [["nowhere"], ["--fast"]],
    "tools/fuzz": [["soon"], ["2", "nowhere"]],
    "tools/manual": [[], ["nowhere"], ["man_page", "completion"]],
    "tools/gallery": [["nowhere"], ["--fast"]],
    "tools/mutate": [["no_such_word"], ["--count", "0"], ["--only", "0"], ["--only", "first"], ["--limit", "-1"]],
    "tools/pvbatch": [[], ["nowhere.py"]],
    "tools/setup": [["--fast"]],
    "tools/tidy": [["nowhere.cpp"]],
    "tools/verify": [["luck"], ["--jobs", "0"], ["--bounds", "-1"], ["--program", "nowhere"], ["--fast"]],
}


def run(root, script, arguments):
    python = ["/usr/bin/python3"] if script.endswith(".py") else []  # which has Debian's modules
    return subprocess.run([*python, root / script, *arguments], cwd=root, capture_output=True, text=True, check=False)


def main():
    root = pathlib.Path(sys.argv[1])
    files = (path for folder in ("tools", "postproc", "input") for path in (root / folder).rglob("*")
             if path.parent.name != "paraview")  # macros, which run in ParaView alone
    no_scripts = {"environment", "light.py", "materials.py", "mutants.py", "run_folder.py", "run_frames.py"}
    scripts = {str(path.relative_to(root)) for path in files
               if path.is_file() and path.suffix in {"", ".py"} and path.name not in no_scripts}
    faults = [f"{script}: not tried by this test" for script in sorted(scripts ^ BAD_ARGUMENTS.keys())]
    for script in sorted(scripts & BAD_ARGUMENTS.keys()):
        told = run(root, script, ["--help"])
        if told.returncode != 0 or told.stderr or len(told.stdout) < 40 or pathlib.Path(script).name not in told.stdout:
            faults.append(f"{script} --help: {told}")
        for arguments in BAD_ARGUMENTS[script]:
            told = run(root, script, arguments)
            if told.returncode == 0 or told.stdout or told.stderr.count("\n") != 1:
                faults.append(f"{script}: not refused in one line: {told}")
    for fault in faults:
        print(fault)
    sys.exit(1 if faults else 0)


main()
