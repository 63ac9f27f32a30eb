"""Pictures of a run: tools/pvbatch postproc/render.py OUTPUT_FOLDER [options]

Opens the .pvd of the folder and writes a few frames as PNG beside it, of all objects of the run: NAME_0000.png and so on,
by number of the frame.
Bodies and balls of heat are drawn where they were, from NAME_bodies.pvd; planes as squares, from outside alone.
"""

import argparse
import math
import os
import sys
import xml.etree.ElementTree

import run_folder

DIRECTIONS = {  # from the sheet towards the camera
    "oblique": (0.35, -0.85, 0.75),
    "top": (0.0, -0.02, 1.0),
    "front": (0.0, -1.0, 0.12),
    "side": (1.0, -0.25, 0.3),
}
PAPER = (0.93, 0.89, 0.80)
RUBBER = (0.78, 0.06, 0.09)
# From stretched thin (0) to as thick as at first (1).
STRETCHED_TO_RUBBER = [0.0, 1.0, 0.62, 0.50, 0.35, 0.96, 0.36, 0.30, 0.7, 0.88, 0.15, 0.16, 1.0, *RUBBER]
# Share of the way from char (0) to paper (1), red, green, blue.
CHAR_TO_PAPER = [0.0, 0.20, 0.185, 0.18, 0.25, 0.27, 0.20, 0.16, 0.5, 0.46, 0.29, 0.16, 0.75, 0.74, 0.56, 0.36, 0.92,
                 0.91, 0.83, 0.69, 1.0, *PAPER]


def at_least_one(text):
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text}; expected a number, at least 1")
    return int(text)


def positive(text):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}; expected a number above 0")
    return value


def size(text):
    sides = text.split("x")
    if len(sides) != 2 or not all(side.isdecimal() and 0 < int(side) <= 16384 for side in sides):
        raise argparse.ArgumentTypeError(f"{text}; expected WIDTHxHEIGHT, each 1 to 16384")
    return [int(side) for side in sides]


def direction(text):
    if text in DIRECTIONS:
        return DIRECTIONS[text]
    try:
        components = [float(component) for component in text.split(",")]
    except ValueError:
        components = []
    if len(components) != 3 or not 0 < math.hypot(*components) < math.inf:
        raise argparse.ArgumentTypeError(f"{text}; expected {', '.join(DIRECTIONS)}, or X,Y,Z")
    return components


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--frames", type=at_least_one, default=5,
                        help="how many, spread evenly from the first to the last (5)")
    parser.add_argument("--field", help="colour by this point or cell field; default: mass_ratio of paper and "
                                        "thickness_ratio of balloons, where they vary")
    parser.add_argument("--range", type=float, nargs=2, help="of the colours; default: that of the field over all frames")
    parser.add_argument("--size", type=size, default=[1200, 900], metavar="SIZE", help="WIDTHxHEIGHT in pixels (1200x900)")
    parser.add_argument("--view", type=direction, default=DIRECTIONS["oblique"], metavar="VIEW",
                        help=f"{', '.join(DIRECTIONS)} or X,Y,Z towards the camera (oblique)")
    parser.add_argument("--zoom", type=positive, default=1.0, help="above 1: closer (1)")
    parser.add_argument("--heights", type=positive, default=1.0, metavar="FACTOR",
                        help="draw the surface so many times as high along z, shallow wrinkles (1)")
    parser.add_argument("--edges", action="store_true", help="draw the mesh too")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    if not os.path.isdir(options.folder):
        parser.error(f"{options.folder}: no such folder; expected that of a run")
    return options


# Before ParaView is loaded, which takes seconds.
OPTIONS = arguments()

try:
    from paraview import simple
except ImportError:
    sys.exit("render.py: no ParaView here; expected to be run by tools/pvbatch")


def open_run(folder):
    """Returns the name of the run, its reader, and a source for each of its objects."""
    path = run_folder.series(folder).get("")
    if path is None:
        sys.exit(f"render.py: {folder}: no .pvd of a run, or of several; expected the folder of one")
    reader = simple.PVDReader(FileName=path)
    objects = dict.fromkeys(entry.get("name") for entry in xml.etree.ElementTree.parse(path).iter("DataSet"))
    sources = [simple.ExtractBlock(Input=reader, Selectors=[f"/Root/{name}"]) if name else reader for name in objects]
    return os.path.basename(path)[:-4], reader, sources


def raised(source, factor):
    """The same surface, so many times as high along z."""
    transform = simple.Transform(Input=source)
    transform.Transform = "Transform"
    transform.Transform.Scale = [1, 1, factor]
    return transform


def chosen(times, count):
    """`count` of the frames' numbers, evenly spread, the first and the last among them."""
    last = len(times) - 1
    count = max(1, min(count, len(times)))
    return sorted({round(i * last / max(1, count - 1)) for i in range(count)})


def where(sheet, field):
    """Returns whether a field is one of the points or the cells, and its array; None, None if there is none."""
    for association, data in (("POINTS", sheet.PointData), ("CELLS", sheet.CellData)):
        if data.GetArray(field):
            return association, data.GetArray(field)
    return None, None


def survey(sheet, times, numbers, field):
    """Returns the bounds of the sheet and the range of `field` over the given frames; no range if there is no such field."""
    low, high = [math.inf] * 3, [-math.inf] * 3
    field_range = None
    for number in numbers:
        simple.UpdatePipeline(time=times[number], proxy=sheet)
        bounds = sheet.GetDataInformation().GetBounds()
        low = [min(low[i], bounds[2 * i]) for i in range(3)]
        high = [max(high[i], bounds[2 * i + 1]) for i in range(3)]
        _, array = where(sheet, field)
        if array:
            now = array.GetRange(-1 if array.GetNumberOfComponents() > 1 else 0)
            field_range = now if not field_range else (min(now[0], field_range[0]), max(now[1], field_range[1]))
    return low, high, field_range


def place_camera(view, low, high, direction, zoom):
    """Looks along `direction` at the middle of the box, from where all of it is just in sight."""
    length = math.sqrt(sum(c * c for c in direction))
    towards = [c / length for c in direction]
    right = (-towards[1], towards[0], 0.0)
    length = math.hypot(right[0], right[1]) or 1.0
    right = [c / length for c in right]
    up = [towards[1] * right[2] - towards[2] * right[1], towards[2] * right[0] - towards[0] * right[2],
          towards[0] * right[1] - towards[1] * right[0]]
    centre = [(low[i] + high[i]) / 2 for i in range(3)]
    view_angle = 25.0
    tangent_up = math.tan(math.radians(view_angle / 2))
    tangent_right = tangent_up * view.ViewSize[0] / view.ViewSize[1]
    distance = 0.0
    for corner in range(8):
        offset = [(high if corner >> i & 1 else low)[i] - centre[i] for i in range(3)]
        along, across, above = (sum(o * a for o, a in zip(offset, axis)) for axis in (towards, right, up))
        distance = max(distance, along + abs(across) / tangent_right, along + abs(above) / tangent_up)
    distance *= 1.06 / zoom
    view.CameraViewAngle = view_angle
    view.CameraFocalPoint = centre
    view.CameraPosition = [centre[i] + distance * towards[i] for i in range(3)]
    view.CameraViewUp = up
    return towards, right, up


def add_lights(view, towards, right, up):
    """A key light from the upper left that grazes the wrinkles, and a soft one from the lower right."""
    view.UseLight = 0
    for weights, intensity in (((-0.9, 0.5, 0.9), 0.8), ((0.7, -0.6, 0.9), 0.42)):
        light = simple.AddLight(view=view)
        light.Coords = "Scene"
        light.Type = "Directional"
        light.FocalPoint = view.CameraFocalPoint
        light.Position = [view.CameraFocalPoint[i] + weights[0] * right[i] + weights[1] * up[i] + weights[2] * towards[i]
                          for i in range(3)]
        light.Intensity = intensity


def body_sources(folder):
    """A source for each body and each ball of heat that the run has drawn."""
    path = run_folder.series(folder).get("_bodies")
    if path is None:
        return []
    reader = simple.PVDReader(FileName=path)
    names = dict.fromkeys(entry.get("name") for entry in xml.etree.ElementTree.parse(path).iter("DataSet"))
    if len(names) == 1:  # ParaView makes no blocks of one.
        return [(body, reader) for body in names]
    return [(body, simple.ExtractBlock(Input=reader, Selectors=[f"/Root/{body}"])) for body in names]


def show_body(name, source, view):
    """A body is dull and grey, a ball of heat a glow."""
    surface = simple.GenerateSurfaceNormals(Input=source, FeatureAngle=40)
    display = simple.Show(surface, view)
    display.ColorArrayName = ["POINTS", ""]
    display.DiffuseColor = display.AmbientColor = (1.0, 0.55, 0.2) if name.startswith("heat_") else (0.62, 0.67, 0.73)
    display.Ambient, display.Diffuse, display.Specular = 0.4, 0.7, 0.1
    display.BackfaceRepresentation = "Cull Backface"  # A plane seen from within its solid would hide what is before it.
    if name.startswith("heat_"):
        display.Opacity = 0.25


def show(source, view, field, field_range, is_balloon):
    """Shows an object, coloured by a field of its points or cells if a range is given."""
    # One point for each vertex, also where the pieces of two ranks meet, so that the shading is smooth.
    surface = simple.GenerateSurfaceNormals(Input=simple.Clean(Input=source),
                                            FeatureAngle=180, Splitting=0)
    association = where(source, field)[0]
    if association == "CELLS" and not OPTIONS.field:  # A balloon's colours are as smooth as its surface.
        surface = simple.CellDatatoPointData(Input=surface, CellDataArraytoprocess=[field])
        association = "POINTS"
    display = simple.Show(surface, view)
    display.Representation = "Surface With Edges" if OPTIONS.edges else "Surface"
    display.Interpolation = "Gouraud"
    # Paper is dull, rubber glossy; gloss would hide the colours of a field.
    glossy = is_balloon and not OPTIONS.field
    display.Ambient, display.Diffuse = (0.35, 0.75) if glossy else (0.12, 0.95)
    display.Specular, display.SpecularPower = (0.55, 45) if glossy else (0.07, 20)
    if not field_range:
        display.ColorArrayName = ["POINTS", ""]
        display.DiffuseColor = display.AmbientColor = RUBBER if is_balloon else PAPER
        return
    simple.ColorBy(display, (association, field))
    table = simple.GetColorTransferFunction(field)
    if field == "mass_ratio":
        table.RGBPoints = CHAR_TO_PAPER
        table.ColorSpace = "RGB"
    elif field == "thickness_ratio":
        table.RGBPoints = STRETCHED_TO_RUBBER
        table.ColorSpace = "RGB"
    else:
        table.ApplyPreset("Inferno (matplotlib)", True)
    table.RescaleTransferFunction(field_range[0], max(field_range[1], field_range[0] + 1e-12))
    bar = simple.GetScalarBar(table, view)
    bar.Visibility = 1 if OPTIONS.field else 0
    bar.Title, bar.ComponentTitle = field, ""
    bar.TitleColor = bar.LabelColor = (0.1, 0.1, 0.1)


def union(ranges):
    """The range that has all of these, of which some may be None; None if all are."""
    known = [one for one in ranges if one]
    return (min(one[0] for one in known), max(one[1] for one in known)) if known else None


def main():
    options = OPTIONS
    simple._DisableFirstRenderCameraReset()
    name, reader, sources = open_run(options.folder)
    times = list(reader.TimestepValues)
    if not times:
        sys.exit(f"render.py: {options.folder}: no frame in {name}.pvd; expected one at least")
    pictures = chosen(times, options.frames)

    simple.UpdatePipeline(time=times[0], proxy=reader)
    if options.heights != 1:
        sources = [raised(source, options.heights) for source in sources]
    objects = []  # source, whether it is a balloon, field that colours it, range of the field
    low, high = [math.inf] * 3, [-math.inf] * 3
    for source in sources:
        simple.UpdatePipeline(time=times[0], proxy=source)
        is_balloon = where(source, "thickness_ratio")[1] is not None
        field = options.field or ("thickness_ratio" if is_balloon else "mass_ratio")
        lowest, highest, field_range = survey(source, times, pictures, field)
        low, high = list(map(min, low, lowest)), list(map(max, high, highest))
        objects.append((source, is_balloon, field, field_range))
    if options.field:
        known = union(field_range for *_, field_range in objects)
        if not known:
            sys.exit(f"render.py: {options.folder}: no field {options.field}; of the points there are "
                     f"{reader.PointData.keys()}, of the cells {reader.CellData.keys()}")
        bounds = options.range or known

    view = simple.CreateRenderView()
    view.ViewSize = options.size
    view.OrientationAxesVisibility = 0
    view.UseColorPaletteForBackground = 0
    view.Background = (1.0, 1.0, 1.0)
    view.UseFXAA = 1
    axes = place_camera(view, low, high, options.view, options.zoom)
    add_lights(view, *axes)

    for source, is_balloon, field, field_range in objects:
        if options.field:
            field_range = field_range and bounds
        elif field_range and field_range[1] - field_range[0] <= 1e-3:
            field_range = None
        elif options.range:
            field_range = options.range
        show(source, view, field, field_range, is_balloon)

    for body, source in body_sources(options.folder):
        show_body(body, source, view)
    for frame in pictures:
        view.ViewTime = times[frame]
        path = os.path.join(options.folder, f"{name}_{frame:04d}.png")
        simple.SaveScreenshot(path, view)
        print(path)


main()
