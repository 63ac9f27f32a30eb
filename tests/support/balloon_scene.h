#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/balls.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {

/// An OBJ file of several meshes, each of which is a group.
inline std::string obj_of(const std::vector<std::pair<std::string, SurfaceMesh>>& pieces) {
  std::ostringstream text;
  text.precision(17);
  std::size_t points_before = 0;
  for (const auto& [name, mesh] : pieces) {
    text << "g " << name << '\n';
    for (const Eigen::Vector3d& point : mesh.points) {
      text << "v " << point.transpose() << '\n';
    }
    for (const auto& face : mesh.faces) {
      text << 'f';
      for (const int point : face) {
        text << ' ' << points_before + static_cast<std::size_t>(point) + 1;
      }
      text << '\n';
    }
    points_before += mesh.points.size();
  }
  return text.str();
}

/// The mesh of the scene below, "balloons.obj": 162 vertices of a ball (320 triangles), 91 of a dome (160 triangles).
inline std::string balloon_scene_mesh() {
  return obj_of({{"ball", moved(icosphere_mesh(2, 0.05), {0, 0, 0.2})}, {"dome", dome_mesh(2, 0.06)}});
}

/// A deck with something of everything, small: a ball that is blown up by the paper's gas while its top is led upwards
/// and a plate presses on it from the side, and half a ball of another material on a plane of symmetry, pumped up
/// against the ambient pressure and pulled at its side. 20 steps, two frames.
inline const std::string balloon_scene = R"(
chain: inflate
mesh: {file: balloons.obj}
time: {step: 5 ms, end: 0.1 s}
force: {gravity: [0, 0, -9.81]}
wall: {thickness: 0.3 mm, material: neo_hookean, mu: 0.4 MPa}
regions:
  thick: {group: dome, thickness: 0.5 mm, material: mooney_rivlin, c1: 0.2 MPa, c2: 0.02 MPa}
prism: {thickness: incompressible, newton: converged, snes_rtol: 1e-10, ksp_rtol: 1e-10, stiffness_damping: 1 ms}
chambers:
  ball: {law: relative, vertex: 0, pressure: [[0, 0], [0.01, 30], [0.03, 600], [0.1, 6000]]}
  dome: {law: adiabatic, amount_ratio: [[0, 1], [0.01, 1.001], [0.03, 1.01], [0.1, 1.4]]}
symmetry:
  ground: {normal: [0, 0, 1], group: dome}
pins:
  top: {centre: [0, 0, 0.25], radius: 1 cm, path: [[0, 0, 0, 0], [0.1, 0, 0, 0.02]]}
attachments:
  side: {box: [-0.07, -0.02, 0.001, -0.04, 0.02, 0.03], total_stiffness: 300 N/m,
         path: [[0, 0, 0, 0], [0.1, -0.02, 0, 0]]}
bodies:
  plate: {shape: plane, point: [0.06, 0, 0], normal: [-1, 0, 0], velocity: [-0.1, 0, 0.04], friction: 0.3}
output:
  directory: out
  name: scene
  interval_steps: 20
)";

}  // namespace pellicle
