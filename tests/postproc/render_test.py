"""That pictures and films show their runs: render_test.py SOURCE_FOLDER MPIEXEC PROGRAM"""

import json
import pathlib
import shutil
import sys
import tempfile

import numpy
import vtk
from tiny_run import Faults, run, tiny_run
from vtk.util.numpy_support import vtk_to_numpy


def pixels(path):
    """(height, width, 3), from 0 to 1, the first row at the top."""
    reader = vtk.vtkPNGReader()
    reader.SetFileName(str(path))
    reader.Update()
    picture = reader.GetOutput()
    width, height, _ = picture.GetDimensions()
    return vtk_to_numpy(picture.GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3] / 255


def is_rubber(picture):
    red, green, blue = numpy.moveaxis(picture, 2, 0)
    return (red > 1.4 * green) & (blue > 0.6 * green) & (red > 0.3)


def check_views(faults, source, pvd, folder):
    """What ParaView's macros and states of postproc/paraview make of the run: the field's colours, and a legend."""
    told = run([f"{source}/tools/pvbatch", f"{source}/tests/postproc/paraview_views.py", source, pvd, folder])
    faults.unless(told.returncode == 0 and not told.stderr, f"paraview_views.py: {told}")
    views = [json.loads(line) for line in told.stdout.splitlines()]
    faults.unless(len(views) == 4, f"{len(views)} views of ParaView, expected 4")
    for view in views:
        faults.unless(str(pvd) in view["runs"], f"another run is shown: {view}")
        low, high = view["range"]
        hot = view["field"] == "temperature"
        is_right = 299 < low < 301 and 900 < high < 1200 if hot else 1.7e-4 < low < high < 3.01e-4
        faults.unless(is_right, f"colours: {view}")
        faults.unless(view["legend"] == ("Temperature [K]" if hot else "Thickness [m]"), f"legend: {view}")
        picture = pixels(view["picture"])
        coloured = (picture.max(axis=2) - picture.min(axis=2) > 0.2)[:, :200]  # left of the legend
        # The camera of a state is that of the run it was saved from, in which the balloon of this one is not.
        if hot or view["file"].endswith(".py"):
            faults.unless(coloured.sum() > 100, f"{coloured.sum()} coloured pixels: {view}")


def main():
    source, mpiexec, program = sys.argv[1:]
    pvbatch = f"{source}/tools/pvbatch"
    modules = run([pvbatch, "--modules"])
    if modules.returncode != 0 or not pathlib.Path(modules.stdout.strip()).is_dir():
        print("no ParaView here (tools/setup): pictures are not tested")
        return
    faults = Faults()
    with tempfile.TemporaryDirectory() as folder:
        out = tiny_run(mpiexec, program, folder)

        def render(*options):
            told = run([pvbatch, f"{source}/postproc/render.py", out, *options])
            faults.unless(told.returncode == 0 and not told.stderr, f"{options}: {told}")
            return [pathlib.Path(line) for line in told.stdout.splitlines()]

        def names(paths):
            return [path.name for path in paths]

        first, last = render("--frames", "2", "--size", "200x150")
        faults.unless(names((first, last)) == ["tiny_0000.png", "tiny_0004.png"], f"{first} {last}")
        picture = pixels(last)
        faults.unless(picture.shape == (150, 200, 3), f"a picture of {picture.shape}")
        red = picture[..., 0]
        saturation = picture.max(axis=2) - picture.min(axis=2)
        rubber, paper = is_rubber(picture), (saturation > 0.04) & (saturation < 0.3) & (red > 0.4)
        background = (abs(picture - (0.96, 0.96, 0.955)) < 0.01).all(axis=2)
        shade = (saturation < 0.03) & (red < 0.9) & (red > 0.3)
        for what, where, least in (("balloon", rubber, 0.005), ("paper", paper, 0.02), ("background", background, 0.3),
                                   ("shade on the ground", shade, 0.005)):
            faults.unless(where.mean() > least, f"{what}: {where.mean():.4f} of the picture")
        # The run fills the picture, but nothing leaves it.
        (top, left), (bottom, right) = (end(numpy.argwhere(rubber | paper), axis=0) for end in (numpy.min, numpy.max))
        faults.unless(2 < left < right < 197 and 2 < top < bottom < 147 and right - left > 120,
                      f"framing: columns {left} to {right}, rows {top} to {bottom}")
        dark = (picture.max(axis=2) < 0.15).mean()
        picture = pixels(render("--frames", "1", "--size", "200x150", "--no-ground", "--texture",
                                f"{source}/input/textures/halves.png")[0])
        faults.unless((picture.max(axis=2) < 0.15).mean() > dark + 0.02, "no black half of the texture")
        picture = pixels(render(out, "--frames", "1", "--size", "200x150", "--dark", "--edges", "--field",
                                "temperature")[0])
        faults.unless(picture.shape == (150, 400, 3), f"two runs make a picture of {picture.shape}")
        faults.unless(numpy.median(picture) < 0.1, "the night is not dark")
        cold = (picture[..., 2] > 3 * picture[..., 0]) & (picture[..., 2] > 0.1)
        faults.unless(cold.mean() > 0.01, "no cold blue in temperature")
        for legend in (picture[75:, 165:200], picture[75:, 365:]):
            faults.unless((legend.max(axis=2) - legend.min(axis=2) > 0.5).sum() > 100, "no legend")
        check_views(faults, source, out / "tiny.pvd", folder)
        if shutil.which("ffmpeg") is None:
            print("no ffmpeg here: films are not tested")
            faults.end()
        film = pathlib.Path(folder) / "tiny.mp4"
        render("--film", film, "--turntable", "--no-ground", "--size", "201x151")
        told = run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames",
                    "-of", "csv=p=0", film])
        faults.unless(told.stdout.strip() == "202,152,5", f"film: {told}")
        run(["ffmpeg", "-v", "error", "-i", film, f"{folder}/film_%d.png"])
        columns = [numpy.argwhere(is_rubber(pixels(f"{folder}/film_{frame}.png")))[:, 1].mean() for frame in (1, 3)]
        faults.unless(columns[0] > 110 and columns[1] < 90, f"the balloon does not go round: {columns}")
    faults.end()


main()
