#!/usr/bin/python3
"""Makes the textures of the decks: fibres.png (the mass-loss rate of paper), clouds.png (soft noise), flocs.png (blots of
a sixteenth of its width) and halves.png (black on the left, white on the right, a soft step between).

The first three repeat at their edges; all have the mean 1/2.
"""

import argparse
import os

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk

SIZE = 256


def filtered_noise(random, amplitude):
    """White noise shaped by an amplitude over the two wave numbers; mean 0, deviation 1, periodic."""
    waves = numpy.fft.fftfreq(SIZE, 1.0 / SIZE)
    kx, ky = numpy.meshgrid(waves, waves)
    spectrum = numpy.fft.fft2(random.standard_normal((SIZE, SIZE))) * amplitude(kx, ky)
    spectrum[0, 0] = 0
    noise = numpy.fft.ifft2(spectrum).real
    return noise / noise.std()


def clouds(random):
    """Octaves of noise whose amplitude halves as the wave number doubles."""
    return filtered_noise(random, lambda kx, ky: (2.0 ** 2 + kx**2 + ky**2) ** -1.0)


def fibres(random):
    """Clouds under strands: noise that is long in one direction and thin across it, in many directions."""
    picture = 0.8 * clouds(random)
    for angle in numpy.pi * (numpy.arange(16) + random.uniform(0, 1, 16)) / 16:
        def strand(kx, ky, c=numpy.cos(angle), s=numpy.sin(angle)):
            along, across = c * kx + s * ky, c * ky - s * kx
            return numpy.exp(-((along / 5) ** 2) - (across / 60) ** 2)

        # The crests alone: a few strands rather than an even grain.
        picture += 0.5 * numpy.maximum(filtered_noise(random, strand) - 1, 0)
    return picture


def flocs(random):
    """Noise of about 8 waves across, in all directions, as fibres clot in paper."""
    return filtered_noise(random, lambda kx, ky: numpy.exp(-(((numpy.hypot(kx, ky) - 8) / 3.2) ** 2)))


def grey(picture):
    """Mean 1/2, deviation 1/5, cut at black and white."""
    picture = 0.5 + 0.2 * (picture - picture.mean()) / picture.std()
    return numpy.rint(255 * picture.clip(0, 1)).astype(numpy.uint8)


def halves():
    """A step whose middle tenth is smooth."""
    step = ((numpy.arange(SIZE) + 0.5) / SIZE * 10 - 4.5).clip(0, 1)
    row = numpy.rint(255 * step**2 * (3 - 2 * step)).astype(numpy.uint8)
    return numpy.tile(row, (SIZE, 1))


def write(picture, path):
    image = vtk.vtkImageData()
    image.SetDimensions(SIZE, SIZE, 1)
    image.GetPointData().SetScalars(numpy_to_vtk(picture.ravel(), deep=True))
    writer = vtk.vtkPNGWriter()
    writer.SetCompressionLevel(9)
    writer.SetFileName(path)
    writer.SetInputData(image)
    writer.Write()


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=os.path.dirname(os.path.abspath(__file__)),
                        help="where they go; the folder of this script unless given")
    parser.error = lambda problem: parser.exit(2, f"{parser.prog}: {problem}\n")
    options = parser.parse_args()
    if not os.path.isdir(options.folder):
        parser.error(f"{options.folder}: no such folder")
    return options


def main():
    folder = arguments().folder
    for number, (name, make) in enumerate([("fibres", fibres), ("clouds", clouds), ("flocs", flocs)]):
        write(grey(make(numpy.random.default_rng(7 + number))), os.path.join(folder, name + ".png"))
    write(halves(), os.path.join(folder, "halves.png"))


main()
