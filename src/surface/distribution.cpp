#include "surface/distribution.h"

#include <petscdmplex.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <memory_resource>
#include <set>
#include <unordered_map>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/handle.h"
#include "base/incidence.h"
#include "base/noise.h"
#include "base/sorting.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "parallel/route.h"
#include "surface/pieces.h"

namespace pellicle::surface {

namespace {

/// A rank, and the number of an item among those that the rank owns. Ghosts are in this order.
using Owner = std::pair<int, PetscInt>;

template <class Value>
std::vector<Value> picked(const std::vector<Value>& values, const std::vector<PetscInt>& items) {
  std::vector<Value> result;
  for (const PetscInt item : items) {
    result.push_back(values[item]);
  }
  return result;
}

std::vector<PetscInt> ids_of(const std::vector<MeshRows::Point>& points) {
  std::vector<PetscInt> ids(points.size());
  std::transform(points.begin(), points.end(), ids.begin(), [](const MeshRows::Point& point) { return point.id; });
  return ids;
}

/// The graph of the cells, joined by common sides. @param corners of the cells, the same number for each
CellGraph cell_graph(const std::vector<PetscInt>& corners, PetscInt count) {
  const std::vector<PetscInt> opposite = opposite_sides(corners, static_cast<std::size_t>(count));
  CellGraph graph;
  for (std::size_t side = 0; side < opposite.size(); ++side) {
    if (opposite[side] >= 0) {
      graph.neighbours.push_back(opposite[side] / count);
    }
    if ((side + 1) % static_cast<std::size_t>(count) == 0) {
      graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
    }
  }
  return graph;
}

/// Splits a graph on rank 0 with a partitioner of PETSc. Collective.
/// @returns on rank 0 the part of each cell
std::vector<int> partition_with_petsc(MPI_Comm comm, CellGraph graph, const std::string& type) {
  const int ranks = ranks_of(comm);
  Handle<PetscPartitioner, PetscPartitionerDestroy> partitioner;
  Handle<PetscSection, PetscSectionDestroy> sizes;
  Handle<IS, ISDestroy> cells_by_part;
  check(PetscPartitionerCreate(comm, partitioner.create()));
  check(PetscPartitionerSetType(partitioner, type.c_str()));
  check(PetscPartitionerSetUp(partitioner));
  check(PetscSectionCreate(comm, sizes.create()));
  check(PetscPartitionerPartition(partitioner, ranks, graph.cells(), graph.offsets.data(), graph.neighbours.data(),
                                  nullptr, nullptr, sizes, cells_by_part.create()));
  std::vector<int> part(graph.cells());
  const PetscInt* cells = nullptr;
  check(ISGetIndices(cells_by_part, &cells));
  for (PetscInt p = 0; p < ranks; ++p) {
    PetscInt count = 0;
    PetscInt first = 0;
    check(PetscSectionGetDof(sizes, p, &count));
    check(PetscSectionGetOffset(sizes, p, &first));
    for (PetscInt i = first; i < first + count; ++i) {
      part[cells[i]] = static_cast<int>(p);
    }
  }
  check(ISRestoreIndices(cells_by_part, &cells));
  return part;
}

/// Target rank of each cell of this rank. Only the graph of the cells, in the order of their ids, and their loads are
/// gathered on rank 0. Collective.
std::vector<int> find_parts(MPI_Comm comm, const MeshRows& rows, const SheetOptions& options) {
  const Route to_root(comm, std::vector<int>(rows.cells.size(), 0));
  const std::vector<PetscInt> order = ordered_by(to_root.send(ids_of(rows.cells)));
  const auto corners = Records::of(rows.cell_corners, static_cast<PetscInt>(rows.cells.size()), rows.corners);
  CellGraph graph = cell_graph(to_root.send(corners).of_items(order).as<PetscInt>(), rows.corners);
  std::vector<double> load;
  if (on_any_rank(comm, !rows.load.empty())) {
    load = picked(to_root.send(rows.load), order);
  }
  const std::vector<int> sorted_part = options.partitioner == Partitioner::metis
                                           ? partition_with_metis(std::move(graph), ranks_of(comm), load)
                                           : partition_with_petsc(comm, std::move(graph), options.partitioner.name());
  std::vector<int> part(sorted_part.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    part[order[i]] = sorted_part[i];
  }
  return to_root.send_back(part);
}

/// Cells with all their data, row by row.
struct CellTable {
  Records points;
  Records corners;  ///< ids
  Records fields;
  Records data;
  Records lattice_data;

  template <class Of>
  CellTable each(const Of& of) const {
    return {of(points), of(corners), of(fields), of(data), of(lattice_data)};
  }
  void append(const CellTable& others) {
    points.append(others.points);
    corners.append(others.corners);
    fields.append(others.fields);
    data.append(others.data);
    lattice_data.append(others.lattice_data);
  }
};

/// For each vertex the rank that records which ranks hold it.
std::vector<int> homes_of(MPI_Comm comm, const std::vector<PetscInt>& ids) {
  const int ranks = ranks_of(comm);
  std::vector<int> homes(ids.size());
  std::transform(ids.begin(), ids.end(), homes.begin(), [ranks](PetscInt id) { return static_cast<int>(id % ranks); });
  return homes;
}

/// Ranks to which own cells go as the next layer round the cells of these ranks. Collective.
/// @param constrained vertices of the cells that this rank has, without repeats
/// @param corners ids of the own cells' corners, `count` each
/// @returns pairs of a rank and an own cell
std::set<Owner> next_layer(MPI_Comm comm, const std::vector<PetscInt>& constrained,
                           const std::vector<PetscInt>& corners, std::size_t count) {
  struct Meeting {
    PetscInt vertex;
    int rank;  ///< another holder of the vertex
  };
  const Route to_home(comm, homes_of(comm, constrained));
  const std::vector<PetscInt> vertices = to_home.send(constrained);
  std::unordered_map<PetscInt, std::vector<int>> ranks_of_vertex;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    ranks_of_vertex[vertices[i]].push_back(to_home.sources()[i]);
  }
  std::vector<int> destinations;
  std::vector<Meeting> meetings;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (const int other : ranks_of_vertex[vertices[i]]) {
      if (other != to_home.sources()[i]) {
        destinations.push_back(to_home.sources()[i]);
        meetings.push_back({vertices[i], other});
      }
    }
  }
  std::unordered_map<PetscInt, std::vector<int>> others_at;
  for (const Meeting& meeting : Route(comm, destinations).send(meetings)) {
    others_at[meeting.vertex].push_back(meeting.rank);
  }
  std::set<Owner> wanted;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (const auto others = others_at.find(corners[i]); others != others_at.end()) {
      for (const int rank : others->second) {
        wanted.emplace(rank, static_cast<PetscInt>(i / count));
      }
    }
  }
  return wanted;
}

/// Finds the place of an id in a list.
class Places {
 public:
  explicit Places(const std::vector<PetscInt>& ids) {
    place_.reserve(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      place_.emplace(ids[i], static_cast<PetscInt>(i));
    }
  }

  /// Places of ids that all are in the list.
  std::vector<PetscInt> of(std::vector<PetscInt> ids) const {
    std::transform(ids.begin(), ids.end(), ids.begin(), [this](PetscInt id) { return place_.at(id); });
    return ids;
  }
  /// Place of an id, or -1.
  PetscInt find(PetscInt id) const {
    const auto found = place_.find(id);
    return found == place_.end() ? -1 : found->second;
  }

 private:
  std::pmr::monotonic_buffer_resource pool_;
  std::pmr::unordered_map<PetscInt, PetscInt> place_{&pool_};
};

/// Whether vertices of cells are far from each other in the order of all: on average by more than a few rows of a
/// square mesh of the same size.
/// @param corners numbers of the vertices of the cells, `count` each
bool are_scattered(const std::vector<PetscInt>& corners, int count, std::size_t vertices) {
  constexpr double rows = 4;
  double mean = 0;
  for (auto first = corners.begin(); first != corners.end(); first += count) {
    const auto [least, greatest] = std::minmax_element(first, first + count);
    mean += static_cast<double>(*greatest - *least) * count / static_cast<double>(corners.size());
  }
  return mean > rows * std::sqrt(static_cast<double>(vertices));
}

/// Orders the cells, and the vertices, so that those near each other on the surface are near each other in the order.
/// @param corners numbers of the vertices of the cells, `count` each
/// @param vertices ids of all vertices, put in the new order
/// @returns the cells in the new order
std::vector<PetscInt> order_by_nearness(const std::vector<PetscInt>& corners, int count,
                                        std::vector<PetscInt>& vertices) {
  const auto cells = static_cast<PetscInt>(corners.size()) / count;
  std::vector<PetscInt> order(cells);
  if (cells == 0) {
    return order;
  }
  const std::vector<double> coordinates(3 * vertices.size(), 0.0);
  Handle<DM, DMDestroy> dm;
  Handle<IS, ISDestroy> permutation;
  const PetscInt* new_number = nullptr;  // of each cell, then of each vertex
  check(DMPlexCreateFromCellListPetsc(PETSC_COMM_SELF, 2, cells, static_cast<PetscInt>(vertices.size()), count,
                                      PETSC_FALSE, corners.data(), 3, coordinates.data(), dm.create()));
  check(DMPlexGetOrdering(dm, MATORDERINGRCM, nullptr, permutation.create()));
  check(ISGetIndices(permutation, &new_number));
  for (PetscInt cell = 0; cell < cells; ++cell) {
    order[new_number[cell]] = cell;
  }
  const std::vector<PetscInt> before = vertices;
  for (std::size_t vertex = 0; vertex < before.size(); ++vertex) {
    vertices[new_number[static_cast<std::size_t>(cells) + vertex] - cells] = before[vertex];
  }
  check(ISRestoreIndices(permutation, &new_number));
  return order;
}

/// Fetches the rows of vertices from wherever they lie, and finds who owns them. Collective.
/// @param constrained ids of the vertices that this rank holds
/// @param has_own_cell of each of them, whether this rank owns a cell at it
/// @param rows the rows of the vertices; replaced by those of the constrained ones, in their order
/// @returns owner of each constrained vertex
std::vector<int> fetch_vertices(MPI_Comm comm, const std::vector<PetscInt>& constrained,
                                const std::vector<char>& has_own_cell, MeshRows& rows) {
  const Route rows_to_home(comm, homes_of(comm, ids_of(rows.vertices)));
  const std::vector<MeshRows::Point> points = rows_to_home.send(rows.vertices);
  const Records data = rows_to_home.send(rows.vertex_data);
  const Route to_home(comm, homes_of(comm, constrained));
  const std::vector<PetscInt> wanted = to_home.send(constrained);
  const std::vector<char> is_own = to_home.send(has_own_cell);

  const Places row_of(ids_of(points));
  std::vector<int> owner(points.size(), -1);
  std::vector<PetscInt> chosen;
  PetscInt missing = -1;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const PetscInt row = row_of.find(wanted[i]);
    if (row < 0) {
      missing = wanted[i];
    } else {
      chosen.push_back(row);
      int& last = owner[row];
      last = is_own[i] != 0 ? std::max(last, to_home.sources()[i]) : last;
    }
  }
  together(comm, [missing] {
    if (missing >= 0) {
      throw Error("vertex " + std::to_string(missing) + " is a corner of a cell, but the mesh has no such vertex");
    }
  });
  rows.vertices = to_home.send_back(picked(points, chosen));
  rows.vertex_data = to_home.send_back(data.of_items(chosen));
  return to_home.send_back(picked(owner, chosen));
}

/// A layout with given ghosts in their order, which is set, too. Collective.
Layout layout_with(MPI_Comm comm, PetscInt owned, const std::vector<Owner>& ghosts, std::vector<PetscInt>& order) {
  order = ordered_by(ghosts);
  Layout layout = number_owned(comm, owned);
  const std::vector<PetscInt> first = of_all_ranks(comm, std::vector<PetscInt>{layout.first});
  for (const auto& [rank, number] : picked(ghosts, order)) {
    layout.ghost_global.push_back(first[rank] + number);
  }
  return layout;
}

}  // namespace

Distribution::Distribution(MPI_Comm comm, MeshRows given, int layers, Numbering numbering, const SheetOptions& options)
    : rows(std::move(given)) {
  const std::size_t count = rows.corners;
  if (!on_any_rank(comm, !rows.part.empty())) {
    rows.part = find_parts(comm, rows, options);
  }

  // The own cells, in the order of their ids.
  const auto rows_here = static_cast<PetscInt>(rows.cells.size());
  const CellTable here{Records::of(rows.cells), Records::of(rows.cell_corners, rows_here, count),
                       Records::of(rows.field_values, rows_here, rows.fields.size()), rows.cell_data,
                       rows.lattice_data};
  const Route to_owner(comm, rows.part);
  CellTable cells = here.each([&to_owner](const Records& records) { return to_owner.send(records); });
  const auto reorder = [](CellTable& table, const std::vector<PetscInt>& items) {
    table = table.each([&items](const Records& records) { return records.of_items(items); });
  };
  reorder(cells, ordered_by(ids_of(cells.points.as<MeshRows::Point>())));
  std::vector<PetscInt> vertices = without_repeats(cells.corners.as<PetscInt>());
  const std::vector<PetscInt> places = Places(vertices).of(cells.corners.as<PetscInt>());
  if (numbering == Numbering::by_nearness || are_scattered(places, rows.corners, vertices.size())) {
    reorder(cells, order_by_nearness(places, rows.corners, vertices));
  }
  const PetscInt owned_cells = cells.points.count();

  // The layers round them: each is sent by the cells' owners to the ranks that hold the layer before.
  const std::vector<PetscInt> own_corners = cells.corners.as<PetscInt>();
  std::vector<Owner> ghost_owner;
  CellTable ghosts = cells.each([](const Records& records) { return records.of_items({}); });
  std::set<Owner> sent;
  const std::vector<PetscInt> of_own_cells = without_repeats(own_corners);
  std::vector<PetscInt> constrained = of_own_cells;
  for (int layer = 0; layer < layers; ++layer) {
    std::vector<int> destinations;
    std::vector<PetscInt> items;
    for (const auto& wanted : next_layer(comm, constrained, own_corners, count)) {
      if (sent.insert(wanted).second) {
        destinations.push_back(wanted.first);
        items.push_back(wanted.second);
      }
    }
    const Route to_neighbours(comm, destinations);
    ghosts.append(cells.each([&](const Records& records) { return to_neighbours.send(records.of_items(items)); }));
    const std::vector<PetscInt> numbers = to_neighbours.send(items);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      ghost_owner.emplace_back(to_neighbours.sources()[i], numbers[i]);
    }
    const auto corners = ghosts.corners.as<PetscInt>();
    constrained.insert(constrained.end(), corners.begin(), corners.end());
    constrained = without_repeats(std::move(constrained));
  }
  std::vector<PetscInt> ghost_order;
  cell_layout = layout_with(comm, owned_cells, ghost_owner, ghost_order);
  reorder(ghosts, ghost_order);
  cells.append(ghosts);

  // Vertices: those of own cells in the order found above, then the others, as far as this rank owns them; then ghosts.
  std::vector<char> has_own_cell(vertices.size(), 1);
  std::set_difference(constrained.begin(), constrained.end(), of_own_cells.begin(), of_own_cells.end(),
                      std::back_inserter(vertices));
  has_own_cell.resize(vertices.size(), 0);
  const std::vector<int> owner = fetch_vertices(comm, vertices, has_own_cell, rows);
  std::vector<PetscInt> own;
  std::vector<PetscInt> others;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    (owner[i] == rank_of(comm) ? own : others).push_back(static_cast<PetscInt>(i));
  }
  const Route to_vertex_owner(comm, picked(owner, others));
  const std::vector<PetscInt> asked = to_vertex_owner.send(picked(vertices, others));
  const std::vector<PetscInt> numbers = to_vertex_owner.send_back(Places(picked(vertices, own)).of(asked));
  std::vector<Owner> vertex_owner;
  for (std::size_t i = 0; i < others.size(); ++i) {
    vertex_owner.emplace_back(owner[others[i]], numbers[i]);
  }
  vertex_layout = layout_with(comm, static_cast<PetscInt>(own.size()), vertex_owner, ghost_order);
  std::vector<PetscInt> order = own;
  for (const PetscInt ghost : ghost_order) {
    order.push_back(others[ghost]);
  }
  vertices = picked(vertices, order);
  rows.vertices = picked(rows.vertices, order);
  rows.vertex_data = rows.vertex_data.of_items(order);

  rows.cells = cells.points.as<MeshRows::Point>();
  rows.field_values = cells.fields.as<double>();
  rows.cell_data = std::move(cells.data);
  rows.lattice_data = std::move(cells.lattice_data);
  rows.cell_corners.clear();
  rows.part.clear();
  rows.load.clear();
  cell_vertices = Places(vertices).of(cells.corners.as<PetscInt>());
  for (PetscInt& corner : cell_vertices) {
    corner += cell_layout.local();
  }
  opposite = opposite_sides(cell_vertices, count);
}

Records Distribution::particle_data(const std::vector<PetscInt>& points) const {
  Records data(rows.vertex_data.bytes(), static_cast<PetscInt>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PetscInt vertex = points[i] - cells();
    std::copy_n(vertex < 0 ? rows.lattice_data.at(points[i]) : rows.vertex_data.at(vertex), data.bytes(),
                data.at(static_cast<PetscInt>(i)));
  }
  return data;
}

std::vector<int> Distribution::find_pieces(std::vector<bool>& is_closed) const {
  const std::size_t sides = rows.corners;
  DisjointSets joined(rows.cells.size());
  for (std::size_t side = 0; side < opposite.size(); ++side) {
    if (opposite[side] >= 0) {
      joined.unite(side / sides, static_cast<std::size_t>(opposite[side]) / sides);
    }
  }
  const std::vector<PetscInt> least = least_connected_ids(cell_layout, joined, ids_of(rows.cells));
  const std::vector<PetscInt> own(least.begin(), least.begin() + cell_layout.owned);
  const std::vector<PetscInt> ids = without_repeats(of_all_ranks(comm(), without_repeats(own)));
  const std::vector<PetscInt> numbers = Places(ids).of(least);
  std::vector<int> piece(numbers.begin(), numbers.end());
  std::vector<int> open(ids.size(), 0);
  for (std::size_t side = 0; side < sides * own.size(); ++side) {
    if (opposite[side] < 0) {
      open[piece[side / sides]] = 1;
    }
  }
  max_over_ranks(comm(), open);
  for (const int is_open : open) {
    is_closed.push_back(is_open == 0);
  }
  return piece;
}

Layout Distribution::layout(const std::vector<PetscInt>& points) const {
  const auto first_ghost = std::find_if(points.begin(), points.end(), [this](PetscInt p) { return !is_owned(p); });
  Layout layout = number_owned(comm(), static_cast<PetscInt>(first_ghost - points.begin()));
  std::vector<PetscInt> of_cells(rows.cells.size(), -1);
  std::vector<PetscInt> of_vertices(rows.vertices.size(), -1);
  const auto number = [&](PetscInt point) -> PetscInt& {
    return point < cells() ? of_cells[point] : of_vertices[point - cells()];
  };
  for (auto point = points.begin(); point != first_ghost; ++point) {
    number(*point) = layout.first + static_cast<PetscInt>(point - points.begin());
  }
  update_ghosts(cell_layout, of_cells);
  update_ghosts(vertex_layout, of_vertices);
  for (auto point = first_ghost; point != points.end(); ++point) {
    layout.ghost_global.push_back(number(*point));
  }
  return layout;
}

void Distribution::fill(Surface& set, const std::vector<PetscInt>& points) const {
  set.particles = layout(points);
  const auto count = static_cast<Eigen::Index>(points.size());
  set.rest.resize(3, count);
  set.uv.resize(2, rows.has_uv ? count : 0);
  for (const std::string& group : rows.groups) {
    set.groups[group];  // also one without members
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    const MeshRows::Point& point = data(points[i]);
    set.rest.col(i) = Eigen::Map<const Eigen::Vector3d>(point.position.data());
    if (rows.has_uv) {
      set.uv.col(i) = Eigen::Map<const Eigen::Vector2d>(point.uv.data());
    }
    set.persistent_id.push_back(point.id);
    for (const int group : groups_of(points[i])) {
      set.groups[rows.groups[group]].push_back(static_cast<PetscInt>(i));
    }
  }
  const PetscInt own_sides = rows.corners * cell_layout.owned;
  // Edges of the cut are counted from both sides.
  const auto cut = static_cast<PetscInt>(std::count_if(opposite.begin(), opposite.begin() + own_sides,
                                                       [own_sides](PetscInt side) { return side >= own_sides; }));
  set.partition = {sum_over_ranks(comm(), cut) / 2,
                   shares_of_ranks(comm(), static_cast<double>(cell_layout.owned)).imbalance};
}

Eigen::Matrix3Xd perturbed_positions(const Surface& points, const SheetOptions& options, double mean_edge) {
  const double amplitude = options.perturbation * mean_edge;
  Eigen::Matrix3Xd positions = points.rest;
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    for (int component = 0; component < 3; ++component) {
      const auto id = static_cast<std::uint64_t>(points.persistent_id[i]);
      positions(component, i) += amplitude * noise(options.seed, 3 * id + static_cast<std::uint64_t>(component));
    }
  }
  return positions;
}

}  // namespace pellicle::surface
