#include "surface/distribution.h"

#include <petscsf.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "base/error.h"

namespace pellicle {

namespace {

/// Tells DMPlex which rank gets which cell, or whom to ask. Collective.
void set_partitioner(DM dm, const SurfaceMesh& mesh, std::vector<int> part, const SheetOptions& options) {
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(dm));
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  PetscPartitioner partitioner = nullptr;
  check(DMPlexGetPartitioner(dm, &partitioner));
  int is_given = part.empty() ? 0 : 1;
  MPI_Bcast(&is_given, 1, MPI_INT, 0, comm);
  if (is_given == 0 && options.partitioner != "metis") {
    check(PetscPartitionerSetType(partitioner, options.partitioner.c_str()));
    return;
  }
  std::vector<PetscInt> sizes(static_cast<std::size_t>(ranks), 0);
  std::vector<PetscInt> cells;
  if (rank == 0) {
    if (is_given == 0) {
      part = partition_with_metis(cell_graph(mesh), ranks);
    }
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

/// Sends `doubles` numbers a point from rank 0 to all that hold the point. Collective.
void send_doubles(PetscSF migration, PetscInt doubles, const void* sent, void* received) {
  MPI_Datatype type = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(static_cast<int>(doubles), MPI_DOUBLE, &type);
  MPI_Type_commit(&type);
  check(PetscSFBcastBegin(migration, type, sent, received, MPI_REPLACE));
  check(PetscSFBcastEnd(migration, type, sent, received, MPI_REPLACE));
  MPI_Type_free(&type);
}

/// Which points of a distributed DMPlex no other rank owns.
std::vector<bool> owned_points(DM dm) {
  PetscInt first = 0;
  PetscInt points = 0;
  check(DMPlexGetChart(dm, &first, &points));
  std::vector<bool> owned(static_cast<std::size_t>(points), true);
  PetscSF sf = nullptr;
  PetscInt leaves = 0;
  const PetscInt* local = nullptr;
  check(DMGetPointSF(dm, &sf));
  check(PetscSFGetGraph(sf, nullptr, &leaves, &local, nullptr));
  for (PetscInt leaf = 0; leaf < leaves; ++leaf) {
    owned[static_cast<std::size_t>(local != nullptr ? local[leaf] : leaf)] = false;
  }
  return owned;
}

}  // namespace

std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count) {
  const auto other_end = [&](std::size_t side) {
    return corners[side % count + 1 < count ? side + 1 : side + 1 - count];
  };
  const auto ends = [&](std::size_t side) { return std::minmax({corners[side], other_end(side)}); };
  // The sides by their lesser corner, where few meet.
  const PetscInt bound = corners.empty() ? 0 : *std::max_element(corners.begin(), corners.end()) + 1;
  std::vector<std::size_t> first(static_cast<std::size_t>(bound) + 1, 0);
  for (std::size_t side = 0; side < corners.size(); ++side) {
    ++first[static_cast<std::size_t>(ends(side).first) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::size_t> next(first.begin(), first.end());
  std::vector<std::size_t> sides(corners.size());
  std::vector<PetscInt> opposite(corners.size(), -1);
  for (std::size_t side = 0; side < corners.size(); ++side) {
    const auto [lesser, greater] = ends(side);
    const auto corner = static_cast<std::size_t>(lesser);
    for (std::size_t i = first[corner]; i < next[corner]; ++i) {
      if (ends(sides[i]).second == greater) {
        opposite[side] = static_cast<PetscInt>(sides[i]);
        opposite[sides[i]] = static_cast<PetscInt>(side);
      }
    }
    sides[next[corner]++] = side;
  }
  return opposite;
}

CellGraph cell_graph(const SurfaceMesh& mesh) {
  std::vector<PetscInt> corners;
  for (const auto& face : mesh.faces) {
    corners.insert(corners.end(), face.begin(), face.end());
  }
  const std::size_t count = mesh.faces.empty() ? 1 : mesh.faces.front().size();
  const std::vector<PetscInt> opposite = opposite_sides(corners, count);
  CellGraph graph;
  graph.offsets.push_back(0);
  for (std::size_t side = 0; side < opposite.size(); ++side) {
    if (opposite[side] >= 0) {
      graph.neighbours.push_back(opposite[side] / static_cast<PetscInt>(count));
    }
    if ((side + 1) % count == 0) {
      graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
    }
  }
  return graph;
}

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

void broadcast(MPI_Comm comm, std::vector<std::vector<int>>& lists) {
  std::vector<int> numbers;  // of each list its length, then its numbers
  for (const std::vector<int>& list : lists) {
    numbers.push_back(static_cast<int>(list.size()));
    numbers.insert(numbers.end(), list.begin(), list.end());
  }
  auto length = static_cast<int>(numbers.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  numbers.resize(static_cast<std::size_t>(length));
  MPI_Bcast(numbers.data(), length, MPI_INT, 0, comm);
  lists.clear();
  for (auto next = numbers.begin(); next != numbers.end(); next += 1 + *next) {
    lists.emplace_back(next + 1, next + 1 + *next);
  }
}

Distribution::Source Distribution::source(const SurfaceMesh& mesh) {
  const std::size_t cells = mesh.faces.size();
  Source source;
  source.has_uv = !mesh.uv.empty();
  source.data.assign(cells + mesh.points.size(), Data{});
  std::vector<Data>& data = source.data;
  for (std::size_t vertex = 0; vertex < mesh.points.size(); ++vertex) {
    Data& point = data[cells + vertex];
    Eigen::Map<Eigen::Vector3d>(point.position) = mesh.points[vertex];
    point.id = mesh.id_of_point(static_cast<int>(vertex));
  }
  std::vector<bool> has_uv(mesh.points.size(), false);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const auto& face = mesh.faces[cell];
    const auto corners = static_cast<double>(face.size());
    Data& centre = data[cell];
    centre.id = mesh.id_of_face(static_cast<int>(cell));
    for (std::size_t k = 0; k < face.size(); ++k) {
      const auto vertex = static_cast<std::size_t>(face[k]);
      Eigen::Map<Eigen::Vector3d>(centre.position) += mesh.points[vertex] / corners;
      if (source.has_uv) {
        const Eigen::Vector2d& uv = mesh.uv[cell][k];
        Eigen::Map<Eigen::Vector2d>(centre.uv) += uv / corners;
        if (!has_uv[vertex]) {
          has_uv[vertex] = true;
          Eigen::Map<Eigen::Vector2d>(data[cells + vertex].uv) = uv;
        }
      }
    }
  }
  std::vector<std::vector<int>> groups_of_vertex(mesh.groups.empty() ? 0 : mesh.points.size());
  int group = 0;
  for (const auto& [name, members] : mesh.groups) {
    for (const int vertex : members) {
      std::vector<int>& groups = groups_of_vertex[static_cast<std::size_t>(vertex)];
      if (groups.empty() || groups.back() != group) {
        groups.push_back(group);
      }
    }
    ++group;
  }
  // One number goes to the ranks with each vertex, however many groups there are.
  std::map<std::vector<int>, std::size_t> number_of_set{{{}, 0}};
  for (std::size_t vertex = 0; vertex < groups_of_vertex.size(); ++vertex) {
    const auto [set, is_new] = number_of_set.emplace(std::move(groups_of_vertex[vertex]), source.group_sets.size());
    if (is_new) {
      source.group_sets.push_back(set->first);
    }
    data[cells + vertex].groups = static_cast<double>(set->second);
  }
  return source;
}

Distribution::Distribution(MPI_Comm comm, const SurfaceMesh& mesh, Source source, int layers,
                           const SheetOptions& options)
    : comm_(comm),
      group_sets_(std::move(source.group_sets)),
      data_(std::move(source.data)),
      extra_(std::move(source.extra)) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::array<PetscInt, 3> shape{};  // corners of a cell, texture or not, rows of `extra`
  std::vector<PetscInt> cells;
  std::vector<double> coordinates;
  if (rank == 0) {
    shape = {static_cast<PetscInt>(mesh.faces.front().size()), source.has_uv ? 1 : 0,
             static_cast<PetscInt>(extra_.rows())};
    for (const auto& face : mesh.faces) {
      cells.insert(cells.end(), face.begin(), face.end());
    }
    for (const auto& point : mesh.points) {
      coordinates.insert(coordinates.end(), point.data(), point.data() + 3);
    }
    for (const auto& [name, members] : mesh.groups) {
      groups_.push_back(name);
    }
  }
  MPI_Bcast(shape.data(), static_cast<int>(shape.size()), MPIU_INT, 0, comm);
  const auto [corners, has_uv, extra_rows] = shape;
  has_uv_ = has_uv != 0;
  broadcast(comm, groups_);
  broadcast(comm, group_sets_);
  const auto cell_count = static_cast<PetscInt>(cells.size()) / corners;
  const auto vertex_count = static_cast<PetscInt>(coordinates.size() / 3);
  check(DMPlexCreateFromCellListPetsc(comm, 2, cell_count, vertex_count, corners, PETSC_FALSE, cells.data(), 3,
                                      coordinates.data(), dm_.create()));

  if (ranks > 1) {
    set_partitioner(dm_, mesh, std::move(source.part), options);
    Handle<DM, DMDestroy> distributed;
    Handle<PetscSF, PetscSFDestroy> migration;
    check(DMPlexDistribute(dm_, layers, migration.create(), distributed.create()));
    std::swap(dm_, distributed);
    PetscInt roots = 0;
    PetscInt first = 0;
    PetscInt last = 0;
    check(PetscSFGetGraph(migration, &roots, nullptr, nullptr, nullptr));
    check(DMPlexGetChart(dm_, &first, &last));
    const auto held = static_cast<std::size_t>(last);
    data_.resize(static_cast<std::size_t>(roots), Data{});
    std::vector<Data> data(held, Data{});
    send_doubles(migration, sizeof(Data) / sizeof(double), data_.data(), data.data());
    data_ = std::move(data);
    if (extra_rows > 0) {
      Eigen::MatrixXd sent = Eigen::MatrixXd::Zero(extra_rows, roots);
      if (rank == 0) {
        sent.leftCols(extra_.cols()) = extra_;
      }
      extra_.setZero(extra_rows, last);
      send_doubles(migration, extra_rows, sent.data(), extra_.data());
    }
  }
  owned_ = owned_points(dm_);
  for (PetscInt cell = this->cells().begin; cell < this->cells().end; ++cell) {
    const PetscInt* cone = nullptr;
    check(DMPlexGetCone(dm_, cell, &cone));
    corners_.insert(corners_.end(), cone, cone + corners);
  }
  opposite_ = opposite_sides(corners_, static_cast<std::size_t>(corners));
}

Distribution::Range Distribution::cells() const {
  Range range;
  check(DMPlexGetHeightStratum(dm_, 0, &range.begin, &range.end));
  return range;
}

Distribution::Range Distribution::vertices() const {
  Range range;
  check(DMPlexGetDepthStratum(dm_, 0, &range.begin, &range.end));
  return range;
}

void Distribution::fetch(std::vector<PetscInt>& numbers, int count) const {
  PetscSF sf = nullptr;
  PetscInt roots = -1;
  check(DMGetPointSF(dm_, &sf));
  check(PetscSFGetGraph(sf, &roots, nullptr, nullptr, nullptr));
  if (roots < 0) {  // One rank: nothing was distributed.
    return;
  }
  const std::vector<PetscInt> own(numbers);
  MPI_Datatype type = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(count, MPIU_INT, &type);
  MPI_Type_commit(&type);
  check(PetscSFBcastBegin(sf, type, own.data(), numbers.data(), MPI_REPLACE));
  check(PetscSFBcastEnd(sf, type, own.data(), numbers.data(), MPI_REPLACE));
  MPI_Type_free(&type);
}

Layout Distribution::layout(const std::vector<PetscInt>& points) const {
  const auto first_ghost = std::find_if(points.begin(), points.end(), [this](PetscInt p) { return !is_owned(p); });
  Layout layout = number_owned(comm_, static_cast<PetscInt>(first_ghost - points.begin()));
  std::vector<PetscInt> global(owned_.size(), -1);
  for (auto point = points.begin(); point != first_ghost; ++point) {
    global[static_cast<std::size_t>(*point)] = layout.first + static_cast<PetscInt>(point - points.begin());
  }
  fetch(global, 1);
  for (auto point = first_ghost; point != points.end(); ++point) {
    layout.ghost_global.push_back(global[static_cast<std::size_t>(*point)]);
  }
  return layout;
}

void Distribution::fill(PointSet& set, const std::vector<PetscInt>& points) const {
  set.particles = layout(points);
  const auto count = static_cast<Eigen::Index>(points.size());
  set.rest.resize(3, count);
  set.uv.resize(2, has_uv_ ? count : 0);
  std::vector<std::vector<PetscInt>*> members;
  for (const std::string& group : groups_) {
    members.push_back(&set.groups[group]);
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto point = static_cast<std::size_t>(points[static_cast<std::size_t>(i)]);
    set.rest.col(i) = Eigen::Map<const Eigen::Vector3d>(data_[point].position);
    if (has_uv_) {
      set.uv.col(i) = Eigen::Map<const Eigen::Vector2d>(data_[point].uv);
    }
    set.persistent_id.push_back(static_cast<PetscInt>(data_[point].id));
    for (const int group : group_sets_[static_cast<std::size_t>(data_[point].groups)]) {
      members[static_cast<std::size_t>(group)]->push_back(static_cast<PetscInt>(i));
    }
  }
  set.partition = quality();
}

PartitionQuality Distribution::quality() const {
  int ranks = 1;
  MPI_Comm_size(comm_, &ranks);
  PetscInt sums[2] = {0, 0};  // cells; cut edges, which both sides count
  const auto count = opposite_.empty() ? 1 : static_cast<PetscInt>(opposite_.size()) / cells().end;
  for (PetscInt cell = cells().begin; cell < cells().end; ++cell) {
    sums[0] += is_owned(cell) ? 1 : 0;
    for (PetscInt side = count * cell; side < count * (cell + 1); ++side) {
      const PetscInt other = opposite_[static_cast<std::size_t>(side)];
      sums[1] += is_owned(cell) && other >= 0 && !is_owned(other / count) ? 1 : 0;
    }
  }
  PetscInt largest = 0;
  MPI_Allreduce(&sums[0], &largest, 1, MPIU_INT, MPI_MAX, comm_);
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_INT, MPI_SUM, comm_);
  return {sums[1] / 2, static_cast<double>(largest) * ranks / static_cast<double>(sums[0])};
}

}  // namespace pellicle
