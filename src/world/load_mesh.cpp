#include "world/load_mesh.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "meshing/mesh_options.h"
#include "meshing/triangulation.h"
#include "state/hdf5_file.h"
#include "state/mesh_tables.h"

namespace pellicle::world {

namespace {

/// Describes the fault that a chamber needs a volume, which an open mesh does not have; empty if none does. Chambers
/// that name their pieces are left to `Chambers`.
std::string fault_of_chambers(const Options& options) {
  const auto names_a_piece = [](const auto& chamber) { return chamber.second.vertex >= 0; };
  if (!options.symmetry.empty() || std::any_of(options.chambers.begin(), options.chambers.end(), names_a_piece)) {
    return "";
  }
  for (const auto& [name, chamber] : options.chambers) {
    if (chamber.law != GasLaw::pressure && !chamber.hole_discharge) {
      return "chambers." + name + ".law: " + chamber.law.name() + " needs a volume, expected a closed mesh" +
             (options.chain == ChainKind::inflate ? ", symmetry planes" : "") + ", hole_discharge or the law pressure";
    }
  }
  return "";
}

/// Names the options that a mesh without texture coordinates makes impossible: those that put a picture on it.
std::vector<std::string> faults_without_uv(const Options& options) {
  std::vector<std::pair<std::string, std::string>> pictures;  // the key of each and its file, or none
  if (options.chain == ChainKind::burn) {
    pictures = {{"combustion.mass_loss_texture", options.combustion.mass_loss_texture},
                {"heat.diffusivity_texture", options.heat.diffusivity_texture},
                {"project.weight_texture", options.project.weight_texture},
                {"ablation.strength_texture", options.ablation.strength_texture},
                {"sheet.tensile_texture", options.material.tensile_texture},
                {"sheet.shear_texture", options.material.shear_texture},
                {"sheet.bending_texture", options.material.bending_texture}};
    for (const auto& [name, source] : options.heat.sources) {
      pictures.emplace_back("heat.sources." + name + ".file", source.file);
    }
  } else {
    pictures = {{"wall.thickness_texture", options.wall.thickness_texture}};
  }
  std::vector<std::string> faults;
  for (const auto& [key, file] : pictures) {
    if (!file.empty()) {
      faults.push_back(key + ": " + file +
                       " needs texture coordinates, and the mesh has none, expected a mesh with them" +
                       (key.find("heat.sources.") == 0 ? "" : " or -" + command_line_name(key) + " \"\""));
    }
  }
  return faults;
}

/// @throws Error of these faults, if there are any, with the remarks on the mesh
void refuse(const std::string& summary, std::vector<std::string> faults, const std::vector<std::string>& remarks = {}) {
  if (!faults.empty()) {
    faults.insert(faults.end(), remarks.begin(), remarks.end());
    throw Error(fmt::format("{}; {}", summary, fmt::join(faults, "; ")));
  }
}

/// Refuses a mesh on which the run's chain cannot be built, or to which its textures cannot be put.
/// @throws Error, one line that describes the mesh and names all its faults
void require_fit(const CheckedMesh& checked, const Options& options) {
  std::vector<std::string> faults{options.chain == ChainKind::burn ? fault_of_quads(checked.mesh) : "",
                                  checked.report.boundary_edges > 0 ? fault_of_chambers(options) : ""};
  if (checked.mesh.uv.empty()) {
    const std::vector<std::string> of_textures = faults_without_uv(options);
    faults.insert(faults.end(), of_textures.begin(), of_textures.end());
  }
  faults.erase(std::remove(faults.begin(), faults.end(), ""), faults.end());
  refuse(checked.report.summary(), faults, checked.mesh.remarks);
}

/// The lines about a mesh that are printed (LoadedMesh::lines).
std::vector<std::string> mesh_lines(const MeshReport& report, const Options& options) {
  std::vector<std::string> lines{report.summary()};
  const std::vector<std::string> remarks = report.remarks();
  lines.insert(lines.end(), remarks.begin(), remarks.end());
  if (options.chain == ChainKind::inflate && report.boundary_edges > 0) {
    lines.push_back(
        "warning: an open mesh under chain: inflate: unless symmetry planes close it, its gas needs a "
        "prescribed pressure, or hole_discharge to flow through what is open");
  }
  const auto inner_chambers = std::count_if(options.chambers.begin(), options.chambers.end(),
                                            [](const auto& chamber) { return !chamber.second.inside.empty(); });
  if (const int count = report.nested.count; count > inner_chambers) {
    const auto [inner, outer] = report.nested.first;
    const std::string of_outer = " (of vertex " + std::to_string(outer) + ")";
    lines.push_back("warning: " +
                    (count == 1
                         ? "a closed piece (of vertex " + std::to_string(inner) + ") lies inside another" + of_outer
                         : std::to_string(count) + " closed pieces (the first of vertex " + std::to_string(inner) +
                               ") lie inside others" + of_outer) +
                    ": the volume is the sum of theirs, and the gas round the inner wall does not press on it, unless "
                    "chambers say so (chambers.NAME.vertex, and inside of the inner one)");
  }
  return lines;
}

/// Collective.
LoadedMesh read_mesh_file(MPI_Comm comm, const Options& options) {
  LoadedMesh loaded;
  const Hdf5File file(comm, options.mesh.file, Hdf5File::Mode::read);
  loaded.rows = read_mesh(file, mesh_file_group);
  const MeshRows& rows = loaded.rows;
  const std::string cells = rows.corners == 3 ? " triangles" : " quads";
  const std::string summary = options.mesh.file + ": " +
                              std::to_string(file.rows(std::string(mesh_file_group) + "/vertices/id")) + " points, " +
                              std::to_string(file.rows(std::string(mesh_file_group) + "/cells/id")) + cells;
  loaded.lines = {summary};
  std::vector<std::string> faults = rows.has_uv ? std::vector<std::string>{} : faults_without_uv(options);
  if (options.chain == ChainKind::burn && rows.corners != 4 && !options.mesh_only) {
    faults.emplace_back("a burning sheet needs quads");
  }
  if (options.chain == ChainKind::inflate && rows.corners != 3) {
    faults.emplace_back("expected triangles, which -mesh_only writes of any mesh with -chain inflate");
  }
  refuse(summary, faults);
  return loaded;
}

}  // namespace

LoadedMesh load_mesh(MPI_Comm comm, const Options& options) {
  if (options.mesh.has_partition()) {
    return read_mesh_file(comm, options);
  }
  CheckedMesh checked;
  on_root(comm, [&] {
    checked = make_checked_mesh(options.mesh);
    if (!options.mesh_only) {
      require_fit(checked, options);
    }
    if (options.chain == ChainKind::inflate || !fault_of_quads(checked.mesh).empty()) {
      checked.mesh = triangulated(checked.mesh);
    }
  });
  return {rows_of(comm, checked.mesh), mesh_lines(checked.report, options), {checked.report.quality()}};
}

std::string partition_line(const Surface& points) {
  return fmt::format("ranks: {}; partition: edge cut {}, imbalance {:.3f}", ranks_of(points.comm()),
                     static_cast<int>(points.partition.edge_cut), points.partition.imbalance);
}

}  // namespace pellicle::world
