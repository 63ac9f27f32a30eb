#include "mesh/shell.h"

#include <petscdmplex.h>
#include <petscsf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "base/error.h"
#include "base/handle.h"
#include "mesh/partition.h"

namespace pellicle {

namespace {

using DmHandle = Handle<DM, DMDestroy>;
using SfHandle = Handle<PetscSF, PetscSFDestroy>;

/// All that rank 0 knows of one mesh point (cell or vertex) and sends to the ranks that hold it.
struct PointData {
  double position[3];  ///< of the vertex, or of the cell's lattice point
  double uv[2];
  double mass;
  double id;           ///< number in the file
  double vertices[4];  ///< numbers in the mesh: of a cell its corners, of a vertex [0] itself
};
constexpr int point_data_doubles = sizeof(PointData) / sizeof(double);

/// Cells joined by common edges, weighted for the partitioner.
CellGraph cell_graph(const SurfaceMesh& mesh, const std::string& weights) {
  std::unordered_map<std::int64_t, std::array<int, 2>> cells_of_edge;
  cells_of_edge.reserve(2 * mesh.faces.size());
  const auto count = static_cast<int>(mesh.faces.size());
  const auto edge_key = [](int a, int b) { return (static_cast<std::int64_t>(std::min(a, b)) << 32) | std::max(a, b); };
  for (int cell = 0; cell < count; ++cell) {
    const auto& face = mesh.faces[static_cast<std::size_t>(cell)];
    for (std::size_t k = 0; k < face.size(); ++k) {
      const auto [entry, is_new] =
          cells_of_edge.try_emplace(edge_key(face[k], face[(k + 1) % face.size()]), std::array<int, 2>{cell, -1});
      if (!is_new) {
        entry->second[1] = cell;
      }
    }
  }
  CellGraph graph;
  graph.offsets.push_back(0);
  for (int cell = 0; cell < count; ++cell) {
    const auto& face = mesh.faces[static_cast<std::size_t>(cell)];
    for (std::size_t k = 0; k < face.size(); ++k) {
      const auto& [first, second] = cells_of_edge.at(edge_key(face[k], face[(k + 1) % face.size()]));
      const int neighbour = first == cell ? second : first;
      if (neighbour >= 0) {
        graph.neighbours.push_back(neighbour);
      }
    }
    const int neighbours = static_cast<int>(graph.neighbours.size()) - graph.offsets.back();
    graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
    // In half springs: four red and two yellow of its own, an edge shared with a neighbour has half a blue and half a
    // green one, a boundary edge has one blue.
    graph.weights.push_back(weights == "cells" ? 1 : 12 + 2 * neighbours + 2 * (4 - neighbours));
  }
  return graph;
}

/// What rank 0 sends: data of every DMPlex point in its numbering, cells first, then vertices.
std::vector<PointData> point_data(const SurfaceMesh& mesh, const SheetOptions& options) {
  const std::size_t cells = mesh.faces.size();
  std::vector<PointData> data(cells + mesh.points.size(), PointData{});
  for (std::size_t vertex = 0; vertex < mesh.points.size(); ++vertex) {
    PointData& point = data[cells + vertex];
    Eigen::Map<Eigen::Vector3d>(point.position) = mesh.points[vertex];
    point.id = mesh.id_of_point(static_cast<int>(vertex));
    point.vertices[0] = static_cast<double>(vertex);
  }
  std::vector<bool> has_uv(mesh.points.size(), false);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const auto& face = mesh.faces[cell];
    const std::array<Eigen::Vector3d, 4> corner{
        mesh.points[static_cast<std::size_t>(face[0])], mesh.points[static_cast<std::size_t>(face[1])],
        mesh.points[static_cast<std::size_t>(face[2])], mesh.points[static_cast<std::size_t>(face[3])]};
    const Eigen::Vector3d twice_area = (corner[2] - corner[0]).cross(corner[3] - corner[1]);
    const Eigen::Vector3d normal = twice_area.normalized();
    const Eigen::Vector3d centre = (corner[0] + corner[1] + corner[2] + corner[3]) / 4;
    const double mass = options.areal_density * twice_area.norm() / 2;
    PointData& lattice = data[cell];
    Eigen::Map<Eigen::Vector3d>(lattice.position) = centre + options.thickness * normal;
    lattice.mass = mass / 2;
    lattice.id = mesh.id_of_face(static_cast<int>(cell));
    for (std::size_t k = 0; k < 4; ++k) {
      const auto vertex = static_cast<std::size_t>(face[k]);
      lattice.vertices[k] = face[k];
      data[cells + vertex].mass += mass / 8;
      if (!mesh.uv.empty()) {
        const Eigen::Vector2d& uv = mesh.uv[cell][k];
        Eigen::Map<Eigen::Vector2d>(lattice.uv) += uv / 4;
        if (!has_uv[vertex]) {  // At a seam of the texture a vertex takes the side of its first face.
          has_uv[vertex] = true;
          Eigen::Map<Eigen::Vector2d>(data[cells + vertex].uv) = uv;
        }
      }
    }
  }
  return data;
}

void set_partitioner(DM dm, const SurfaceMesh& mesh, const SheetOptions& options, int rank, int ranks) {
  PetscPartitioner partitioner = nullptr;
  check(DMPlexGetPartitioner(dm, &partitioner));
  if (options.partitioner != "metis") {
    check(PetscPartitionerSetType(partitioner, options.partitioner.c_str()));
    return;
  }
  std::vector<PetscInt> sizes(static_cast<std::size_t>(ranks), 0);
  std::vector<PetscInt> cells;
  if (rank == 0) {
    const std::vector<int> part = partition_with_metis(cell_graph(mesh, options.weights), ranks);
    cells.resize(part.size());
    std::iota(cells.begin(), cells.end(), 0);
    std::stable_sort(cells.begin(), cells.end(), [&](PetscInt a, PetscInt b) {
      return part[static_cast<std::size_t>(a)] < part[static_cast<std::size_t>(b)];
    });
    for (const int p : part) {
      ++sizes[static_cast<std::size_t>(p)];
    }
  }
  check(PetscPartitionerSetType(partitioner, PETSCPARTITIONERSHELL));
  check(PetscPartitionerShellSetPartition(partitioner, ranks, sizes.data(), cells.data()));
}

/// The mesh points of this rank after distribution, with what rank 0 sent for them.
struct LocalMesh {
  DmHandle dm;
  std::vector<PointData> data;                       ///< of the points [0, number of cells and vertices)
  std::vector<std::vector<PetscInt>> group_members;  ///< for each group: 1 where the point belongs to it
};

LocalMesh distribute(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options,
                     const std::vector<std::string>& groups) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::vector<PetscInt> cells;
  std::vector<double> coordinates;
  std::vector<PointData> sent;
  if (rank == 0) {
    for (const auto& face : mesh.faces) {
      cells.insert(cells.end(), face.begin(), face.end());
    }
    for (const auto& point : mesh.points) {
      coordinates.insert(coordinates.end(), point.data(), point.data() + 3);
    }
    sent = point_data(mesh, options);
  }
  const auto cell_count = static_cast<PetscInt>(cells.size() / 4);
  const auto vertex_count = static_cast<PetscInt>(coordinates.size() / 3);
  LocalMesh local;
  check(DMPlexCreateFromCellListPetsc(comm, 2, cell_count, vertex_count, 4, PETSC_TRUE, cells.data(), 3,
                                      coordinates.data(), local.dm.create()));
  std::vector<std::vector<PetscInt>> sent_groups;
  for (const std::string& name : groups) {
    auto& members = sent_groups.emplace_back(sent.size(), 0);
    if (rank == 0) {
      for (const int vertex : mesh.groups.at(name)) {
        members[static_cast<std::size_t>(cell_count + vertex)] = 1;
      }
    }
  }
  if (ranks == 1) {
    local.data = std::move(sent);
    local.group_members = std::move(sent_groups);
    return local;
  }

  set_partitioner(local.dm, mesh, options, rank, ranks);
  DmHandle distributed;
  SfHandle migration;
  // Two layers of neighbours: a green spring's neighbours end one cell beyond the next cell.
  check(DMPlexDistribute(local.dm, 2, migration.create(), distributed.create()));
  std::swap(local.dm, distributed);
  PetscInt roots = 0;
  PetscInt first = 0;
  PetscInt last = 0;
  check(PetscSFGetGraph(migration, &roots, nullptr, nullptr, nullptr));
  check(DMPlexGetChart(local.dm, &first, &last));
  sent.resize(static_cast<std::size_t>(roots), PointData{});
  local.data.resize(static_cast<std::size_t>(last - first));
  MPI_Datatype type = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(point_data_doubles, MPI_DOUBLE, &type);
  MPI_Type_commit(&type);
  check(PetscSFBcastBegin(migration, type, sent.data(), local.data.data(), MPI_REPLACE));
  check(PetscSFBcastEnd(migration, type, sent.data(), local.data.data(), MPI_REPLACE));
  MPI_Type_free(&type);
  for (auto& members : sent_groups) {
    members.resize(static_cast<std::size_t>(roots), 0);
    auto& received = local.group_members.emplace_back(static_cast<std::size_t>(last - first), 0);
    check(PetscSFBcastBegin(migration, MPIU_INT, members.data(), received.data(), MPI_REPLACE));
    check(PetscSFBcastEnd(migration, MPIU_INT, members.data(), received.data(), MPI_REPLACE));
  }
  return local;
}

/// Which points of a distributed DMPlex other ranks own, and a way to fetch the owners' numbers.
class PointOwnership {
 public:
  explicit PointOwnership(DM dm) : comm_(PetscObjectComm(reinterpret_cast<PetscObject>(dm))) {
    PetscInt first = 0;
    check(DMPlexGetChart(dm, &first, &points_));
    check(DMGetPointSF(dm, &sf_));
    PetscInt roots = -1;
    PetscInt leaves = 0;
    const PetscInt* local = nullptr;
    check(PetscSFGetGraph(sf_, &roots, &leaves, &local, nullptr));
    owned_.assign(static_cast<std::size_t>(points_), true);
    has_graph_ = roots >= 0;
    for (PetscInt leaf = 0; leaf < leaves; ++leaf) {
      owned_[static_cast<std::size_t>(local != nullptr ? local[leaf] : leaf)] = false;
    }
  }

  bool is_owned(PetscInt point) const { return owned_[static_cast<std::size_t>(point)]; }
  PetscInt points() const { return points_; }

  /// Replaces the numbers at points of other ranks by their owners' numbers. Collective.
  void fetch(std::vector<PetscInt>& number) const {
    int ranks = 1;
    MPI_Comm_size(comm_, &ranks);
    if (ranks == 1 || !has_graph_) {
      return;
    }
    std::vector<PetscInt> roots(number);
    check(PetscSFBcastBegin(sf_, MPIU_INT, roots.data(), number.data(), MPI_REPLACE));
    check(PetscSFBcastEnd(sf_, MPIU_INT, roots.data(), number.data(), MPI_REPLACE));
  }

 private:
  MPI_Comm comm_;
  PetscSF sf_ = nullptr;
  PetscInt points_ = 0;
  bool has_graph_ = false;
  std::vector<bool> owned_;
};

/// Gives rank 0's names to every rank. Collective.
void broadcast(MPI_Comm comm, std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += name + '\0';
  }
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, 0, comm);
  names.clear();
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\0', begin) + 1) {
    names.emplace_back(text.c_str() + begin);
  }
}

/// Sets a layout's owned, first and global numbers. Collective.
void number_owned(Layout& layout, MPI_Comm comm, PetscInt owned) {
  layout.comm = comm;
  layout.owned = owned;
  MPI_Scan(&owned, &layout.first, 1, MPIU_INT, MPI_SUM, comm);
  layout.first -= owned;
  MPI_Allreduce(&owned, &layout.global, 1, MPIU_INT, MPI_SUM, comm);
}

/// A spring as it is found at a mesh point (its cell or edge), before owned ones are sorted to the front.
struct FoundSpring {
  PetscInt point;  ///< DMPlex cell (red, yellow) or edge (blue, green)
  PetscInt index;  ///< among the springs of this colour at the point
  std::array<PetscInt, 2> ends;
};

/// Orders springs owned first, numbers them, and drops those that neither end at a particle of this rank nor share one
/// with an owned spring. Collective.
SpringSet make_spring_set(MPI_Comm comm, const std::vector<FoundSpring>& found, const PointOwnership& ownership,
                          const Sheet& sheet) {
  SpringSet set;
  std::vector<PetscInt> first_at_point(static_cast<std::size_t>(ownership.points()), -1);
  std::vector<bool> needed(static_cast<std::size_t>(sheet.particles.local()), false);
  std::fill_n(needed.begin(), sheet.particles.owned, true);
  const auto add = [&](const FoundSpring& spring) {
    set.ends.push_back(spring.ends);
    set.initial_length.push_back((sheet.rest.col(spring.ends[0]) - sheet.rest.col(spring.ends[1])).norm());
  };
  for (const FoundSpring& spring : found) {
    if (ownership.is_owned(spring.point)) {
      if (spring.index == 0) {
        first_at_point[static_cast<std::size_t>(spring.point)] = static_cast<PetscInt>(set.ends.size());
      }
      add(spring);
      needed[static_cast<std::size_t>(spring.ends[0])] = true;
      needed[static_cast<std::size_t>(spring.ends[1])] = true;
    }
  }
  number_owned(set.layout, comm, static_cast<PetscInt>(set.ends.size()));
  for (PetscInt& number : first_at_point) {
    number += number >= 0 ? set.layout.first : 0;
  }
  ownership.fetch(first_at_point);
  for (const FoundSpring& spring : found) {
    const bool is_needed =
        needed[static_cast<std::size_t>(spring.ends[0])] || needed[static_cast<std::size_t>(spring.ends[1])];
    if (!ownership.is_owned(spring.point) && is_needed) {
      set.layout.ghost_global.push_back(first_at_point[static_cast<std::size_t>(spring.point)] + spring.index);
      add(spring);
    }
  }
  return set;
}

PartitionQuality partition_quality(const Sheet& sheet) {
  PartitionQuality quality;
  const SpringSet& green = sheet.of(Colour::green);
  PetscInt cut = 0;
  for (PetscInt s = 0; s < green.owned(); ++s) {
    const auto& [a, b] = green.ends[static_cast<std::size_t>(s)];
    cut += (a < sheet.particles.owned) != (b < sheet.particles.owned) ? 1 : 0;
  }
  MPI_Allreduce(&cut, &quality.edge_cut, 1, MPIU_INT, MPI_SUM, sheet.comm());
  PetscInt largest = 0;
  int ranks = 1;
  MPI_Allreduce(&sheet.owned_cells, &largest, 1, MPIU_INT, MPI_MAX, sheet.comm());
  MPI_Comm_size(sheet.comm(), &ranks);
  quality.imbalance = static_cast<double>(largest) * ranks / static_cast<double>(sheet.global_cells);
  return quality;
}

}  // namespace

Sheet make_sheet(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  Sheet sheet;
  const auto points = static_cast<PetscInt>(mesh.points.size());
  std::array<PetscInt, 4> sizes{points, static_cast<PetscInt>(mesh.faces.size()), mesh.uv.empty() ? 0 : 1,
                                points > 0 ? mesh.id_of_point(points - 1) + 1 : 0};
  MPI_Bcast(sizes.data(), 4, MPIU_INT, 0, comm);
  sheet.global_corners = sizes[0];
  sheet.global_cells = sizes[1];
  sheet.first_lattice_id = sizes[3];
  std::vector<std::string> groups;
  for (const auto& [name, members] : mesh.groups) {
    groups.push_back(name);
  }
  broadcast(comm, groups);
  const LocalMesh local = distribute(comm, mesh, options, groups);
  const PointOwnership ownership(local.dm);

  // Particles: owned corners, owned lattice points, ghost corners, ghost lattice points.
  PetscInt cell_begin = 0;
  PetscInt cell_end = 0;
  PetscInt vertex_begin = 0;
  PetscInt vertex_end = 0;
  check(DMPlexGetHeightStratum(local.dm, 0, &cell_begin, &cell_end));
  check(DMPlexGetDepthStratum(local.dm, 0, &vertex_begin, &vertex_end));
  std::vector<PetscInt> point_of_particle;
  std::vector<PetscInt> particle_of_point(static_cast<std::size_t>(ownership.points()), -1);
  const auto add_particles = [&](PetscInt begin, PetscInt end, bool owned) {
    for (PetscInt point = begin; point < end; ++point) {
      if (ownership.is_owned(point) == owned) {
        particle_of_point[static_cast<std::size_t>(point)] = static_cast<PetscInt>(point_of_particle.size());
        point_of_particle.push_back(point);
      }
    }
  };
  add_particles(vertex_begin, vertex_end, true);
  sheet.owned_corners = static_cast<PetscInt>(point_of_particle.size());
  add_particles(cell_begin, cell_end, true);
  number_owned(sheet.particles, comm, static_cast<PetscInt>(point_of_particle.size()));
  add_particles(vertex_begin, vertex_end, false);
  add_particles(cell_begin, cell_end, false);
  std::vector<PetscInt> global_of_point(particle_of_point);
  for (PetscInt& number : global_of_point) {
    number += sheet.particles.first;
  }
  ownership.fetch(global_of_point);
  const std::size_t particles = point_of_particle.size();
  for (std::size_t i = static_cast<std::size_t>(sheet.particles.owned); i < particles; ++i) {
    sheet.particles.ghost_global.push_back(global_of_point[static_cast<std::size_t>(point_of_particle[i])]);
  }

  sheet.rest.resize(3, static_cast<Eigen::Index>(particles));
  sheet.uv.resize(2, sizes[2] != 0 ? static_cast<Eigen::Index>(particles) : 0);
  std::unordered_map<PetscInt, PetscInt> particle_of_vertex;  // by number in the mesh
  for (std::size_t i = 0; i < particles; ++i) {
    const auto point = static_cast<std::size_t>(point_of_particle[i]);
    const PointData& data = local.data[point];
    const auto column = static_cast<Eigen::Index>(i);
    const bool is_lattice = point_of_particle[i] >= cell_begin && point_of_particle[i] < cell_end;
    const auto id = static_cast<PetscInt>(data.id);
    sheet.rest.col(column) = Eigen::Map<const Eigen::Vector3d>(data.position);
    if (sheet.uv.cols() > 0) {
      sheet.uv.col(column) = Eigen::Map<const Eigen::Vector2d>(data.uv);
    }
    sheet.initial_mass.push_back(data.mass);
    sheet.is_lattice.push_back(is_lattice);
    sheet.persistent_id.push_back(is_lattice ? sheet.first_lattice_id + id : id);
    if (!is_lattice) {
      particle_of_vertex[static_cast<PetscInt>(data.vertices[0])] = static_cast<PetscInt>(i);
    }
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    auto& members = sheet.groups[groups[g]];
    for (std::size_t i = 0; i < particles; ++i) {
      if (local.group_members[g][static_cast<std::size_t>(point_of_particle[i])] != 0) {
        members.push_back(static_cast<PetscInt>(i));
      }
    }
  }

  // Cells, owned first, and the springs that belong to a cell.
  std::vector<FoundSpring> red;
  std::vector<FoundSpring> yellow;
  sheet.cell_count.assign(static_cast<std::size_t>(sheet.particles.owned), 0);
  for (const bool owned : {true, false}) {
    for (PetscInt point = cell_begin; point < cell_end; ++point) {
      if (ownership.is_owned(point) != owned) {
        continue;
      }
      const PetscInt lattice = particle_of_point[static_cast<std::size_t>(point)];
      std::array<PetscInt, 4> corners{};
      for (std::size_t k = 0; k < 4; ++k) {
        const double vertex = local.data[static_cast<std::size_t>(point)].vertices[k];
        corners[k] = particle_of_vertex.at(static_cast<PetscInt>(vertex));
        red.push_back({point, static_cast<PetscInt>(k), {corners[k], lattice}});
        if (corners[k] < sheet.owned_corners) {
          ++sheet.cell_count[static_cast<std::size_t>(corners[k])];
        }
      }
      yellow.push_back({point, 0, {corners[0], corners[2]}});
      yellow.push_back({point, 1, {corners[1], corners[3]}});
      sheet.cells.push_back(corners);
      sheet.lattice.push_back(lattice);
      sheet.owned_cells += owned ? 1 : 0;
    }
  }

  // Springs along and across the edges of the cells.
  std::vector<FoundSpring> blue;
  std::vector<FoundSpring> green;
  PetscInt edge_begin = 0;
  PetscInt edge_end = 0;
  check(DMPlexGetDepthStratum(local.dm, 1, &edge_begin, &edge_end));
  for (PetscInt edge = edge_begin; edge < edge_end; ++edge) {
    const PetscInt* points = nullptr;
    PetscInt support = 0;
    check(DMPlexGetCone(local.dm, edge, &points));
    blue.push_back({edge,
                    0,
                    {particle_of_point[static_cast<std::size_t>(points[0])],
                     particle_of_point[static_cast<std::size_t>(points[1])]}});
    check(DMPlexGetSupportSize(local.dm, edge, &support));
    check(DMPlexGetSupport(local.dm, edge, &points));
    if (support == 2) {
      green.push_back({edge,
                       0,
                       {particle_of_point[static_cast<std::size_t>(points[0])],
                        particle_of_point[static_cast<std::size_t>(points[1])]}});
    }
  }
  sheet.of(Colour::red) = make_spring_set(comm, red, ownership, sheet);
  sheet.of(Colour::green) = make_spring_set(comm, green, ownership, sheet);
  sheet.of(Colour::blue) = make_spring_set(comm, blue, ownership, sheet);
  sheet.of(Colour::yellow) = make_spring_set(comm, yellow, ownership, sheet);
  sheet.partition = partition_quality(sheet);
  return sheet;
}

namespace {

/// A uniform number in [-1, 1) for each (seed, id, component): SplitMix64's finaliser over their combination.
double noise(int seed, PetscInt id, int component) {
  auto bits = static_cast<std::uint64_t>(seed) * 0x9E3779B97F4A7C15ULL + static_cast<std::uint64_t>(id) * 3ULL +
              static_cast<std::uint64_t>(component);
  for (int round = 0; round < 2; ++round) {
    bits += 0x9E3779B97F4A7C15ULL;
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9ULL;
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBULL;
    bits ^= bits >> 31;
  }
  return static_cast<double>(bits >> 11) * 0x1.0p-52 - 1;
}

}  // namespace

Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options) {
  const SpringSet& blue = sheet.of(Colour::blue);
  double sum = std::accumulate(blue.initial_length.begin(), blue.initial_length.begin() + blue.owned(), 0.0);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
  const double amplitude = options.perturbation * sum / static_cast<double>(blue.layout.global);
  Eigen::Matrix3Xd positions = sheet.rest;
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    for (int component = 0; component < 3; ++component) {
      positions(component, i) +=
          amplitude * noise(options.seed, sheet.persistent_id[static_cast<std::size_t>(i)], component);
    }
  }
  return positions;
}

}  // namespace pellicle
