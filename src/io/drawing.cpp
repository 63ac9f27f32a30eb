#include "io/drawing.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataSetAttributes.h>
#include <vtkDoubleArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkTypeInt64Array.h>
#include <vtkUnsignedCharArray.h>

namespace pellicle {

namespace {

vtkSmartPointer<vtkDoubleArray> double_array(const std::string& name, int components, std::size_t tuples) {
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(tuples));
  return array;
}

template <class Array>
vtkSmartPointer<Array> named_array(const char* name) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  return array;
}

/// Data that never change: of the points persistent ids and the marks of what other ranks own, of the cells the rank
/// and `of_cells`.
void add_identity(const PointSet& points, const std::vector<PetscInt>& particles, vtkDataArray* of_cells,
                  vtkPolyData* piece) {
  const auto ids = named_array<vtkTypeInt64Array>("vertex_id");
  const auto ghost = named_array<vtkUnsignedCharArray>(vtkDataSetAttributes::GhostArrayName());
  for (const PetscInt particle : particles) {
    ids->InsertNextValue(points.persistent_id[static_cast<std::size_t>(particle)]);
    ghost->InsertNextValue(particle < points.particles.owned ? 0 : vtkDataSetAttributes::DUPLICATEPOINT);
  }
  piece->GetPointData()->AddArray(ids);
  piece->GetPointData()->AddArray(ghost);
  int own_rank = 0;
  MPI_Comm_rank(points.comm(), &own_rank);
  const auto rank = named_array<vtkIntArray>("rank");
  rank->SetNumberOfValues(of_cells->GetNumberOfTuples());
  rank->FillValue(own_rank);
  piece->GetCellData()->AddArray(rank);
  piece->GetCellData()->AddArray(of_cells);
}

/// Local numbers 0, 1, 2, ... for particles in the order in which they are first used.
class Numbering {
 public:
  explicit Numbering(PetscInt particles) : number_(static_cast<std::size_t>(particles), -1) {}

  vtkIdType operator()(PetscInt particle) {
    vtkIdType& number = number_[static_cast<std::size_t>(particle)];
    if (number < 0) {
      number = static_cast<vtkIdType>(particles_.size());
      particles_.push_back(particle);
    }
    return number;
  }
  const std::vector<PetscInt>& particles() const { return particles_; }

 private:
  std::vector<vtkIdType> number_;
  std::vector<PetscInt> particles_;
};

/// Adds the texture coordinates of the points, if the mesh has any. Collective.
void add_uv(const PointSet& points, const std::vector<PetscInt>& particles, vtkPolyData* piece) {
  const PetscInt any_uv = points.uv.cols() > 0 ? 1 : 0;
  PetscInt uv_somewhere = 0;  // A rank without particles writes the array too.
  MPI_Allreduce(&any_uv, &uv_somewhere, 1, MPIU_INT, MPI_MAX, points.comm());
  if (uv_somewhere != 0) {
    const auto uv = double_array("uv", 2, particles.size());
    for (std::size_t point = 0; point < particles.size(); ++point) {
      uv->SetTuple(static_cast<vtkIdType>(point), points.uv.col(particles[point]).data());
    }
    piece->GetPointData()->SetTCoords(uv);
  }
}

/// Values of the points of a drawing.
vtkSmartPointer<vtkDoubleArray> at_points(const Drawing& drawing, const DrawnField& field) {
  const int components = field.components;
  auto array = double_array(field.name, components, drawing.particles.size() + drawing.centre_of.size());
  vtkIdType point = 0;
  for (const PetscInt particle : drawing.particles) {
    array->SetTuple(point++, field.values + components * particle);
  }
  for (const auto& corners : drawing.centre_of) {
    for (int component = 0; component < components; ++component) {
      double sum = 0;
      for (const PetscInt corner : corners) {
        sum += field.values[components * corner + component];
      }
      array->SetComponent(point, component, sum / 4);
    }
    ++point;
  }
  return array;
}

}  // namespace

Drawing drawing_of(const Sheet& sheet) {
  Numbering number(sheet.particles.local());
  const auto owned_cells = static_cast<std::size_t>(sheet.owned_cells);
  for (std::size_t cell = 0; cell < owned_cells; ++cell) {
    for (const PetscInt corner : sheet.cells[cell]) {
      number(corner);
    }
  }
  Drawing drawing;
  drawing.particles = number.particles();
  drawing.skeleton = vtkSmartPointer<vtkPolyData>::New();
  const auto cell_id = named_array<vtkTypeInt64Array>("cell_id");
  std::vector<PetscInt> points = drawing.particles;
  vtkNew<vtkCellArray> triangles;
  for (std::size_t cell = 0; cell < owned_cells; ++cell) {
    const auto centre = static_cast<vtkIdType>(points.size());
    points.push_back(sheet.lattice[cell]);
    drawing.centre_of.push_back(sheet.cells[cell]);
    const PetscInt id = sheet.persistent_id[static_cast<std::size_t>(sheet.lattice[cell])] - sheet.first_lattice_id;
    for (std::size_t edge = 0; edge < 4; ++edge) {
      const vtkIdType triangle[] = {number(sheet.cells[cell][edge]), number(sheet.cells[cell][(edge + 1) % 4]), centre};
      triangles->InsertNextCell(3, triangle);
      cell_id->InsertNextValue(id);
      drawing.items.push_back(static_cast<PetscInt>(cell));
    }
  }
  drawing.skeleton->SetPolys(triangles);
  add_identity(sheet, points, cell_id, drawing.skeleton);
  add_uv(sheet, points, drawing.skeleton);
  return drawing;
}

Drawing drawing_of(const Membrane& membrane) {
  Numbering number(membrane.particles.local());
  Drawing drawing;
  drawing.skeleton = vtkSmartPointer<vtkPolyData>::New();
  const auto cell_id = named_array<vtkTypeInt64Array>("cell_id");
  vtkNew<vtkCellArray> triangles;
  for (PetscInt element = 0; element < membrane.elements.owned; ++element) {
    const auto& corners = membrane.triangles[static_cast<std::size_t>(element)];
    const vtkIdType triangle[] = {number(corners[0]), number(corners[1]), number(corners[2])};
    triangles->InsertNextCell(3, triangle);
    cell_id->InsertNextValue(membrane.element_id[static_cast<std::size_t>(element)]);
    drawing.items.push_back(element);
  }
  drawing.particles = number.particles();
  drawing.skeleton->SetPolys(triangles);
  add_identity(membrane, drawing.particles, cell_id, drawing.skeleton);
  add_uv(membrane, drawing.particles, drawing.skeleton);
  return drawing;
}

Drawing drawing_of_springs(const Sheet& sheet) {
  Numbering number(sheet.particles.local());
  Drawing drawing;
  drawing.skeleton = vtkSmartPointer<vtkPolyData>::New();
  const auto colour_of_line = named_array<vtkIntArray>("colour");
  vtkNew<vtkCellArray> lines;
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    for (std::size_t spring = 0; spring < static_cast<std::size_t>(springs.owned()); ++spring) {
      const vtkIdType line[] = {number(springs.ends[spring][0]), number(springs.ends[spring][1])};
      drawing.items.push_back(static_cast<PetscInt>(lines->InsertNextCell(2, line)));
      colour_of_line->InsertNextValue(static_cast<int>(colour));
    }
  }
  drawing.particles = number.particles();
  drawing.skeleton->SetLines(lines);
  add_identity(sheet, drawing.particles, colour_of_line, drawing.skeleton);
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
    const auto array = double_array(field.name, field.components, drawing.items.size());
    vtkIdType cell = 0;
    for (const PetscInt item : drawing.items) {
      array->SetTuple(cell++, field.values + field.components * item);
    }
    piece->GetCellData()->AddArray(array);
  }
  return piece;
}

}  // namespace pellicle
