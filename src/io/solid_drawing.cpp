#include "io/solid_drawing.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkTypeInt64Array.h>

#include <array>
#include <cmath>
#include <vector>

#include "geometry/pi.h"

namespace pellicle {
inline namespace io {

namespace {

/// Points in a solid's own frame, and triangles with normals outward.
struct Facets {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
};

constexpr int around = 64;  ///< points round an axis

/// Turns a line of places (distance from the z axis, height) round it, from below to above.
Facets revolved(const std::vector<Eigen::Vector2d>& line) {
  Facets facets;
  for (const Eigen::Vector2d& place : line) {
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * pi * i / around;
      facets.points.emplace_back(place.x() * std::cos(angle), place.x() * std::sin(angle), place.y());
    }
  }
  for (int k = 0; k + 1 < static_cast<int>(line.size()); ++k) {
    for (int i = 0; i < around; ++i) {
      const int next = (i + 1) % around;
      const int a = around * k + i;
      const int b = around * k + next;
      const int c = around * (k + 1) + next;
      const int d = around * (k + 1) + i;
      facets.triangles.push_back({a, b, c});
      facets.triangles.push_back({a, c, d});
    }
  }
  return facets;
}

/// Adds an arc round (x, z) from one angle to another, 0 along x.
void add_arc(std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& centre, double radius, double from, double to) {
  constexpr int parts = 24;
  for (int i = 0; i <= parts; ++i) {
    const double angle = from + (to - from) * i / parts;
    line.push_back(centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
}

struct FacetsOf {
  double half_plane;

  Facets operator()(const Sphere& sphere) const {
    std::vector<Eigen::Vector2d> line;
    add_arc(line, {0, 0}, sphere.radius, -pi / 2, pi / 2);
    return revolved(line);
  }
  Facets operator()(const HalfSpace&) const {
    const double h = half_plane;
    return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  }
  Facets operator()(const Box& box) const {
    Facets facets;
    for (int i = 0; i < 8; ++i) {
      facets.points.emplace_back(((i & 1) != 0 ? 1 : -1) * box.half[0], ((i & 2) != 0 ? 1 : -1) * box.half[1],
                                 ((i & 4) != 0 ? 1 : -1) * box.half[2]);
    }
    facets.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                        {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return facets;
  }
  Facets operator()(const Capsule& capsule) const {
    std::vector<Eigen::Vector2d> line;
    add_arc(line, {0, -capsule.half}, capsule.radius, -pi / 2, 0);
    add_arc(line, {0, capsule.half}, capsule.radius, 0, pi / 2);
    return revolved(line);
  }
  Facets operator()(const Cylinder& cylinder) const {
    return revolved(
        {{0, -cylinder.half}, {cylinder.radius, -cylinder.half}, {cylinder.radius, cylinder.half}, {0, cylinder.half}});
  }
  Facets operator()(const Ring& ring) const {
    std::vector<Eigen::Vector2d> line;
    add_arc(line, {ring.radius, 0}, ring.tube, -pi, pi);
    return revolved(line);
  }
  Facets operator()(const std::shared_ptr<const ClosedMesh>& mesh) const { return {mesh->points(), mesh->triangles()}; }
};

/// 0, 1, 2, ...
vtkSmartPointer<vtkTypeInt64Array> numbers(const char* name, vtkIdType count) {
  auto array = vtkSmartPointer<vtkTypeInt64Array>::New();
  array->SetName(name);
  for (vtkIdType i = 0; i < count; ++i) {
    array->InsertNextValue(i);
  }
  return array;
}

}  // namespace

vtkSmartPointer<vtkPolyData> drawing_of_solid(const Solid& solid, double half) {
  const Facets facets = std::visit(FacetsOf{half}, solid.shape);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& point : facets.points) {
    points->InsertNextPoint(solid.pose.to_world(point).data());
  }
  vtkNew<vtkCellArray> cells;
  for (const std::array<int, 3>& triangle : facets.triangles) {
    cells->InsertNextCell({triangle[0], triangle[1], triangle[2]});
  }
  auto drawing = vtkSmartPointer<vtkPolyData>::New();
  drawing->SetPoints(points);
  drawing->SetPolys(cells);
  drawing->GetPointData()->AddArray(numbers("vertex_id", points->GetNumberOfPoints()));
  drawing->GetCellData()->AddArray(numbers("cell_id", cells->GetNumberOfCells()));
  return drawing;
}

}  // namespace io
}  // namespace pellicle
