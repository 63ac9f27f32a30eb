#include "io/solid_drawing.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkTypeInt64Array.h>

#include <array>

namespace pellicle {
inline namespace io {

namespace {

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
  const Facets facets = facets_of(solid.shape, half);
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
