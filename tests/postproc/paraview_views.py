"""Run by pvbatch: starts the macros and opens the states of postproc/paraview on a run, and draws what they show:
paraview_views.py SOURCE_FOLDER RUN.pvd PICTURES. Prints a line of JSON for each."""

import json
import pathlib
import runpy
import sys

from paraview import simple

SOURCE, RUN, PICTURES = pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3])
FIELDS = {"burning_sheet": "temperature", "balloon": "thickness"}


def opened(file):
    """Opens the run with a macro or a state."""
    if file.suffix == ".py":
        sys.argv = [str(file), RUN]
        runpy.run_path(str(file), run_name="__main__")
        return
    text = file.read_text(encoding="utf-8")
    begin = text.index('type="PVDReader" id="') + len('type="PVDReader" id="')
    number = text[begin:text.index('"', begin)]
    simple.LoadState(str(file), filenames=[{"name": "PVDReader1", "id": number, "FileName": RUN}])
    simple.GetAnimationScene().GoToLast()


for name, field in FIELDS.items():
    for end in (".py", ".pvsm"):
        simple.ResetSession()
        opened(SOURCE / "postproc" / "paraview" / (name + end))
        view = simple.GetActiveView()
        picture = PICTURES / f"{name}{end}.png"
        simple.SaveScreenshot(str(picture), view, ImageResolution=(300, 200))
        colours = simple.GetColorTransferFunction(field)
        print(json.dumps({"file": name + end, "field": field, "picture": str(picture),
                          "runs": [str(source.FileName) for source in simple.GetSources().values()
                                   if hasattr(source, "FileName")],
                          "range": [colours.RGBPoints[0], colours.RGBPoints[-4]],
                          "legend": simple.GetScalarBar(colours, view).Title}))
