#include "surface/membrane.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "parallel/collective.h"
#include "parallel/field.h"
#include "surface/distribution.h"

namespace pellicle::surface {

namespace {

/// The sum at each local vertex of a third of the value of each element round it. Collective.
std::vector<double> shared_by_corners(const Membrane& membrane, const std::vector<double>& of_element) {
  Field sums(membrane.particles, 1);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    for (const PetscInt corner : membrane.triangles[e]) {
      sums.data()[corner] += of_element[e] / 3;
    }
  }
  // Local elements are all that an owned vertex belongs to; a ghost misses some.
  sums.update_ghosts();
  return {sums.data(), sums.data() + membrane.particles.local()};
}

}  // namespace

LoadedMembrane make_membrane(MPI_Comm comm, MeshRows rows, const SheetOptions& options) {
  const Distribution distribution(comm, std::move(rows), 1, Numbering::by_nearness, options);
  Membrane membrane;
  const std::vector<int> piece = distribution.find_pieces(membrane.piece_is_closed);

  const auto is_owned = [&distribution](PetscInt point) { return distribution.is_owned(point); };

  // Elements: owned ones, then those of other ranks with an owned vertex.
  std::vector<PetscInt> elements;
  std::vector<bool> is_used(distribution.points(), false);
  for (PetscInt cell = 0; cell < distribution.cells(); ++cell) {
    const std::array<PetscInt, 3> corners = distribution.corners<3>(cell);
    if (is_owned(cell) || std::any_of(corners.begin(), corners.end(), is_owned)) {
      elements.push_back(cell);
      for (const PetscInt corner : corners) {
        is_used[corner] = true;
      }
    }
  }
  membrane.elements = distribution.layout(elements);

  // Particles: the vertices that elements use, owned ones first. Every owned vertex is in an owned cell or beside one.
  std::vector<PetscInt> particles;
  std::vector<PetscInt> particle_of_point(distribution.points(), -1);
  for (PetscInt vertex = distribution.cells(); vertex < distribution.points(); ++vertex) {
    if (is_used[vertex]) {
      particle_of_point[vertex] = static_cast<PetscInt>(particles.size());
      particles.push_back(vertex);
    }
  }
  distribution.fill(membrane, particles);
  const PetscInt own_end = membrane.persistent_id.empty()
                               ? 0
                               : *std::max_element(membrane.persistent_id.begin(), membrane.persistent_id.end()) + 1;
  membrane.id_end = max_over_ranks(comm, own_end);
  membrane.is_lattice.assign(particles.size(), false);
  membrane.cell_count.assign(membrane.particles.owned, 0);

  membrane.element_uv.resize(2, distribution.rows.has_uv ? static_cast<Eigen::Index>(elements.size()) : 0);
  const std::vector<std::string>& fields = distribution.rows.fields;
  for (const std::string& field : fields) {
    membrane.element_fields[field];
  }
  for (std::size_t e = 0; e < elements.size(); ++e) {
    std::array<PetscInt, 3> corners = distribution.corners<3>(elements[e]);
    for (PetscInt& corner : corners) {
      corner = particle_of_point[corner];
      if (corner < membrane.particles.owned) {
        ++membrane.cell_count[corner];
      }
    }
    membrane.triangles.push_back(corners);
    const MeshRows::Point& data = distribution.data(elements[e]);
    membrane.element_id.push_back(data.id);
    membrane.piece.push_back(piece[elements[e]]);
    if (distribution.rows.has_uv) {
      membrane.element_uv.col(static_cast<Eigen::Index>(e)) = Eigen::Map<const Eigen::Vector2d>(data.uv.data());
    }
    for (const int group : distribution.groups_of(elements[e])) {
      membrane.element_groups[distribution.rows.groups[group]].push_back(static_cast<PetscInt>(e));
    }
    for (std::size_t f = 0; f < fields.size(); ++f) {
      membrane.element_fields[fields[f]].push_back(
          distribution.rows.field_values[fields.size() * static_cast<std::size_t>(elements[e]) + f]);
    }
  }
  return {std::move(membrane), distribution.particle_data(particles), distribution.rows.cell_data.of_items(elements)};
}

void set_burnable(Membrane& membrane, std::vector<double> element_mass) {
  membrane.element_mass = std::move(element_mass);
  membrane.initial_mass = shared_by_corners(membrane, membrane.element_mass);
  SpringSet& edges = membrane.of(Colour::blue);
  std::map<std::pair<PetscInt, PetscInt>, std::size_t> number;
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const std::array<PetscInt, 3>& triangle = membrane.triangles[e];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax({triangle[k], triangle[(k + 1) % 3]});  // by value
      const auto [edge, is_new] = number.try_emplace({a, b}, edges.ends.size());
      if (is_new) {
        edges.ends.push_back({a, b});
        edges.initial_length.push_back((membrane.rest.col(a) - membrane.rest.col(b)).norm());
        edges.triangles.push_back({static_cast<PetscInt>(e), -1, -1, -1});
      } else {
        edges.triangles[edge->second][1] = static_cast<PetscInt>(e);
      }
    }
  }
  for (SpringSet& set : membrane.springs) {  // of all colours but the edges' empty
    set.layout = number_owned(membrane.comm(), static_cast<PetscInt>(set.ends.size()));
  }
}

std::vector<double> vertex_areas(const Membrane& membrane) {
  std::vector<double> areas;
  for (const std::array<PetscInt, 3>& triangle : membrane.triangles) {
    const auto [e12, e13] = edges_of(membrane.rest.data(), triangle);
    areas.push_back(e12.cross(e13).norm() / 2);
  }
  return shared_by_corners(membrane, areas);
}

MeshRows rows_of(const Membrane& membrane, const Records& particles, const Records& elements) {
  MeshRows rows = vertex_rows(membrane, membrane.particles.owned);
  rows.corners = 3;
  for (const auto& field : membrane.element_fields) {
    rows.fields.push_back(field.first);
  }
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    MeshRows::Point& cell = rows.cells.emplace_back();
    cell.id = membrane.element_id[e];
    if (rows.has_uv) {
      Eigen::Map<Eigen::Vector2d>(cell.uv.data()) = membrane.element_uv.col(static_cast<Eigen::Index>(e));
    }
    for (const PetscInt corner : membrane.triangles[e]) {
      rows.cell_corners.push_back(membrane.persistent_id[corner]);
    }
    for (const auto& field : membrane.element_fields) {
      rows.field_values.push_back(field.second[e]);
    }
  }
  set_groups(membrane.comm(), rows, membrane.groups, membrane.element_groups);
  rows.part.assign(rows.cells.size(), rank_of(membrane.comm()));
  rows.vertex_data = particles;
  rows.cell_data = elements;
  rows.lattice_data = Records(0, static_cast<PetscInt>(rows.cells.size()));
  return rows;
}

LoadedMembrane split(const Membrane& membrane, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements, const SheetOptions& options) {
  return make_membrane(membrane.comm(), split(rows_of(membrane, particles, elements), corners, copies), options);
}

Eigen::Matrix3Xd perturbed_positions(const Membrane& membrane, const SheetOptions& options) {
  double sum = 0;
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    const auto& triangle = membrane.triangles[e];
    for (std::size_t k = 0; k < 3; ++k) {
      sum += (membrane.rest.col(triangle[(k + 1) % 3]) - membrane.rest.col(triangle[k])).norm();
    }
  }
  const double perimeters = sum_over_ranks(membrane.comm(), sum);
  return perturbed_positions(membrane, options, perimeters / (3 * static_cast<double>(membrane.elements.global)));
}

}  // namespace pellicle::surface
