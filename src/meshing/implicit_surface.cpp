#include "meshing/implicit_surface.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/error.h"
#include "geometry/pressure_load.h"
#include "meshing/isotropic_remesher.h"

namespace pellicle::meshing {

namespace {

constexpr double coarse_cells = 64;  ///< of the first grid, along the longest side of the bounds
constexpr double most_cells = 256;   ///< of the grid, along it

/// Flying edges on a grid of this spacing [m], normals outward.
SurfaceMesh contour(const ImplicitSurface& surface, double spacing) {
  constexpr int padding = 2;
  const Eigen::Vector3d origin = surface.bounds.min() - Eigen::Vector3d::Constant(padding * spacing);
  Eigen::Vector3i count = (surface.bounds.sizes() / spacing).array().ceil().cast<int>() + (2 * padding + 1);
  vtkNew<vtkDoubleArray> values;
  values->SetNumberOfTuples(static_cast<vtkIdType>(count.x()) * count.y() * count.z());
  vtkIdType next = 0;
  for (int k = 0; k < count.z(); ++k) {
    for (int j = 0; j < count.y(); ++j) {
      for (int i = 0; i < count.x(); ++i) {
        values->SetValue(next++, surface.value(origin + spacing * Eigen::Vector3d(i, j, k)));
      }
    }
  }
  vtkNew<vtkImageData> grid;
  grid->SetDimensions(count.data());
  grid->SetOrigin(origin.data());
  grid->SetSpacing(spacing, spacing, spacing);
  grid->GetPointData()->SetScalars(values);
  vtkNew<vtkFlyingEdges3D> filter;
  filter->SetInputData(grid);
  filter->SetValue(0, 0);
  filter->ComputeNormalsOff();
  filter->ComputeScalarsOff();
  filter->Update();
  vtkPolyData* contoured = filter->GetOutput();

  SurfaceMesh mesh;
  for (vtkIdType i = 0; i < contoured->GetNumberOfPoints(); ++i) {
    mesh.points.emplace_back(Eigen::Vector3d::Map(contoured->GetPoint(i)));
  }
  vtkIdType size = 0;
  const vtkIdType* corners = nullptr;
  vtkCellArray* faces = contoured->GetPolys();
  for (faces->InitTraversal(); faces->GetNextCell(size, corners) != 0;) {
    // VTK turns them towards lower values.
    mesh.faces.emplace_back(std::reverse_iterator(corners + size), std::reverse_iterator(corners));
  }
  return mesh;
}

double area_of(const SurfaceMesh& mesh) {
  double area = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    area += area_vector(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2)).norm();
  }
  return area;
}

}  // namespace

Eigen::Vector3d ImplicitSurface::gradient(const Eigen::Vector3d& point, double value_there) const {
  const double step = 1e-6 * bounds.sizes().maxCoeff();
  Eigen::Vector3d gradient;
  for (int k = 0; k < 3; ++k) {
    gradient[k] = (value(point + step * Eigen::Vector3d::Unit(k)) - value_there) / step;
  }
  return gradient;
}

Eigen::Vector3d ImplicitSurface::step_onto(const Eigen::Vector3d& point, double longest) const {
  const double there = value(point);
  const Eigen::Vector3d slope = gradient(point, there);
  const double steepness = slope.squaredNorm();
  if (!(steepness > 0)) {
    return Eigen::Vector3d::Zero();
  }
  const Eigen::Vector3d step = -there / steepness * slope;
  const double length = step.norm();
  return length > longest ? Eigen::Vector3d(step * (longest / length)) : step;
}

SurfaceMesh implicit_surface_mesh(const ImplicitSurface& surface, int vertices, const std::string& key) {
  constexpr int rounds = 8;       // until the edges have the wanted length
  constexpr int corrections = 6;  // of that length, until the number of points is right
  constexpr int last_rounds = 12;
  constexpr double smallest_size = 1e-60;  // beyond these, products of a few lengths are 0 or infinite
  constexpr double largest_size = 1e60;
  require_mesh_size(fmt::format("{} of {} vertices", key, vertices), 2.0 * vertices);
  const double longest_side = surface.bounds.sizes().maxCoeff();
  refuse_if(!(longest_side >= smallest_size && longest_side <= largest_size),
            "{}: {:g} m across, expected {:g} to {:g} m", key, longest_side, smallest_size, largest_size);
  double spacing = longest_side / coarse_cells;
  SurfaceMesh mesh = contour(surface, spacing);
  refuse_if(mesh.faces.empty(), "{}: nothing is left inside, expected solids that have a surface", key);
  // A closed mesh has two triangles a point, of area sqrt(3)/4 L^2.
  const double edge = std::sqrt(2 * area_of(mesh) / (std::sqrt(3.0) * vertices));
  if (edge < spacing) {
    spacing = std::max(edge, longest_side / most_cells);
    mesh = contour(surface, spacing);
  }
  IsotropicRemesher remesher(mesh, surface, key);
  double length = edge;
  for (int round = 0; round < rounds; ++round) {
    remesher.remesh(length);
  }
  for (int correction = 0; correction < corrections; ++correction) {
    length *= std::sqrt(static_cast<double>(remesher.points()) / vertices);
    remesher.remesh(length);
    remesher.remesh(length);
  }
  remesher.reach(vertices);
  for (int round = 0; round < last_rounds; ++round) {
    remesher.relax();
  }
  remesher.project();
  refuse_if(remesher.points() != vertices || !remesher.follows_surface(),
            "mesh.vertices: {} are too few for {}, expected more, or a larger blend and round", vertices, key);
  return remesher.mesh();
}

}  // namespace pellicle::meshing
