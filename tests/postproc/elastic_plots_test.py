"""That the elastica beside which sheets are drawn is one: elastic_plots_test.py SOURCE_FOLDER MPIEXEC PROGRAM"""

import sys

import numpy
from tiny_run import Faults

sys.path.insert(0, sys.argv[1] + "/postproc")

import elastic_plots  # noqa: E402


def main():
    faults = Faults()
    x, z = elastic_plots.elastica(1, 1e-3)
    faults.unless(abs(z[-1] / -(1e-3 / 8) - 1) < 1e-3, f"a stiff strip sinks by {z[-1]}, expected w L^4 / (8 D)")
    for stiffness in (1, 0.1):
        x, z = elastic_plots.elastica(stiffness, 9.81)
        length = numpy.hypot(numpy.diff(x), numpy.diff(z)).sum()
        faults.unless(abs(length - 1) < 1e-6, f"length {length}")
        # The curvature at the clamp, by the height of the first points, bears the weight at its lever.
        s = numpy.linspace(0, 1, len(x))[1:6]
        curvature = -numpy.polynomial.polynomial.polyfit(s, z[1:6] / (s * s), 2)[0] * 2
        moment = 9.81 * numpy.trapz(x, dx=1 / (len(x) - 1))
        faults.unless(abs(stiffness * curvature / moment - 1) < 1e-3,
                      f"D = {stiffness}: moment {stiffness * curvature}, expected {moment}")
    faults.end()


main()
