"""That pictures and films show their runs: render_test.py SOURCE_FOLDER MPIEXEC PROGRAM"""

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
        red, green, _ = numpy.moveaxis(picture, 2, 0)
        saturation = picture.max(axis=2) - picture.min(axis=2)
        rubber, paper = (red > 1.4 * green) & (red > 0.3), (saturation > 0.04) & (saturation < 0.3) & (red > 0.4)
        background = (abs(picture - (0.96, 0.96, 0.955)) < 0.01).all(axis=2)
        shade = (saturation < 0.03) & (red < 0.9) & (red > 0.3)
        for what, where, least in (("balloon", rubber, 0.005), ("paper", paper, 0.02), ("background", background, 0.3),
                                   ("shade on the ground", shade, 0.005)):
            faults.unless(where.mean() > least, f"{what}: {where.mean():.4f} of the picture")
        # The run fills the picture, but nothing leaves it.
        (top, left), (bottom, right) = (end(numpy.argwhere(rubber | paper), axis=0) for end in (numpy.min, numpy.max))
        faults.unless(2 < left < right < 197 and 2 < top < bottom < 147 and right - left > 120,
                      f"framing: columns {left} to {right}, rows {top} to {bottom}")
        picture = pixels(render(out, "--frames", "1", "--size", "200x150", "--edges", "--field", "temperature")[0])
        faults.unless(picture.shape == (150, 400, 3), f"two runs make a picture of {picture.shape}")
        faults.unless(((picture[..., 2] > 0.3) & (picture[..., 0] < 0.3)).mean() > 0.01, "no cold blue in temperature")
        for legend in (picture[75:, 165:200], picture[75:, 365:]):
            faults.unless((legend.max(axis=2) - legend.min(axis=2) > 0.5).sum() > 100, "no legend")
        if shutil.which("ffmpeg") is None:
            print("no ffmpeg here: films are not tested")
            faults.end()
        film = pathlib.Path(folder) / "tiny.mp4"
        render("--film", film, "--turntable", "--dark", "--no-ground", "--size", "101x75")
        told = run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=width,height,nb_read_frames",
                    "-of", "csv=p=0", film])
        faults.unless(told.stdout.strip() == "102,76,5", f"film: {told}")
        run(["ffmpeg", "-v", "error", "-i", film, "-frames:v", "1", f"{folder}/night.png"])
        night = pixels(f"{folder}/night.png")
        faults.unless(numpy.median(night) < 0.1 and night.max() > 0.5, "at night the flame alone is bright")
    faults.end()


main()
