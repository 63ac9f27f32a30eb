"""That cpack makes a Debian package that works: check_package.py SOURCE_FOLDER BUILD_FOLDER WORK_FOLDER MPIEXEC

The package is installed below WORK_FOLDER/root by dpkg, with a copy there of this machine's list of installed packages,
so that dpkg refuses it where this machine lacks a dependency; the list itself is only read. Program and decks are run
from there with the machine's libraries. Exit code 77 where a tool is missing.
"""

import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys

SOURCE, BUILD, WORK = (pathlib.Path(folder).resolve() for folder in sys.argv[1:4])
MPIEXEC = sys.argv[4]
ROOT = WORK / "root"
SHARE = ROOT / "usr" / "share"
DEPENDENCIES = ("openmpi-bin", "libpetsc", "libvtk9", "libhdf5-openmpi", "libopenmpi", "libmetis", "libyaml-cpp",
                "libfmt", "libpng", "zlib1g", "libc6")
# Completes the last of the words that follow by the function of the installed file.
COMPLETE = 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _pellicle; printf "%s\\n" "${COMPREPLY[@]}"'


def run(*words, **more):
    told = subprocess.run([str(word) for word in words], cwd=WORK, stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, check=False, **more)
    if told.returncode != 0:
        sys.exit(f"{' '.join(str(word) for word in words)}: ended with {told.returncode}:\n{told.stdout}{told.stderr}")
    return told.stdout


def check(is_true, fault):
    if not is_true:
        sys.exit(f"check_package: {fault}")


def as_root():
    """What a command begins with to be root, or to seem so; exits where there is no way."""
    if os.geteuid() == 0:
        return []
    words = ["unshare", "--map-root-user"]
    if shutil.which("unshare") is None or subprocess.run([*words, "true"], check=False).returncode != 0:
        skip("neither root nor unshare --map-root-user")
    return words


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def make_database(root):
    """An empty database of dpkg below a folder."""
    for name in ("info", "updates", "triggers"):
        (root / "var/lib/dpkg" / name).mkdir(parents=True)
    (root / "var/lib/dpkg/status").touch()


def check_dependencies(package, dpkg):
    """The libraries of the program are declared, and without them dpkg does not set the package up."""
    names = [part.split()[0] for part in run("dpkg-deb", "--field", package, "Depends").split(",")]
    for expected in DEPENDENCIES:
        check(any(name.startswith(expected) for name in names), f"{expected} is not among the dependencies {names}")
    for name in names:
        status = run("dpkg-query", "--show", "--showformat", "${db:Status-Status}", name)
        check(status == "installed", f"{name}: {status}, expected a package that is installed on this machine")
    make_database(WORK / "bare")
    told = subprocess.run([*dpkg, f"--root={WORK / 'bare'}", "--install", package], capture_output=True, text=True,
                          check=False)
    check(told.returncode != 0 and "libpetsc" in told.stderr, f"installed without its dependencies: {told}")


def check_decks():
    """Every file that a deck names is there, relative to it."""
    named = 0
    for deck in sorted((SHARE / "pellicle/input").glob("*.yaml")):
        for name in re.findall(r"\w*(?:file|texture): ([\w./]+\.\w+)", deck.read_text(encoding="utf-8")):
            named += 1
            check((deck.parent / name).is_file(), f"{deck}: {name} is not installed")
    check(named > 10, f"{named} files in decks, expected more")


def check_scripts():
    """What the installed scripts import of ours is installed, and they start."""
    folder = SHARE / "pellicle/postproc"
    ours = {path.stem for path in (SOURCE / "postproc").glob("*.py")}
    for script in sorted(folder.glob("*.py")):
        for name in re.findall(r"^\s*(?:import|from) (\w+)", script.read_text(encoding="utf-8"), re.MULTILINE):
            check(name not in ours or (folder / f"{name}.py").is_file(), f"{script}: {name} is not installed")
    for name in ("compare", "ensemble", "export", "folds", "plots", "render"):
        run("/usr/bin/python3", folder / f"{name}.py", "--help", env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})


def complete(*words):
    return run("bash", "-c", COMPLETE, SHARE / "bash-completion/completions/pellicle", "pellicle", *words).splitlines()


def check_manual(names, version):
    """Man page and completion are found, and know every option of the program's own table."""
    page = run("man", "-M", SHARE / "man", "-w", "pellicle").strip()
    check(page == str(SHARE / "man/man1/pellicle.1.gz"), f"man finds {page}")
    told = subprocess.run(["man", "--warnings", "-l", page], capture_output=True, text=True, check=False,
                          env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "1000"})
    check(told.returncode == 0 and not told.stderr, f"man: {told.stderr}")
    check(f"pellicle {version}" in told.stdout, f"man: no version {version}")
    described = set(re.findall(r"^ +(-\w+)", told.stdout, re.MULTILINE))
    check(names <= described, f"not in the man page: {names - described}")

    completed = set(complete("-"))
    check(names <= completed, f"not completed: {names - completed}")
    (WORK / "a_folder").mkdir()
    for name in ("a.yaml", "a.yml", "a.txt"):
        (WORK / name).touch()
    for words, expected in ((("-heat_capa",), {"-heat_capacity"}), (("-chain", ""), {"burn", "inflate"}),
                            (("-bodies_ball_sh",), {"-bodies_ball_shape"}),
                            (("-bodies_ball_shape", "cap"), {"capsule"}),
                            (("a",), {"a.yaml", "a.yml", "a_folder"}), (("-mesh_file", "a.t"), {"a.txt"})):
        found = set(complete(*words))
        check(found == expected, f"{words}: completed to {found}, expected {expected}")


def main():
    for tool in ("dpkg", "dpkg-shlibdeps", "dpkg-parsechangelog", "file", "man"):
        if shutil.which(tool) is None:
            skip(f"{tool} is not installed")
    # Man pages also where this machine leaves them out.
    dpkg = [*as_root(), "dpkg", "--path-include=/usr/share/*", f"--log={WORK / 'dpkg.log'}"]
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    run("cpack", "--config", BUILD / "CPackConfig.cmake", "-G", "DEB", "-B", WORK / "made")
    package = next((WORK / "made").glob("pellicle_*.deb"))
    check_dependencies(package, dpkg)

    make_database(ROOT)
    shutil.copyfile("/var/lib/dpkg/status", ROOT / "var/lib/dpkg/status")
    run(*dpkg, f"--root={ROOT}", "--install", package)
    program = ROOT / "usr/bin/pellicle"
    version = run("dpkg-deb", "--field", package, "Version").strip()
    check(run(program, "-version").startswith(f"pellicle {version} "), "the program is of another version")
    check(f"\n## {version} " in (SOURCE / "docs/CHANGELOG.md").read_text(encoding="utf-8"), f"no changes of {version}")
    for name in ("usr/share/doc/pellicle/copyright", "usr/share/doc/pellicle/changelog.gz",
                 "usr/include/pellicle/world/world.h", "usr/lib/cmake/pellicle/pellicleConfig.cmake"):
        check((ROOT / name).is_file(), f"{name} is not installed")
    changes = WORK / "changelog"
    changes.write_bytes(gzip.decompress((SHARE / "doc/pellicle/changelog.gz").read_bytes()))
    told = run("dpkg-parsechangelog", "-l", changes, "--show-field", "Version").strip()
    check(told == version, f"the changelog is of version {told}, expected {version}")
    check_decks()
    check_scripts()
    check_manual(set(re.findall(r"^\| `[^`]+` \| `(-\w+)`", run(program, "-options_table"), re.MULTILINE)), version)
    for deck in ("hot_ball", "curtain"):  # with a texture, and with a mesh from a file
        run(MPIEXEC, "-n", "2", program, SHARE / f"pellicle/input/{deck}.yaml", "-time_max_steps", "2")
        history = (WORK / f"output/{deck}/history.csv").read_text(encoding="utf-8").splitlines()
        check(len(history) == 4, f"{deck}: {len(history)} lines in history.csv, expected 4: heading, start, two steps")

    run(*dpkg, f"--root={ROOT}", "--purge", "pellicle")
    left = [path for path in ROOT.rglob("*") if path.is_file() and "var" not in path.relative_to(ROOT).parts]
    check(not left, f"left after removal: {left}")
    print(f"{package.name}: installed, run and removed")


main()
