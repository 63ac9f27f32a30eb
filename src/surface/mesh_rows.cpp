#include "surface/mesh_rows.h"

#include <Eigen/Core>
#include <map>
#include <utility>

#include "parallel/collective.h"

namespace pellicle {
inline namespace surface {

namespace {

/// Rank 0's names on every rank. Collective.
std::vector<std::string> broadcast(MPI_Comm comm, const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += name + '\0';
  }
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, 0, comm);
  std::vector<std::string> received;
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\0', begin) + 1) {
    received.emplace_back(text.c_str() + begin);
  }
  return received;
}

/// The rows of this rank's mesh, without the groups.
MeshRows own_rows_of(const SurfaceMesh& mesh) {
  MeshRows rows;
  rows.vertices.resize(mesh.points.size());
  for (std::size_t vertex = 0; vertex < mesh.points.size(); ++vertex) {
    MeshRows::Point& point = rows.vertices[vertex];
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
      const auto vertex = static_cast<std::size_t>(face[k]);
      rows.cell_corners.push_back(rows.vertices[vertex].id);
      if (!mesh.uv.empty()) {
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
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  MeshRows rows;
  std::array<int, 2> shape{};  // corners of a cell, texture or not
  std::vector<std::string> groups;
  std::vector<std::string> fields;
  std::vector<std::vector<int>> groups_of_vertex;
  if (rank == 0) {
    rows = own_rows_of(mesh);
    shape = {static_cast<int>(mesh.faces.front().size()), mesh.uv.empty() ? 0 : 1};
    groups_of_vertex.resize(mesh.points.size());
    for (const auto& [name, members] : mesh.groups) {
      const auto group = static_cast<int>(groups.size());
      groups.push_back(name);
      for (const int vertex : members) {
        std::vector<int>& of_vertex = groups_of_vertex[static_cast<std::size_t>(vertex)];
        if (of_vertex.empty() || of_vertex.back() != group) {
          of_vertex.push_back(group);
        }
      }
    }
    for (const auto& field : mesh.face_fields) {
      fields.push_back(field.first);
    }
  }
  MPI_Bcast(shape.data(), 2, MPI_INT, 0, comm);
  rows.corners = shape[0];
  rows.has_uv = shape[1] != 0;
  rows.fields = broadcast(comm, fields);
  set_groups(comm, rows, broadcast(comm, groups), groups_of_vertex);
  rows.cell_data = Records(0, static_cast<PetscInt>(rows.cells.size()));
  rows.lattice_data = rows.cell_data;
  rows.vertex_data = Records(0, static_cast<PetscInt>(rows.vertices.size()));
  return rows;
}

void set_groups(MPI_Comm comm, MeshRows& rows, std::vector<std::string> names,
                const std::vector<std::vector<int>>& groups_of_vertex) {
  rows.groups = std::move(names);
  // Each vertex is sent with one number, however many groups there are.
  std::map<std::vector<int>, PetscInt> number_of_set{{{}, 0}};
  std::vector<int> sent;  // of each set its size, then its groups
  for (const std::vector<int>& set : groups_of_vertex) {
    if (number_of_set.emplace(set, 0).second) {
      sent.push_back(static_cast<int>(set.size()));
      sent.insert(sent.end(), set.begin(), set.end());
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
  for (std::size_t vertex = 0; vertex < groups_of_vertex.size(); ++vertex) {
    rows.vertices[vertex].group_set = number_of_set.at(groups_of_vertex[vertex]);
  }
}

MeshRows::Point row_of(const Surface& points, PetscInt particle) {
  MeshRows::Point row;
  row.id = points.persistent_id[static_cast<std::size_t>(particle)];
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
  std::vector<std::string> names;
  std::vector<std::vector<int>> groups_of_vertex(rows.vertices.size());
  for (const auto& [name, members] : points.groups) {
    for (const PetscInt member : members) {
      if (member < count) {
        groups_of_vertex[static_cast<std::size_t>(member)].push_back(static_cast<int>(names.size()));
      }
    }
    names.push_back(name);
  }
  set_groups(points.comm(), rows, std::move(names), groups_of_vertex);
  return rows;
}

}  // namespace surface
}  // namespace pellicle
