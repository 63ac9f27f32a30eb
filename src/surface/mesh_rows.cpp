#include "surface/mesh_rows.h"

#include <Eigen/Core>
#include <map>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::surface {

namespace {

/// The rows of this rank's mesh, without the groups.
MeshRows own_rows_of(const SurfaceMesh& mesh) {
  MeshRows rows;
  rows.corners = static_cast<int>(mesh.faces.front().size());
  rows.has_uv = !mesh.uv.empty();
  for (const auto& field : mesh.face_fields) {
    rows.fields.push_back(field.first);
  }
  for (std::size_t vertex = 0; vertex < mesh.points.size(); ++vertex) {
    MeshRows::Point& point = rows.vertices.emplace_back();
    Eigen::Map<Eigen::Vector3d>(point.position.data()) = mesh.points[vertex];
    point.id = mesh.id_of_point(static_cast<int>(vertex));
  }
  std::vector<bool> has_uv(mesh.points.size(), false);
  for (std::size_t cell = 0; cell < mesh.faces.size(); ++cell) {
    const auto& face = mesh.faces[cell];
    const auto corners = static_cast<double>(face.size());
    MeshRows::Point& centre = rows.cells.emplace_back();
    centre.id = mesh.id_of_face(static_cast<int>(cell));
    for (std::size_t k = 0; k < face.size(); ++k) {
      const std::size_t vertex = face[k];
      rows.cell_corners.push_back(rows.vertices[vertex].id);
      if (rows.has_uv) {
        const Eigen::Vector2d& uv = mesh.uv[cell][k];
        Eigen::Map<Eigen::Vector2d>(centre.uv.data()) += uv / corners;
        if (!has_uv[vertex]) {
          has_uv[vertex] = true;
          Eigen::Map<Eigen::Vector2d>(rows.vertices[vertex].uv.data()) = uv;
        }
      }
    }
    for (const auto& [name, values] : mesh.face_fields) {
      rows.field_values.push_back(values[cell]);
    }
  }
  return rows;
}

}  // namespace

MeshRows rows_of(MPI_Comm comm, const SurfaceMesh& mesh) {
  MeshRows rows;
  std::vector<std::string> names;  // of the groups
  Groups vertices;
  Groups cells;
  if (rank_of(comm) == 0) {
    rows = own_rows_of(mesh);
    for (const auto& [name, members] : mesh.groups) {
      names.push_back(name);
      vertices[name].assign(members.begin(), members.end());
    }
    for (const auto& [name, members] : mesh.face_groups) {
      cells[name].assign(members.begin(), members.end());
    }
  }
  std::array<int, 2> shape{rows.corners, rows.has_uv ? 1 : 0};
  MPI_Bcast(shape.data(), 2, MPI_INT, 0, comm);
  rows.corners = shape[0];
  rows.has_uv = shape[1] != 0;
  broadcast(comm, rows.fields);
  broadcast(comm, names);
  for (const std::string& name : names) {
    vertices[name];
  }
  set_groups(comm, rows, vertices, cells);
  rows.cell_data = Records(0, static_cast<PetscInt>(rows.cells.size()));
  rows.lattice_data = rows.cell_data;
  rows.vertex_data = Records(0, static_cast<PetscInt>(rows.vertices.size()));
  return rows;
}

void set_groups(MPI_Comm comm, MeshRows& rows, const Groups& vertices, const Groups& cells) {
  using Sets = std::vector<std::vector<int>>;  // the groups of each row, rising
  rows.groups.clear();
  for (const auto& group : vertices) {
    rows.groups.push_back(group.first);
  }
  const auto sets_of = [&rows](const std::vector<MeshRows::Point>& points, const Groups& groups) {
    Sets sets(points.size());
    for (std::size_t number = 0; number < rows.groups.size(); ++number) {
      const auto group = groups.find(rows.groups[number]);
      for (const PetscInt member : group == groups.end() ? std::vector<PetscInt>{} : group->second) {
        const std::size_t row = member;
        if (row < sets.size() && (sets[row].empty() || sets[row].back() != static_cast<int>(number))) {
          sets[row].push_back(static_cast<int>(number));
        }
      }
    }
    return sets;
  };
  const std::array<Sets, 2> own{sets_of(rows.vertices, vertices), sets_of(rows.cells, cells)};
  // Each row is sent with one number for all its groups.
  std::map<std::vector<int>, PetscInt> number_of_set{{{}, 0}};
  std::vector<int> sent;  // of each set its size, then its groups
  for (const Sets& sets : own) {
    for (const std::vector<int>& set : sets) {
      if (number_of_set.emplace(set, 0).second) {
        sent.push_back(static_cast<int>(set.size()));
        sent.insert(sent.end(), set.begin(), set.end());
      }
    }
  }
  const std::vector<int> all = of_all_ranks(comm, sent);
  for (auto next = all.begin(); next != all.end(); next += 1 + *next) {
    number_of_set.emplace(std::vector<int>(next + 1, next + 1 + *next), 0);
  }
  rows.group_sets.clear();
  for (auto& [set, number] : number_of_set) {
    number = static_cast<PetscInt>(rows.group_sets.size());
    rows.group_sets.push_back(set);
  }
  const auto number_rows = [&number_of_set](std::vector<MeshRows::Point>& points, const Sets& sets) {
    for (std::size_t row = 0; row < sets.size(); ++row) {
      points[row].group_set = number_of_set.at(sets[row]);
    }
  };
  number_rows(rows.vertices, own[0]);
  number_rows(rows.cells, own[1]);
}

MeshRows::Point row_of(const Surface& points, PetscInt particle) {
  MeshRows::Point row;
  row.id = points.persistent_id[particle];
  Eigen::Map<Eigen::Vector3d>(row.position.data()) = points.rest.col(particle);
  if (points.uv.cols() > 0) {
    Eigen::Map<Eigen::Vector2d>(row.uv.data()) = points.uv.col(particle);
  }
  return row;
}

MeshRows vertex_rows(const Surface& points, PetscInt count) {
  MeshRows rows;
  rows.has_uv = on_any_rank(points.comm(), points.uv.cols() > 0);
  for (PetscInt vertex = 0; vertex < count; ++vertex) {
    rows.vertices.push_back(row_of(points, vertex));
  }
  return rows;
}

}  // namespace pellicle::surface
