"""That solvers are compared as they ran: ensemble_test.py SOURCE_FOLDER MPIEXEC PROGRAM"""

import csv
import pathlib
import sys
import tempfile

import numpy
import vtk
from tiny_run import DECK, Faults, run
from vtk.util.numpy_support import vtk_to_numpy


def places(path):
    """{vertex_id: place} of a frame."""
    reader = vtk.vtkXMLPPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    ids = vtk_to_numpy(data.GetPointData().GetArray("vertex_id"))
    return dict(zip(ids.tolist(), vtk_to_numpy(data.GetPoints().GetData()).astype(float)))


def main():
    source, _, program = sys.argv[1:]
    faults = Faults()
    with tempfile.TemporaryDirectory() as folder:
        deck, out = pathlib.Path(folder) / "tiny.yaml", pathlib.Path(folder) / "out"
        deck.write_text(DECK, encoding="utf-8")
        told = run([sys.executable, f"{source}/postproc/ensemble.py", deck, "-objects_paper_dynamics", "projection",
                    "-objects_paper_project_pc_type", "icc,jacobi,luck", "-objects_paper_project_ksp_rtol", "1e-1,1e-6",
                    "-time_end", "0.05", "-force_gravity", "0,0,-9", "-np", "1", "-program", program, "-to", out])
        faults.unless(told.returncode == 0 and not told.stderr, f"{told}")
        with open(out / "table.csv", encoding="utf-8") as file:
            rows = {(row["-objects_paper_project_pc_type"], row["-objects_paper_project_ksp_rtol"]): row
                    for row in csv.DictReader(file)}
        expected = {(pc, rtol) for pc in ("icc", "jacobi", "luck") for rtol in ("1e-1", "1e-6")}
        faults.unless(rows.keys() == expected, f"runs of {sorted(rows)}")
        for (pc, rtol), row in rows.items():
            if pc == "luck":
                faults.unless(set(list(row.values())[2:]) == {"failed"}, f"{row}")
                continue
            run_out = out / f"{pc}_{rtol}"
            with open(run_out / "history_paper.csv", encoding="utf-8") as file:
                iterations = sum(float(line["projection_iterations"]) for line in csv.DictReader(file))
            faults.unless(float(row["linear iterations"]) == iterations > 0, f"{row}, expected {iterations} iterations")
            largest, lacking = 0.0, 0
            for path in sorted(run_out.glob("*.pvtp")):
                if "_bodies_" in path.name:
                    continue
                of_run, of_tight = places(path), places(out / "tight" / path.name)
                lacking += sum(number >= 0 for number in of_run.keys() ^ of_tight.keys())
                for number in of_run.keys() & of_tight.keys():
                    if number >= 0:
                        largest = max(largest, numpy.linalg.norm(of_run[number] - of_tight[number]))
            found = float(row["error [m]"]), int(row["vertices of one only"])
            faults.unless(abs(found[0] - largest) <= 1e-12 and found[1] == lacking,
                          f"{row}, expected an error of {largest}, {lacking} vertices of one only")
        for pc in ("icc", "jacobi"):
            coarse, fine = (float(rows[pc, rtol]["error [m]"]) for rtol in ("1e-1", "1e-6"))
            faults.unless(fine < coarse, f"{pc}: errors {coarse} of 1e-1, {fine} of 1e-6")
        for end in ("png", "svg"):
            faults.unless((out / f"table.{end}").stat().st_size > 1000, f"no table.{end}")
        faults.unless("failed: pellicle: " in told.stdout, f"why luck failed: {told.stdout}")
    faults.end()


main()
