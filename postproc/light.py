"""Light and shade of the surfaces of a moment, for render.py: how much of the sky and of the sun every vertex sees.

The surfaces are drawn from the direction of each light, the depth is read, and a vertex sees the light unless something
is before it. Many lights on the dome of the sky give the shade in folds and below things, some round the sun soft shadows.
"""

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

SKY_LIGHTS, SUN_LIGHTS = 28, 16
SUN_WIDTH = 0.16  # half of the angle that the sun takes [rad]
PIXELS = 640  # of a depth picture


def spiral(count, height_of):
    """Directions on a spiral; `height_of` gives z from shares 0 to 1."""
    number = numpy.arange(count) + 0.5
    z = height_of(number / count)
    angle = numpy.pi * (3 - 5 ** 0.5) * number
    radius = numpy.sqrt(1 - z * z)
    return numpy.stack([radius * numpy.cos(angle), radius * numpy.sin(angle), z], axis=1)


SKY = spiral(SKY_LIGHTS, lambda share: 0.03 + 0.97 * share)  # as much of the sky each


def across(direction):
    """Two unit vectors at right angles to a unit vector and each other."""
    up = numpy.cross(direction, (1.0, 0, 0) if abs(direction[0]) < 0.7 else (0, 1.0, 0))
    up /= numpy.linalg.norm(up)
    return numpy.cross(up, direction), up


class Light:
    """@param sun the direction towards it, a unit vector"""

    def __init__(self, sun):
        self.sun = sun
        right, up = across(sun)
        cone = spiral(SUN_LIGHTS, lambda share: 1 - share * (1 - numpy.cos(SUN_WIDTH)))
        self.suns = cone @ numpy.stack([right, up, sun])
        self.renderer = vtk.vtkRenderer()
        self.renderer.GetActiveCamera().ParallelProjectionOn()
        self.mapper = vtk.vtkPolyDataMapper()
        self.mapper.ScalarVisibilityOff()
        actor = vtk.vtkActor()
        actor.SetMapper(self.mapper)
        actor.GetProperty().LightingOff()
        self.renderer.AddActor(actor)
        self.window = vtk.vtkRenderWindow()
        self.window.OffScreenRenderingOn()
        self.window.SetMultiSamples(0)
        self.window.SetSize(PIXELS, PIXELS)
        self.window.AddRenderer(self.renderer)
        self.centre, self.radius, self.lowest = numpy.zeros(3), 0.0, 0.0  # of a ball round what casts shade

    def cast(self, data):
        """What casts shade from now on, a vtkPolyData."""
        self.mapper.SetInputData(data)
        bounds = numpy.reshape(data.GetBounds(), (3, 2))
        self.centre, self.lowest = bounds.mean(axis=1), bounds[2, 0]
        self.radius = max(numpy.linalg.norm(bounds[:, 1] - bounds[:, 0]) / 2, 1e-9) if data.GetNumberOfPoints() else 0.0

    def on(self, places, normals):
        """@returns of each place: light of the sky on the side of the normal and on the other one, 1 on the flat below an
        open sky, and the share of the sun that it sees"""
        light = numpy.zeros((len(places), 3))
        flat = SKY[:, 2].sum()
        for directions, is_sun in ((SKY, False), (self.suns, True)):
            for direction in directions:
                towards = normals @ direction
                seen = self.sees(places, normals, towards, direction)
                if is_sun:
                    light[:, 2] += seen / SUN_LIGHTS
                else:
                    light[:, 0] += seen * numpy.maximum(towards, 0) / flat
                    light[:, 1] += seen * numpy.maximum(-towards, 0) / flat
        return light

    def sees(self, places, normals, towards, direction):
        if self.radius == 0:
            return numpy.ones(len(places), bool)
        depth, right, up = self.depth_from(direction)
        step = 2 * self.radius / PIXELS
        # From a little above the surface, on the side of the light.
        place = (places - self.centre) + numpy.where(towards >= 0, 1.5 * step, -1.5 * step)[:, None] * normals
        column, row = ((place @ axis / self.radius + 1) / 2 * PIXELS for axis in (right, up))
        inside = (column >= 0) & (column < PIXELS) & (row >= 0) & (row < PIXELS)
        nearest = numpy.full(len(places), numpy.inf)
        nearest[inside] = depth[row[inside].astype(int), column[inside].astype(int)]
        return 0.5 - place @ direction / (2 * self.radius) <= nearest + 0.5 * step / self.radius

    def depth_from(self, direction):
        """The depth of a picture from a direction, 0 to 1 in the ball, and the axes of the picture."""
        right, up = across(direction)
        camera = self.renderer.GetActiveCamera()
        camera.SetFocalPoint(*self.centre)
        camera.SetPosition(*(self.centre + 2 * self.radius * direction))
        camera.SetViewUp(*up)
        camera.SetParallelScale(self.radius)
        camera.SetClippingRange(self.radius, 3 * self.radius)
        self.window.Render()
        depth = vtk.vtkFloatArray()
        self.window.GetZbufferData(0, 0, PIXELS - 1, PIXELS - 1, depth)
        depth = vtk_to_numpy(depth).reshape(PIXELS, PIXELS)
        return numpy.where(depth < 1, depth, numpy.inf), right, up  # of what casts nothing
