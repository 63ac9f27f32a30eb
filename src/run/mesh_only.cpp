#include <fmt/format.h>
#include <vtkMeshQuality.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkQuad.h>
#include <vtkTriangle.h>

#include <algorithm>
#include <limits>

#include "ablation/cut_surface.h"
#include "base/error.h"
#include "io/console.h"
#include "io/frame_writer.h"
#include "parallel/collective.h"
#include "run/run.h"
#include "state/hdf5_file.h"
#include "state/mesh_tables.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "world/load_mesh.h"
#include "world/object.h"

namespace pellicle::run {

namespace {

/// A figure of a cell's shape.
struct QualityMeasure {
  const char* name;
  double (*of_triangle)(vtkCell*);
  double (*of_quad)(vtkCell*);
  bool small_is_bad;
};

const std::array<QualityMeasure, 5> quality_measures{
    {{"radius_ratio", vtkMeshQuality::TriangleRadiusRatio, vtkMeshQuality::QuadRadiusRatio, false},
     {"aspect_ratio", vtkMeshQuality::TriangleAspectRatio, vtkMeshQuality::QuadAspectRatio, false},
     {"scaled_jacobian", vtkMeshQuality::TriangleScaledJacobian, vtkMeshQuality::QuadScaledJacobian, true},
     {"smallest_angle", vtkMeshQuality::TriangleMinAngle, vtkMeshQuality::QuadMinAngle, true},
     {"area", vtkMeshQuality::TriangleArea, vtkMeshQuality::QuadArea, true}}};

using Quality = std::array<std::vector<double>, quality_measures.size()>;

/// Every measure of every local element.
Quality quality_of(const Surface& mesh) {
  vtkNew<vtkTriangle> triangle;
  vtkNew<vtkQuad> quad;
  vtkCell* const shape = mesh.has_quads() ? static_cast<vtkCell*>(quad) : triangle;
  Quality quality;
  for (PetscInt e = 0; e < mesh.elements.local(); ++e) {
    for (int k = 0; k < mesh.sides_per_element(); ++k) {
      shape->Points->SetPoint(k, mesh.rest.col(mesh.corner(e, k)).data());
    }
    for (std::size_t measure = 0; measure < quality.size(); ++measure) {
      const QualityMeasure& of = quality_measures[measure];
      quality[measure].push_back((mesh.has_quads() ? of.of_quad : of.of_triangle)(shape));
    }
  }
  return quality;
}

/// "radius_ratio: mean 1.02, worst 1.3; ...", over the owned cells of all ranks. Collective.
std::string quality_line(MPI_Comm comm, const Quality& quality, PetscInt owned) {
  std::string line = "quality:";
  for (std::size_t measure = 0; measure < quality.size(); ++measure) {
    const bool small_is_bad = quality_measures[measure].small_is_bad;
    const double sign = small_is_bad ? -1 : 1;
    std::array<double, 2> sums{0, static_cast<double>(owned)};
    double worst = -std::numeric_limits<double>::max();
    for (PetscInt cell = 0; cell < owned; ++cell) {
      const double value = quality[measure][cell];
      sums[0] += value;
      worst = std::max(worst, sign * value);
    }
    sums = sum_over_ranks(comm, sums);
    worst = max_over_ranks(comm, worst);
    line += fmt::format("{} {} mean {:.4g}, {} {:.4g}", measure == 0 ? "" : ";", quality_measures[measure].name,
                        sums[0] / sums[1], small_is_bad ? "smallest" : "largest", sign * worst);
  }
  return line;
}

/// Prints the figures of a distributed mesh and writes it as an object of a frame. Collective.
void write_frame(const Surface& mesh, FrameWriter& writer, std::size_t object, const std::string& heading,
                 Console& console) {
  const Drawing surface = drawing_of(mesh, whole_surface(mesh));
  const Quality quality = quality_of(mesh);
  console.say(heading + quality_line(mesh.comm(), quality, mesh.elements.owned));
  console.say(heading + partition_line(mesh));
  Frame frame;
  frame.surface = &surface;
  frame.positions = mesh.rest.data();
  for (std::size_t measure = 0; measure < quality.size(); ++measure) {
    frame.cell_fields.push_back({quality_measures[measure].name, 1, quality[measure].data()});
  }
  writer.write(object, frame);
}

/// Writes the mesh with its partition, so that runs can read it in parallel. Collective.
void write_mesh_file(const MeshRows& rows, const std::string& name, OutputFolder& folder, Console& console) {
  on_root(folder.comm(), [&] { folder.list({name}); });
  Hdf5File file(folder.comm(), folder.path_of_part(name), Hdf5File::Mode::create);
  write_mesh(file, mesh_file_group, rows);
  file.close();
  on_root(folder.comm(), [&] { folder.put_in_place(name); });
  console.say(folder.path(name));
}

}  // namespace

void mesh_only(MPI_Comm comm, const RunPlan& plan, RunRecord record) {
  const std::deque<NamedOptions>& objects = plan.objects;
  OutputOptions output = objects.front().options.output;
  output.fields.clear();  // they name fields of a run
  Console console(comm, 1);
  OutputFolder folder(comm, output, record);
  std::vector<LoadedMesh> meshes;
  std::vector<FramePart> parts;
  for (const NamedOptions& object : objects) {
    meshes.push_back(about_object(object.name, [&] { return load_mesh(comm, object.options); }));
    parts.push_back({object.name, key_of(object.name)});
    add_lines(record.mesh, object.name, meshes.back().lines);
  }
  console.tell(record.mesh);
  console.tell(plan.lines());
  FrameWriter writer(folder, output, parts);
  writer.reserve_names();
  std::vector<MeshRows> rows;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const std::string heading = heading_of(objects[i].name);
    const SheetOptions options = shell_options(objects[i].options);
    LoadedMesh& loaded = meshes[i];
    for (const std::string& line : loaded.figures) {
      console.say(heading + line);
    }
    if (loaded.rows.corners == 4) {
      const Sheet sheet = make_sheet(comm, std::move(loaded.rows), options);
      write_frame(sheet, writer, i, heading, console);
      rows.push_back(rows_of_mesh(sheet));
    } else {
      const Membrane membrane = make_membrane(comm, std::move(loaded.rows), options).membrane;
      write_frame(membrane, writer, i, heading, console);
      rows.push_back(rows_of(membrane, {}, {}));
    }
  }
  writer.complete(0, 0);
  console.say(output.directory + "/" + output.name + ".pvd");
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const std::string& object = objects[i].name;  // "sheet.mesh.h5", or of one of several "world_sheet.mesh.h5"
    write_mesh_file(rows[i], output.name + (object.empty() ? "" : "_" + object) + ".mesh.h5", folder, console);
  }
}

}  // namespace pellicle::run
