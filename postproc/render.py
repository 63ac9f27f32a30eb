"""Pictures and films of runs: tools/pvbatch postproc/render.py OUT [OUT ...] [options]

  tools/pvbatch postproc/render.py output/burning_paper                     # 5 pictures, NAME_0000.png and so on, in OUT
  tools/pvbatch postproc/render.py output/burning_paper --film paper.mp4    # all frames
  tools/pvbatch postproc/render.py output/teddy --film teddy.mp4 --turntable --fps 30
  tools/pvbatch postproc/render.py output/burst --at 0,0.06,0.07            # these moments, in seconds
  tools/pvbatch postproc/render.py output/hot_ball --field temperature --range 300 1000 --view front
  tools/pvbatch postproc/render.py output/coarse output/fine --frames 3     # side by side, in the first folder
  tools/pvbatch postproc/render.py output/burning_lantern --dark --film lantern.mp4
  tools/pvbatch postproc/render.py output/burning_paper --texture letter.png

OUT is the folder of a run, of which all objects are drawn. A picture has the number of its frame. The camera takes in all
frames of the run, or those of --at.
Paper has the colour of its mass ratio, from paper over char to ash, and glows where it is charred and hotter than 750 K;
rubber is the paler the thinner it is. Bodies are grey, balls of heat glow. Light comes from the sky and from a sun at the
upper left; the shade falls on a ground, which is the highest horizontal plane of the bodies, or lies below the run. Planes
are seen only from outside.
"""

import argparse
import math
import os
import shutil
import subprocess
import sys
import time

import run_folder

DIRECTIONS = {  # from the sheet towards the camera
    "oblique": (0.35, -0.85, 0.75),
    "top": (0.0, -0.02, 1.0),
    "front": (0.0, -1.0, 0.12),
    "side": (1.0, -0.25, 0.3),
}
UNITS = {"temperature": "K", "velocity": "m/s", "areal_density": "kg/m^2", "heat_density": "J/m^2", "burn_time": "s",
         "piece_mass": "kg", "piece_birth_time": "s", "thickness": "m", "stress": "Pa"}
VIEW_ANGLE = 25.0  # [degrees], from top to bottom


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


def moments(text):
    try:
        return sorted(float(moment) for moment in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text}; expected times in seconds, such as 0,0.25") from None


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


def picture_kind(path):
    """"PNG", "JPEG", or None, by what the file begins with."""
    try:
        with open(path, "rb") as file:
            begin = file.read(4)
    except OSError:
        return None
    return "PNG" if begin == b"\x89PNG" else "JPEG" if begin[:3] == b"\xff\xd8\xff" else None


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="OUT")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--frames", type=at_least_one, metavar="N",
                       help="how many, spread evenly from the first to the last (5; of a film all)")
    which.add_argument("--at", type=moments, metavar="TIME,TIME",
                       help="the frames nearest to these times [s]; the camera takes in these alone")
    parser.add_argument("--film", metavar="FILE.mp4", help="write a film in place of pictures, by ffmpeg")
    parser.add_argument("--fps", type=positive, default=25, metavar="N", help="frames of the film in a second (25)")
    parser.add_argument("--turntable", action="store_true", help="the camera goes once round from first to last picture")
    parser.add_argument("--field", help="colour by this point or cell field, with a legend; of a vector its length")
    parser.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                        help="of the colours of the field (that of the field in the run)")
    parser.add_argument("--texture", metavar="FILE", help="a PNG or JPEG on the surfaces, by their texture coordinates")
    parser.add_argument("--size", type=size, default=[1200, 900], metavar="SIZE",
                        help="WIDTHxHEIGHT in pixels, of each run (1200x900)")
    parser.add_argument("--view", type=direction, default=DIRECTIONS["oblique"], metavar="VIEW",
                        help=f"{', '.join(DIRECTIONS)} or X,Y,Z towards the camera (oblique)")
    parser.add_argument("--zoom", type=positive, default=1.0, help="above 1: closer (1)")
    parser.add_argument("--heights", type=positive, default=1.0, metavar="FACTOR",
                        help="factor on heights along z, for shallow wrinkles (1)")
    parser.add_argument("--edges", action="store_true", help="draw the mesh too")
    parser.add_argument("--dark", action="store_true", help="night: embers and balls of heat stand out")
    parser.add_argument("--no-ground", action="store_true", help="no ground below that receives the shade")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    for folder in options.folders:
        if "" not in run_folder.series(folder):
            parser.error(f"{folder}: no .pvd of a run, or of several; expected the folder of one")
    if options.range and not options.field:
        parser.error("--range: expected with --field")
    if options.texture and picture_kind(options.texture) is None:
        parser.error(f"--texture {options.texture}: expected a PNG or JPEG")
    if options.film:
        if not os.path.isdir(os.path.dirname(options.film) or "."):
            parser.error(f"--film {options.film}: no such folder {os.path.dirname(options.film)}")
        if shutil.which("ffmpeg") is None:
            parser.error("--film: no ffmpeg here; expected Debian's package ffmpeg")
    return options


# Before VTK is loaded, which takes seconds.
OPTIONS = arguments()

try:
    import matplotlib
    import numpy
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

    import light
    import materials
    import run_frames
except ImportError as missing:
    sys.exit(f"render.py: {missing}; expected to be run by tools/pvbatch")

BACKGROUND = (0.02, 0.02, 0.03) if OPTIONS.dark else (0.96, 0.96, 0.955)
SKY, SUN = (0.07, 0.09) if OPTIONS.dark else (0.5, 0.62)  # on the flat below the open sky; facing the sun
FIRE = 1.0 if OPTIONS.dark else 0.4  # light of a ball of heat on its surface
GROUND_CELLS = 256
MOST_HEATS = 4  # balls of heat that give light

# Light and shade at a point of a surface. `shade` are the light of the sky on the side of the normal and on the other one,
# the share of the sun, and the glow. Colours are sRGB, what is added up is not.
VERTEX_CODE = {"//VTK::Normal::Dec": "//VTK::Normal::Dec\nin vec4 shade;\nout vec4 shadeVS;",
               "//VTK::Normal::Impl": "//VTK::Normal::Impl\nshadeVS = shade;"}
FRAGMENT_CODE = {"//VTK::Normal::Dec": "//VTK::Normal::Dec\nin vec4 shadeVS;", "//VTK::Light::Impl": """
  vec3 towards = normalize(-vertexVC.xyz);
  float facing = dot(normalVCVSOutput, sun);
  float ofSky = gl_FrontFacing ? shadeVS.x : shadeVS.y;
  vec3 light = vec3(sky * (ofSky + 0.22 * (0.5 - 0.5 * dot(normalVCVSOutput, up))));
  light += sunlight * shadeVS.z * (max(facing, 0.0) + through * max(-facing, 0.0)) * vec3(1.0, 0.97, 0.92);
  for (int i = 0; i < heatCount; ++i) {
    vec3 way = heats[i].xyz - vertexVC.xyz;
    float distance = max(length(way), heats[i].w);
    float ofHeat = dot(normalVCVSOutput, way) / distance;
    float share = heats[i].w / distance;
    light += fire * share * share * (max(ofHeat, 0.0) + through * max(-ofHeat, 0.0)) * vec3(1.3, 0.6, 0.2);
  }
  vec3 colour = pow(diffuseColor, vec3(2.2)) * light;
  float glint = pow(max(dot(normalVCVSOutput, normalize(sun + towards)), 0.0), 60.0);
  float rim = pow(1.0 - max(dot(normalVCVSOutput, towards), 0.0), 4.0);
  colour += gloss * (0.6 * sunlight * shadeVS.z * glint + 0.25 * sky * rim * ofSky);
  float glow = shadeVS.w;
  colour = mix(colour, 0.2 * colour, glow) + glow * mix(vec3(0.45, 0.02, 0.0), vec3(1.5, 0.5, 0.06), glow);
  gl_FragData[0] = vec4(pow(colour, vec3(1.0 / 2.2)), opacity);
"""}
# By day a ball of heat has to stand out from a bright background.
RIM_AND_CORE = "1.0, 0.42, 0.05", "1.0, 0.86, 0.5" if OPTIONS.dark else "1.0, 0.7, 0.2"
GLOW_CODE = {"//VTK::Light::Impl": f"""
  float thick = max(normalVCVSOutput.z, 0.0);
  gl_FragData[0] = vec4(mix(vec3({RIM_AND_CORE[0]}), vec3({RIM_AND_CORE[1]}), thick * thick),
                        {"0.75 * pow(thick, 2.5)" if OPTIONS.dark else "0.5 * pow(thick, 1.5)"});
"""}


def poly_data(places, triangles):
    data = vtk.vtkPolyData()
    points, cells = vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(numpy_to_vtk(numpy.ascontiguousarray(places, numpy.float64), deep=True))
    cells.SetData(3, numpy_to_vtkIdTypeArray(numpy.ascontiguousarray(triangles, numpy.int64).ravel(), deep=True))
    data.SetPoints(points)
    data.SetPolys(cells)
    return data


def add_array(attributes, name, values):
    array = numpy_to_vtk(numpy.ascontiguousarray(values), deep=True)
    array.SetName(name)
    attributes.AddArray(array)


class Part:
    """Something to draw in a frame: places, normals, triangles; colours of vertices or triangles; glow from 0 to 1."""

    def __init__(self, places, normals, triangles, gloss=0.0, through=0.0):
        self.places, self.normals, self.triangles = places * (1, 1, OPTIONS.heights), normals, triangles
        self.gloss, self.through = gloss, through  # shine of rubber; light that goes through paper
        self.colours, self.glow = None, numpy.zeros(len(places))
        self.one_sided = False
        self.uv = None  # where a texture goes on it

    def actor(self, shade, axes, heats):
        """@param axes of the camera, the rows right, up, towards it @param heats rows of place and radius, seen by it"""
        data = poly_data(self.places, self.triangles)
        data.GetPointData().SetNormals(numpy_to_vtk(self.normals, deep=True))
        of_points = len(self.colours) == len(self.places)
        add_array(data.GetPointData() if of_points else data.GetCellData(), "colour",
                  numpy.rint(255 * self.colours).astype(numpy.uint8))
        add_array(data.GetPointData(), "shade", numpy.column_stack([shade, self.glow]).astype(numpy.float32))
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(data)
        mapper.SelectColorArray("colour")
        if of_points:
            mapper.SetScalarModeToUsePointFieldData()
        else:
            mapper.SetScalarModeToUseCellFieldData()
        mapper.MapDataArrayToVertexAttribute("shade", "shade", vtk.vtkDataObject.FIELD_ASSOCIATION_POINTS, -1)
        actor = shaded(mapper, FRAGMENT_CODE, VERTEX_CODE)
        uniforms = actor.GetShaderProperty().GetFragmentCustomUniforms()
        for name, number in (("sky", SKY), ("sunlight", SUN), ("fire", FIRE), ("gloss", self.gloss),
                             ("through", self.through)):
            uniforms.SetUniformf(name, number)
        uniforms.SetUniformi("heatCount", len(heats))
        rows = vtk.vtkMatrix4x4()
        rows.DeepCopy(numpy.vstack([heats, numpy.zeros((MOST_HEATS - len(heats), 4))]).ravel())
        uniforms.SetUniformMatrix("heats", rows)
        uniforms.SetUniform3f("sun", list(axes @ Run.light.sun))
        uniforms.SetUniform3f("up", list(axes @ (0, 0, 1)))
        actor.GetProperty().SetBackfaceCulling(self.one_sided)
        if self.uv is not None:
            data.GetPointData().SetTCoords(numpy_to_vtk(numpy.ascontiguousarray(self.uv, numpy.float32), deep=True))
            actor.SetTexture(Run.texture)
        return actor

    def edges(self):
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(poly_data(self.places, self.triangles))
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-4, -4)
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetRepresentationToWireframe()
        actor.GetProperty().LightingOff()
        actor.GetProperty().SetColor(0.1, 0.1, 0.1)
        return actor


def shaded(mapper, fragment_code, vertex_code=()):
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    for place, code in dict(vertex_code).items():
        actor.GetShaderProperty().AddVertexShaderReplacement(place, True, code, False)
    for place, code in fragment_code.items():
        actor.GetShaderProperty().AddFragmentShaderReplacement(place, True, code, False)
    return actor


def length(values):
    return numpy.linalg.norm(values, axis=1) if values.ndim > 1 else values.astype(float)


class Run:
    """A run that is drawn, in its own part of the window."""

    light = texture = None

    def __init__(self, folder):
        series = run_folder.series(folder)
        self.folder, self.name = folder, os.path.basename(series[""])[:-len(".pvd")]
        self.frames = run_frames.frames_by_time(series[""])
        self.bodies = dict(run_frames.frames_by_time(series["_bodies"])) if "_bodies" in series else {}
        self.least, self.field_range = dict.fromkeys(("mass_ratio", "thickness_ratio"), 1.0), (math.inf, -math.inf)
        self.low, self.high, self.fields = numpy.full(3, math.inf), numpy.full(3, -math.inf), set()
        self.floor = -math.inf  # the highest horizontal plane of the bodies
        self.lowest = math.inf  # point of the balls of heat
        self.renderer = vtk.vtkRenderer()
        self.renderer.SetBackground(BACKGROUND)

    def nearest(self, moment):
        """The number of the frame whose time is nearest to a moment."""
        return min(range(len(self.frames)), key=lambda number: abs(self.frames[number][0] - moment))

    def meshes(self, number):
        return [run_frames.Mesh(path) for path in self.frames[number][1].values()]

    def values(self, mesh, field):
        """Of the vertices, or else of the triangles; None where there are none."""
        values = mesh.of_vertices(field)
        if values is None:
            values = mesh.of_triangles(field)
        return None if values is None else length(values)

    def survey(self, see):
        """Looks through all frames. @param see function of the places of those that the camera takes in"""
        framed = {self.nearest(moment) for moment in OPTIONS.at} if OPTIONS.at else range(len(self.frames))
        for number, (moment, _) in enumerate(self.frames):
            for mesh in self.meshes(number):
                for data in (mesh.data.GetPointData(), mesh.data.GetCellData()):
                    self.fields |= {data.GetArrayName(i) for i in range(data.GetNumberOfArrays())}
                if not len(mesh.ids):
                    continue
                if number in framed:
                    places = mesh.places * (1, 1, OPTIONS.heights)
                    self.low = numpy.minimum(self.low, places.min(axis=0))
                    self.high = numpy.maximum(self.high, places.max(axis=0))
                    see(places)
                for field, values in (("mass_ratio", mesh.of_vertices("mass_ratio")),
                                      ("thickness_ratio", mesh.means("thickness_ratio"))):
                    if values is not None:
                        self.least[field] = min(self.least[field], float(values.min()))
                values = self.values(mesh, OPTIONS.field) if OPTIONS.field else None
                if values is not None:
                    self.field_range = min(self.field_range[0], values.min()), max(self.field_range[1], values.max())
            for name, path in self.bodies.get(moment, {}).items():
                data = run_frames.surface(path)
                bounds = numpy.reshape(data.GetBounds(), (3, 2)) * [[1], [1], [OPTIONS.heights]]
                if is_plane(data):
                    if body_part(data).normals[0, 2] > 1 - 1e-9:
                        self.floor = max(self.floor, bounds[2, 0])
                elif number in framed and name.startswith("heat_"):
                    self.lowest = min(self.lowest, bounds[2, 0])
                elif number in framed and data.GetNumberOfPoints():
                    see(vtk_to_numpy(data.GetPoints().GetData()) * (1, 1, OPTIONS.heights))

    def parts(self, number, colour_map):
        """What is drawn in a frame. @returns objects, bodies, planes, balls of heat (vtkPolyData)"""
        objects, bodies, planes, heats = [], [], [], []
        for mesh in self.meshes(number):
            if not len(mesh.ids):
                continue
            mass, thickness = mesh.of_vertices("mass_ratio"), mesh.means("thickness_ratio")
            temperature = mesh.of_vertices("temperature")
            part = Part(mesh.places, mesh.normals(), mesh.triangles, gloss=0.0 if thickness is None else 1.0,
                        through=0.35 if thickness is None else 0.15)
            values = self.values(mesh, OPTIONS.field) if OPTIONS.field else None
            if values is not None:
                part.colours, part.gloss = colour_map(values), 0.0
            else:
                part.colours = materials.colours(len(mesh.ids), mass, thickness, self.least)
                if mass is not None and temperature is not None:
                    part.glow = materials.glow(mass, temperature, self.least["mass_ratio"])
            if OPTIONS.texture:
                part.uv = mesh.of_vertices("TCoords")
            objects.append(part)
        for name, path in self.bodies.get(self.frames[number][0], {}).items():
            data = run_frames.surface(path)
            if data.GetNumberOfPoints() == 0:
                continue
            if name.startswith("heat_"):
                heats.append(data)
            elif not is_plane(data):
                bodies.append(body_part(data))
            elif OPTIONS.no_ground or data.GetBounds()[4] * OPTIONS.heights != self.floor:
                finer = vtk.vtkLinearSubdivisionFilter()  # so that shade has places to fall on
                finer.SetInputData(triangulated(data))
                finer.SetNumberOfSubdivisions(6)
                finer.Update()
                planes.append(body_part(finer.GetOutput()))
                planes[-1].one_sided = True
        return objects, bodies, planes, heats

    def draw(self, number, axes, colour_map):
        self.renderer.RemoveAllViewProps()
        objects, bodies, planes, heats = self.parts(number, colour_map)
        casters = vtk.vtkAppendPolyData()
        casters.AddInputData(vtk.vtkPolyData())
        for part in objects + bodies:
            casters.AddInputData(poly_data(part.places, part.triangles))
        casters.Update()
        self.light.cast(casters.GetOutput())
        ground = None if OPTIONS.no_ground else self.ground()
        parts = objects + bodies + planes + ([ground] if ground else [])
        if parts:
            seen_heats = numpy.zeros((len(heats), 4))
            for row, data in zip(seen_heats, heats):
                place = numpy.array(data.GetCenter()) * (1, 1, OPTIONS.heights)
                row[:3] = axes @ (place - self.renderer.GetActiveCamera().GetPosition())
                row[3] = data.GetLength() / 2 / 3 ** 0.5
            shade = self.light.on(numpy.concatenate([part.places for part in parts]),
                                  numpy.concatenate([part.normals for part in parts]))
            for part, of_part in zip(parts, numpy.split(shade, numpy.cumsum([len(part.places) for part in parts])[:-1])):
                self.renderer.AddActor(self.ground_actor(part, of_part) if part is ground
                                       else part.actor(of_part, axes, seen_heats[:MOST_HEATS]))
        for part in objects if OPTIONS.edges else []:
            self.renderer.AddActor(part.edges())
        for data in heats:
            normals = vtk.vtkPolyDataNormals()
            normals.SetInputData(data)
            mapper = vtk.vtkPolyDataMapper()
            mapper.SetInputConnection(normals.GetOutputPort())
            actor = shaded(mapper, GLOW_CODE)
            actor.SetScale(1, 1, OPTIONS.heights)
            actor.ForceTranslucentOn()
            actor.GetProperty().BackfaceCullingOn()
            self.renderer.AddActor(actor)

    def ground(self):
        """A square below what casts shade, as large as the shade may be."""
        floor = self.floor
        if not math.isfinite(floor):
            floor = min(self.lowest, self.low[2]) - 0.02 * numpy.linalg.norm(self.high - self.low)
        radius = self.light.radius
        if radius == 0:
            return None
        half = 1.7 * radius + 1.2 * max(0.0, self.light.centre[2] - floor)
        line = numpy.linspace(-half, half, GROUND_CELLS + 1)
        x, y = numpy.meshgrid(line, line)
        places = numpy.stack([x.ravel() + self.light.centre[0], y.ravel() + self.light.centre[1],
                              numpy.full(x.size, floor)], axis=1)
        corner = (numpy.arange(GROUND_CELLS)[:, None] * (GROUND_CELLS + 1) + numpy.arange(GROUND_CELLS)).ravel()
        quads = corner[:, None] + (0, 1, GROUND_CELLS + 2, GROUND_CELLS + 1)
        part = Part(places / (1, 1, OPTIONS.heights), numpy.tile((0.0, 0, 1), (len(places), 1)),
                    numpy.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))
        edge = numpy.maximum(abs(x), abs(y)).ravel() / half
        part.nearness = numpy.clip((1 - edge) / 0.4, 0, 1)
        return part

    def ground_actor(self, part, shade):
        """The ground has the colour of the background, but for the shade on it."""
        upright = self.light.sun[2]
        # What is high above has soft shadows, in cells of the ground.
        height = max(0.0, self.light.lowest - part.places[0, 2]) / (part.places[1, 0] - part.places[0, 0])
        sky, sun = smooth(shade[:, 0], min(6 + 0.3 * height, 25)), smooth(shade[:, 2], min(1.2 + 0.04 * height, 10))
        share = (SKY * sky + SUN * upright * sun) / (SKY + SUN * upright)
        share = 1 - (1 - numpy.minimum(share, 1)) * part.nearness
        data = poly_data(part.places, part.triangles)
        colours = numpy.rint(255 * share[:, None] ** (1 / 2.2) * BACKGROUND).astype(numpy.uint8)
        data.GetPointData().SetScalars(numpy_to_vtk(colours, deep=True))
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(data)
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().LightingOff()
        actor.GetProperty().BackfaceCullingOn()
        return actor


def smooth(values, width):
    """Smooths values at the vertices of the ground, where single lights of the sky would show."""
    reach = numpy.arange(-int(3 * width), int(3 * width) + 1)
    weights = numpy.exp(-(reach / width) ** 2 / 2)
    square = numpy.reshape(values, (GROUND_CELLS + 1, GROUND_CELLS + 1))
    for _ in range(2):  # along one side, then along the other
        padded = numpy.pad(square, ((0, 0), (len(reach) // 2,) * 2), mode="edge")
        square = sum(weight * padded[:, i:i + GROUND_CELLS + 1] for i, weight in enumerate(weights / weights.sum())).T
    return square.ravel()


def is_plane(data):
    """Whether a body is a plane: all of its points lie in one."""
    if data.GetNumberOfPoints() == 0 or data.GetNumberOfPoints() > 8:
        return False
    points = vtk_to_numpy(data.GetPoints().GetData())
    extents = numpy.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return extents[2] < 1e-6 * extents[0]


def triangulated(data):
    triangles = vtk.vtkTriangleFilter()
    triangles.SetInputData(data)
    triangles.Update()
    return triangles.GetOutput()


def body_part(data):
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(triangulated(data))
    normals.SetFeatureAngle(40)
    normals.ConsistencyOff()
    normals.Update()
    data = normals.GetOutput()
    part = Part(vtk_to_numpy(data.GetPoints().GetData()).astype(float), vtk_to_numpy(data.GetPointData().GetNormals()),
                vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3))
    part.colours = numpy.tile((0.62, 0.67, 0.73), (len(part.places), 1))
    return part


class Camera:
    """Looks along a direction, from where all places that it is told of are in the picture."""

    def __init__(self, towards, aspect):
        towards = numpy.asarray(towards, float) / numpy.linalg.norm(towards)
        right = numpy.array((-towards[1], towards[0], 0.0))
        right = right / numpy.linalg.norm(right) if numpy.linalg.norm(right) > 1e-9 else numpy.array((1.0, 0, 0))
        self.axes = numpy.stack([right, numpy.cross(towards, right), towards])
        tangent = math.tan(math.radians(VIEW_ANGLE / 2))
        self.tangents = numpy.array((tangent * aspect, tangent))
        self.furthest = numpy.full((2, 2), -math.inf)  # of what lies to the right and left, above and below
        self.depth = 0.0  # of what it looks at, towards it

    def see(self, places):
        local = places @ self.axes.T
        for axis in range(2):
            for side, sign in enumerate((1, -1)):
                reach = sign * local[:, axis] / self.tangents[axis] + local[:, 2]
                self.furthest[axis, side] = max(self.furthest[axis, side], reach.max())

    def see_from_all_sides(self, low, high):
        """Has it take in a box while it goes round."""
        centre, angle = (low + high) / 2, numpy.linspace(0, 2 * numpy.pi, 33)
        circle = numpy.linalg.norm((high - low)[:2]) / 2 * numpy.stack([numpy.cos(angle), numpy.sin(angle)])
        for z in (low[2], high[2]):
            self.see(numpy.stack([*(centre[:2, None] + circle), numpy.full(len(angle), z)], axis=1))

    def place(self, camera, zoom, turn=0.0):
        """@param turn round the upright axis through what it looks at [rad] @returns its axes, right, up, towards it"""
        offset = self.tangents * (self.furthest[:, 0] - self.furthest[:, 1]) / 2
        middle = numpy.append(offset, self.depth) @ self.axes
        distance = (self.furthest.sum(axis=1) / 2).max() - self.depth
        cosine, sine = math.cos(turn), math.sin(turn)
        axes = self.axes @ numpy.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
        camera.SetViewAngle(VIEW_ANGLE)
        camera.SetFocalPoint(*middle)
        camera.SetPosition(*(middle + 1.12 * distance / zoom * axes[2]))
        camera.SetViewUp(*axes[1])
        return axes


def main():
    options = OPTIONS
    runs = [Run(folder) for folder in options.folders]
    camera = Camera(options.view, options.size[0] / options.size[1])
    for run in runs:
        run.survey(camera.see)
        if options.field and options.field not in run.fields:
            run_frames.fail(f"{run.folder}: no field {options.field}; expected one of "
                            f"{', '.join(sorted(run.fields - {'vtkGhostType'}))}")
    low, high = numpy.min([run.low for run in runs], axis=0), numpy.max([run.high for run in runs], axis=0)
    if not numpy.isfinite(low).all():
        run_frames.fail(f"{options.folders[0]}: nothing is left in any frame")
    camera.depth = (low + high) / 2 @ camera.axes[2]
    if options.turntable:
        camera.see_from_all_sides(low, high)
    right, upright = camera.axes[0], numpy.array((0, 0, 1.0))
    # The sun is at the upper left; the less the camera looks down, the more the light comes from in front.
    before = 0.25 + 0.6 * (1 - abs(camera.axes[2, 2])) ** 2
    sun = upright - 0.55 * right + before * numpy.cross(right, upright)
    Run.light = light.Light(sun / numpy.linalg.norm(sun))

    if options.texture:
        Run.texture = texture_of(options.texture)

    window = vtk.vtkRenderWindow()
    window.OffScreenRenderingOn()
    window.SetMultiSamples(4)
    window.SetSize(options.size[0] * len(runs), options.size[1])
    for number, run in enumerate(runs):
        run.renderer.SetViewport(number / len(runs), 0, (number + 1) / len(runs), 1)
        window.AddRenderer(run.renderer)
    table = vtk.vtkLookupTable()
    colours = matplotlib.colormaps["plasma"](numpy.linspace(0, 1, 256))
    table.SetNumberOfTableValues(256)
    for entry, colour in enumerate(colours):
        table.SetTableValue(entry, *colour)
    field_low, field_high = options.range or (min(run.field_range[0] for run in runs),
                                              max(run.field_range[1] for run in runs))
    if options.field:
        table.SetTableRange(field_low, max(field_high, field_low + 1e-12))

    def colour_map(values):
        share = (values - field_low) / max(field_high - field_low, 1e-12)
        return colours[numpy.rint(255 * numpy.clip(share, 0, 1)).astype(int), :3]

    counts = [len(run.frames) for run in runs]
    chosen = run_folder.evenly(counts[0], options.frames or (counts[0] if options.film else 5))
    if options.at:
        chosen = sorted({runs[0].nearest(moment) for moment in options.at})
    film = Film(options.film, window.GetSize(), options.fps) if options.film else None
    for done, number in enumerate(chosen):
        for run in runs:
            nearest = run.nearest(runs[0].frames[number][0])
            axes = camera.place(run.renderer.GetActiveCamera(), options.zoom,
                                2 * math.pi * done / len(chosen) if options.turntable else 0.0)
            run.draw(nearest, axes, colour_map)
            if options.field:
                run.renderer.AddActor2D(legend(table))
            if len(runs) > 1:
                run.renderer.AddActor2D(label(os.path.basename(os.path.abspath(run.folder))))
            run.renderer.ResetCameraClippingRange()
        picture = picture_of(window)
        if film:
            film.add(picture)
            film.tell(done + 1, len(chosen))
        else:
            path = os.path.join(options.folders[0], f"{runs[0].name}_{number:04d}.png")
            write_png(picture, path)
            print(path, flush=True)
    if film:
        film.end()
        print(options.film)


def texture_of(path):
    reader = vtk.vtkPNGReader() if picture_kind(path) == "PNG" else vtk.vtkJPEGReader()
    reader.SetFileName(path)
    texture = vtk.vtkTexture()
    texture.SetInputConnection(reader.GetOutputPort())
    texture.InterpolateOn()
    texture.MipmapOn()
    return texture


def text_colour(of):
    of.SetColor(*((0.85,) * 3 if OPTIONS.dark else (0.1,) * 3))
    of.SetShadow(False)
    of.SetItalic(False)
    of.SetBold(False)
    return of


def legend(table):
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(table)
    unit = UNITS.get(OPTIONS.field)
    bar.SetTitle(OPTIONS.field + (f" [{unit}]" if unit else ""))
    bar.SetNumberOfLabels(5)
    bar.SetLabelFormat("%.4g")
    bar.SetVerticalTitleSeparation(OPTIONS.size[1] // 60)
    bar.SetPosition(0.86, 0.08)
    bar.SetWidth(0.1)
    bar.SetHeight(0.42)
    bar.UnconstrainedFontSizeOn()
    for text in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        text_colour(text).SetFontSize(max(8, OPTIONS.size[1] // 45))
    return bar


def label(words):
    actor = vtk.vtkTextActor()
    actor.SetInput(words)
    actor.SetPosition(OPTIONS.size[0] // 40, OPTIONS.size[1] // 40)
    text_colour(actor.GetTextProperty()).SetFontSize(max(8, OPTIONS.size[1] // 36))
    return actor


def picture_of(window):
    window.Render()
    picture = vtk.vtkWindowToImageFilter()
    picture.SetInput(window)
    picture.ReadFrontBufferOff()
    picture.ShouldRerenderOff()
    picture.Update()
    return picture.GetOutput()


def write_png(picture, path):
    writer = vtk.vtkPNGWriter()
    writer.SetInputData(picture)
    writer.SetFileName(path)
    writer.Write()
    if writer.GetErrorCode():
        run_frames.fail(f"{path}: cannot be written")


class Film:
    """A film of pictures, encoded by ffmpeg as they come."""

    def __init__(self, path, sides, fps):
        self.path = path
        self.process = subprocess.Popen(
            ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "{}x{}".format(*sides),
             "-r", str(fps), "-i", "-", "-vf", "vflip,pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
             path], stdin=subprocess.PIPE)
        self.begin = time.monotonic()

    def add(self, picture):
        try:
            self.process.stdin.write(vtk_to_numpy(picture.GetPointData().GetScalars()).tobytes())
        except BrokenPipeError:
            self.end()

    def tell(self, done, count):
        """Shows the progress: on a terminal in one line, else a line for each tenth."""
        terminal = sys.stdout.isatty()
        if terminal or done * 10 // count > (done - 1) * 10 // count:
            seconds = (time.monotonic() - self.begin) / done
            print(f"{done} of {count} frames, {seconds:.2f} s a frame, {seconds * (count - done):.0f} s to go   ",
                  end="\r" if terminal and done < count else "\n", flush=True)

    def end(self):
        self.process.stdin.close()
        if self.process.wait() != 0:
            run_frames.fail(f"{self.path}: ffmpeg could not write it")


main()
