"""Runs for the tests of postproc/: a sheet that burns and a balloon that is blown up beside it, in a second."""

import pathlib
import subprocess
import sys

DECK = """
time: {step: 4 ms, end: 0.2 s}
force: {gravity: [0, 0, -9.81 m/s^2], damping: 1}
bodies:
  table: {shape: plane, point: [0, 0, -0.3 m]}
objects:
  paper:
    mesh: {shape: rectangle, cells: [8, 8], size: [0.4 m, 0.4 m], rotation: [90 deg, 0, 0]}
    sheet: {thickness: 3 mm, areal_density: 0.1 kg/m^2, perturbation: 0.01}
    pins: {hooks: {corners: max_z}}
    heat:
      diffusivity: 5e-4
      burning_heat: 500 K
      sources: {flame: {centre: [-5 cm, 0, -0.15 m], radius: 12 cm, temperature: 1200 K, rate: 30}}
    combustion: {ignition_temperature: 500 K, mass_loss_rate: 4e-2, min_mass: 0.3}
    ablation: {loss_mass: 0.4}
  balloon:
    mesh: {shape: icosphere, level: 1, radius: 8 cm, shift: [0.5 m, 0, 0]}
    wall: {thickness: 0.3 mm, density: 1000 kg/m^3, material: mooney_rivlin, c1: 0.2 MPa, c2: 20 kPa}
    pins: {neck: {centre: [0.5 m, 0, 8 cm], radius: 1.5 cm}}
    prism: {mass_damping: 5 1/s}
    chambers: {air: {law: volume, volume_ratio: [[0 s, 1], [0.2 s, 2]]}}
output: {interval_time: 50 ms}
"""


def tiny_run(mpiexec, program, folder, *options):
    """Runs it on two ranks. @returns the folder of the run"""
    deck, out = pathlib.Path(folder) / "tiny.yaml", pathlib.Path(folder) / "tiny"
    deck.write_text(DECK, encoding="utf-8")
    told = run([mpiexec, "-n", "2", program, deck, "-output_directory", out, *options])
    if told.returncode != 0:
        sys.exit(f"the run failed: {told}")
    return out


def run(command):
    return subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)


class Faults:
    """What a test has found."""

    def __init__(self):
        self.count = 0

    def unless(self, holds, text):
        if not holds:
            self.count += 1
            print("FAULT:", text)

    def end(self):
        print(f"{self.count} faults")
        sys.exit(1 if self.count else 0)
