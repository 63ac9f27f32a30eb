"""Shows a burning sheet in ParaView, coloured by temperature [K]: a macro, or a script for pvbatch.

As a macro (Macros > Import new macro): open the .pvd of a run, Apply, start the macro. By pvbatch

  tools/pvbatch postproc/paraview/burning_sheet.py RUN.pvd FILE ...

it writes pictures of the last frame (.png), or states for ParaView (.pvsm). Bodies of the run, in RUN_bodies.pvd, are grey.
"""

import os
import sys

from paraview.simple import (ColorBy, GetActiveSource, GetActiveViewOrCreate, GetAnimationScene, GetColorTransferFunction,
                             GetScalarBar, OpenDataFile, ResetCamera, SaveScreenshot, SaveState, Show)

FIELD, TITLE, FORMAT, COLOURS = ("POINTS", "temperature"), "Temperature [K]", "%.0f", "Plasma (matplotlib)"


def main(arguments):
    if arguments and not os.path.isfile(arguments[0]):
        sys.exit(f"{arguments[0]}: no such file; expected the .pvd of a run")
    run = OpenDataFile(arguments[0]) if arguments else GetActiveSource()
    if run is None or not hasattr(run, "FileName"):
        sys.exit("expected the .pvd of a run, opened and selected in ParaView, or as an argument")
    view = GetActiveViewOrCreate("RenderView")
    view.UseColorPaletteForBackground, view.Background = 0, (1, 1, 1)
    scene = GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.GoToLast()

    surface = Show(run, view)
    surface.Ambient, surface.Diffuse = 0.35, 0.75
    ColorBy(surface, FIELD)
    colours = GetColorTransferFunction(FIELD[1])
    colours.ApplyPreset(COLOURS, True)
    colours.AutomaticRescaleRangeMode = "Clamp and update every timestep"  # also where a state opens another run
    surface.RescaleTransferFunctionToDataRangeOverTime()
    legend = GetScalarBar(colours, view)
    legend.Title, legend.ComponentTitle = TITLE, ""
    legend.AutomaticLabelFormat, legend.LabelFormat, legend.RangeLabelFormat = 0, FORMAT, FORMAT
    legend.HorizontalTitle, legend.TitleFontSize, legend.LabelFontSize = 1, 13, 13
    legend.TitleColor = legend.LabelColor = (0, 0, 0)
    surface.SetScalarBarVisibility(view, True)
    view.CameraFocalPoint, view.CameraPosition, view.CameraViewUp = (0, 0, 0), (0.35, -0.85, 0.75), (0, 0, 1)
    ResetCamera(view)

    bodies = os.path.splitext(str(run.FileName))[0] + "_bodies.pvd"
    if os.path.isfile(bodies):
        grey = Show(OpenDataFile(bodies), view)
        grey.ColorArrayName = [None, ""]
        grey.DiffuseColor = grey.AmbientColor = (0.6, 0.6, 0.6)
    for file in arguments[1:]:
        if file.endswith(".pvsm"):
            SaveState(file)
        else:
            SaveScreenshot(file, view, ImageResolution=(800, 600))


main(sys.argv[1:])
