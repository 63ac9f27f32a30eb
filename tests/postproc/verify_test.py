"""That the verification report compares, and fails where a bound is not kept.

verify_test.py SOURCE_FOLDER MPIEXEC PROGRAM
"""

import pathlib
import re
import sys
import tempfile

from tiny_run import Faults, run


def main():
    source, _, program = sys.argv[1:]
    faults = Faults()

    def verify(folder, *arguments):
        told = run([f"{source}/tools/verify", "--program", program, "--to", folder, *arguments])
        faults.unless(not told.stderr, f"{told}")
        return told, (pathlib.Path(folder) / "report.md").read_text(encoding="utf-8")

    with tempfile.TemporaryDirectory() as folder:
        told, report = verify(folder, "vessel", "adiabatic")
        faults.unless(told.returncode == 0 and told.stdout.endswith(f"{folder}/report.md\n"), f"{told}")
        faults.unless("2 cases, 0 faults" in report and "**no" not in report, report)
        # The vessel's errors halve with the step, and are not 0.
        orders = [float(order) for order in re.findall(r"^\|  \|  \| \d+ ms \|.*\| ([\d.]+) \|$", report, re.MULTILINE)]
        faults.unless(len(orders) == 4 and all(abs(order - 1) < 0.1 for order in orders), f"orders {orders}")
        for name in ("vessel.png", "adiabatic.png"):
            faults.unless((pathlib.Path(folder) / name).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n", f"{name}: no PNG")
        page = (pathlib.Path(folder) / "report.html").read_text(encoding="utf-8")
        faults.unless("<table>" in page and 'src="vessel.png"' in page, page[:1000])
    with tempfile.TemporaryDirectory() as folder:
        told, report = verify(folder, "vessel", "--bounds", "0.01")
        faults.unless(told.returncode == 1 and "bound" in told.stdout, f"a bound that is too narrow is kept: {told}")
        faults.unless("1 cases, 2 faults" in report and "**not kept**" in report, report)
    faults.end()


main()
