"""The colours that scripts beside this one give to paper and rubber."""

import numpy

PAPER = (0.93, 0.89, 0.80)
RUBBER = (0.78, 0.06, 0.09)
# Share of the way from ash (0) over char to paper (1), red, green, blue.
CHAR_TO_PAPER = [0.0, 0.40, 0.385, 0.37, 0.10, 0.19, 0.175, 0.165, 0.28, 0.20, 0.165, 0.145, 0.5, 0.42, 0.27, 0.16,
                 0.75, 0.74, 0.56, 0.36, 0.92, 0.91, 0.83, 0.69, 1.0, *PAPER]
# From stretched thin (0) to as thick as at first (1).
STRETCHED_TO_RUBBER = [0.0, 1.0, 0.62, 0.50, 0.35, 0.96, 0.36, 0.30, 0.7, 0.88, 0.15, 0.16, 1.0, *RUBBER]


def on_ramp(ramp, values):
    """The colours (n, 3) of values from 0 to 1 on a ramp of such rows."""
    rows = numpy.reshape(ramp, (-1, 4))
    return numpy.stack([numpy.interp(values, rows[:, 0], rows[:, component]) for component in (1, 2, 3)], axis=1)


def colours(count, mass_ratio, thickness_ratio, least):
    """The colours (count, 3) of vertices, sRGB from 0 to 1: of paper that chars, and of rubber that is stretched and chars.
    @param mass_ratio of the vertices, or None @param thickness_ratio likewise, which only rubber has
    @param least {field: the least value that it has in the run}"""
    def share(name, values, highest_low):
        low = min(least[name], highest_low)
        return (values - low) / (1 - low)
    paper = numpy.tile(PAPER, (count, 1))
    charred = paper if mass_ratio is None else on_ramp(CHAR_TO_PAPER, share("mass_ratio", mass_ratio, 1 - 1e-3))
    if thickness_ratio is None:
        return charred
    # Rubber that is hardly stretched anywhere is not pale.
    return on_ramp(STRETCHED_TO_RUBBER, share("thickness_ratio", thickness_ratio, 0.8)) * charred / PAPER


def glow(mass_ratio, temperature, least):
    """Of vertices that have lost nearly all that burns, from 0 to 1, dull red at 750 K to yellow at 1250 K."""
    left = (mass_ratio - least) / max(1 - least, 1e-3)
    return numpy.clip(1 - left / 0.25, 0, 1) * numpy.clip((temperature - 750) / 500, 0, 1)
