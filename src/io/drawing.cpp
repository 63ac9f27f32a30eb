#include "io/drawing.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataSetAttributes.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkTypeInt64Array.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <utility>

#include "parallel/collective.h"

namespace pellicle::io {

namespace {

template <class Array>
vtkSmartPointer<Array> named_array(const char* name) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  return array;
}

vtkSmartPointer<vtkDoubleArray> double_array(const DrawnField& field, std::size_t tuples) {
  auto array = named_array<vtkDoubleArray>(field.name.c_str());
  array->SetNumberOfComponents(field.components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(tuples));
  return array;
}

/// A named array of the numbers 0, 1, 2, ..., of which there are `count`.
vtkSmartPointer<vtkTypeInt64Array> numbers(const char* name, vtkIdType count) {
  auto array = named_array<vtkTypeInt64Array>(name);
  for (vtkIdType i = 0; i < count; ++i) {
    array->InsertNextValue(i);
  }
  return array;
}

/// Adds the data that identify points and cells: persistent ids of the points, with marks on those that another rank
/// counts; the rank of the cells, and `of_cells`.
void add_identity(MPI_Comm comm, const std::vector<DrawnPoint>& points, vtkDataArray* of_cells, vtkPolyData* piece) {
  const auto ids = named_array<vtkTypeInt64Array>("vertex_id");
  const auto ghost = named_array<vtkUnsignedCharArray>(vtkDataSetAttributes::GhostArrayName());
  ids->Allocate(static_cast<vtkIdType>(points.size()));
  ghost->Allocate(static_cast<vtkIdType>(points.size()));
  for (const DrawnPoint& point : points) {
    ids->InsertNextValue(point.id);
    ghost->InsertNextValue(point.is_owned ? 0 : vtkDataSetAttributes::DUPLICATEPOINT);
  }
  piece->GetPointData()->AddArray(ids);
  piece->GetPointData()->AddArray(ghost);
  const auto rank = named_array<vtkIntArray>("rank");
  rank->SetNumberOfValues(of_cells->GetNumberOfTuples());
  rank->FillValue(rank_of(comm));
  piece->GetCellData()->AddArray(rank);
  piece->GetCellData()->AddArray(of_cells);
}

/// Adds the texture coordinates of the points, if the mesh has any, as ParaView wants them: its writer of PLY crashes
/// unless they are of type float, and looks for them by this name. Collective.
void add_uv(const Surface& set, const std::vector<DrawnPoint>& points, vtkPolyData* piece) {
  if (on_any_rank(set.comm(), set.uv.cols() > 0)) {  // A rank without particles writes the array too.
    const auto uv = named_array<vtkFloatArray>("TCoords");
    uv->SetNumberOfComponents(2);
    uv->SetNumberOfTuples(static_cast<vtkIdType>(points.size()));
    vtkIdType number = 0;
    for (const DrawnPoint& point : points) {
      Eigen::Vector2d value = point.centre_share * set.uv.col(point.lattice);
      for (std::size_t k = 0; k < 4; ++k) {
        value += (point.weights[k] - point.centre_share / 4) * set.uv.col(point.particles[k]);
      }
      uv->SetTuple(number++, value.data());
    }
    piece->GetPointData()->SetTCoords(uv);
  }
}

/// Values of the points of a drawing.
vtkSmartPointer<vtkDoubleArray> at_points(const Drawing& drawing, const DrawnField& field) {
  auto array = double_array(field, drawing.points.size());
  double* value = array->GetPointer(0);
  for (const DrawnPoint& point : drawing.points) {
    const double centre_share = field.is_of_both_layers ? point.centre_share : 0;
    for (int component = 0; component < field.components; ++component) {
      *value = 0;
      const auto add = [&](double weight, PetscInt particle) {
        if (weight != 0) {  // The particle of no weight may be any, and its value no number.
          *value += weight * field.values[field.components * particle + component];
        }
      };
      for (std::size_t k = 0; k < 4; ++k) {
        add(point.weights[k] - centre_share / 4, point.particles[k]);
      }
      add(centre_share, point.lattice);
      ++value;
    }
  }
  return array;
}

}  // namespace

std::vector<DrawnField> drawn_fields(const FieldRegistry& state, Item item) {
  std::vector<DrawnField> fields;
  for (const FieldRegistry::Entry& entry : state.entries()) {
    const FieldDeclaration& declaration = entry.declaration;
    if (declaration.item != item || declaration.drawn == Drawn::no) {
      continue;
    }
    const auto* const* field = std::get_if<Field*>(&entry.storage);
    const double* values = field != nullptr ? (*field)->data() : std::get<std::vector<double>*>(entry.storage)->data();
    fields.push_back({declaration.name, entry.components, values, declaration.drawn == Drawn::of_both_layers});
  }
  return fields;
}

Drawing drawing_of(const Surface& surface, DrawnSurface drawn) {
  Drawing drawing;
  drawing.points = std::move(drawn.points);
  drawing.items = std::move(drawn.elements);
  drawing.skeleton = vtkSmartPointer<vtkPolyData>::New();
  const auto cell_id = named_array<vtkTypeInt64Array>("cell_id");
  const auto count = static_cast<vtkIdType>(drawn.triangles.size());
  cell_id->Allocate(count);
  vtkNew<vtkCellArray> triangles;
  triangles->AllocateExact(count, 3 * count);
  for (std::size_t t = 0; t < drawn.triangles.size(); ++t) {
    const auto& [a, b, c] = drawn.triangles[t];
    const vtkIdType triangle[] = {a, b, c};
    triangles->InsertNextCell(3, triangle);
    cell_id->InsertNextValue(surface.element_id[drawing.items[t]]);
  }
  drawing.skeleton->SetPolys(triangles);
  add_identity(surface.comm(), drawing.points, cell_id, drawing.skeleton);
  add_uv(surface, drawing.points, drawing.skeleton);
  return drawing;
}

Drawing drawing_of_springs(const Sheet& sheet, const ActiveSet& active) {
  Drawing drawing;
  std::vector<vtkIdType> point_of(sheet.particles.local(), -1);
  // The points are particles, numbered in the order in which they are first used.
  const auto number = [&](PetscInt particle) {
    if (point_of[particle] < 0) {
      point_of[particle] = static_cast<vtkIdType>(drawing.points.size());
      DrawnPoint& point = drawing.points.emplace_back();
      point.particles[0] = particle;
      point.weights[0] = 1;
      point.id = sheet.persistent_id[particle];
      point.is_owned = particle < sheet.particles.owned;
    }
    return point_of[particle];
  };
  drawing.skeleton = vtkSmartPointer<vtkPolyData>::New();
  const auto colour_of_line = named_array<vtkIntArray>("colour");
  vtkNew<vtkCellArray> lines;
  PetscInt item = 0;
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    for (std::size_t spring = 0; spring < static_cast<std::size_t>(springs.owned()); ++spring, ++item) {
      if (sheet.acts(colour) && active.springs[static_cast<std::size_t>(colour)][spring]) {
        const vtkIdType line[] = {number(springs.ends[spring][0]), number(springs.ends[spring][1])};
        lines->InsertNextCell(2, line);
        colour_of_line->InsertNextValue(static_cast<int>(colour));
        drawing.items.push_back(item);
      }
    }
  }
  // A point counts on the rank that owns its particle, also where other ranks own all springs at it.
  const std::vector<bool> has_springs = particles_with_springs(sheet, active);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    if (has_springs[i] && (sheet.layers == 2 || !sheet.is_lattice[i])) {
      number(i);
    }
  }
  drawing.skeleton->SetLines(lines);
  add_identity(sheet.comm(), drawing.points, colour_of_line, drawing.skeleton);
  return drawing;
}

vtkSmartPointer<vtkPolyData> drawn(const Drawing& drawing, const double* positions,
                                   const std::vector<DrawnField>& particle_fields,
                                   const std::vector<DrawnField>& cell_fields) {
  auto piece = vtkSmartPointer<vtkPolyData>::New();
  piece->ShallowCopy(drawing.skeleton);
  vtkNew<vtkPoints> points;
  points->SetData(at_points(drawing, {"Points", 3, positions}));
  piece->SetPoints(points);
  for (const DrawnField& field : particle_fields) {
    piece->GetPointData()->AddArray(at_points(drawing, field));
  }
  for (const DrawnField& field : cell_fields) {
    const auto array = double_array(field, drawing.items.size());
    double* value = array->GetPointer(0);
    for (const PetscInt item : drawing.items) {
      value = std::copy_n(field.values + field.components * item, field.components, value);
    }
    piece->GetCellData()->AddArray(array);
  }
  return piece;
}

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

}  // namespace pellicle::io
