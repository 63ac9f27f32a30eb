#include "state/mesh_tables.h"

#include <algorithm>

#include "base/error.h"
#include "parallel/collective.h"
#include "state/sorted_rows.h"

namespace pellicle::state {

namespace {

const char* const field_prefix = "FIELD_";

using Point = MeshRows::Point;

/// A member of all points, one number or several of each.
template <class Number, class Member>
std::vector<Number> column(const std::vector<Point>& points, Member Point::*member) {
  std::vector<Member> members;
  for (const Point& point : points) {
    members.push_back(point.*member);
  }
  return Records::of(members).template as<Number>();
}

template <class Number, class Member>
void set(std::vector<Point>& points, const std::vector<Number>& numbers, Member Point::*member) {
  const auto count = static_cast<PetscInt>(points.size());
  const std::vector<Member> members =
      Records::of(numbers, count, sizeof(Member) / sizeof(Number)).template as<Member>();
  for (std::size_t k = 0; k < points.size(); ++k) {
    points[k].*member = members[k];
  }
}

}  // namespace

void write_mesh(Hdf5File& file, const std::string& group, const MeshRows& rows) {
  MPI_Comm comm = file.comm();
  file.write_once<int>(group + "/ranks", {ranks_of(comm)});
  file.write_once<int>(group + "/corners", {rows.corners});
  file.write_lines(group + "/groups", rows.groups);
  file.write_lines(group + "/fields", rows.fields);
  std::vector<int> sets;  // of each its size, then its numbers
  for (const std::vector<int>& numbers : rows.group_sets) {
    sets.push_back(static_cast<int>(numbers.size()));
    sets.insert(sets.end(), numbers.begin(), numbers.end());
  }
  file.write_once(group + "/group_sets", sets);

  const SortedRows by_vertex(comm, column<PetscInt>(rows.vertices, &Point::id));
  const auto vertices = by_vertex.sorted(rows.vertices);
  const std::string of_vertices = group + "/vertices/";
  file.write(of_vertices + "id", column<PetscInt>(vertices, &Point::id));
  file.write(of_vertices + "position", column<double>(vertices, &Point::position), 3);
  if (rows.has_uv) {
    file.write(of_vertices + "uv", column<double>(vertices, &Point::uv), 2);
  }
  file.write(of_vertices + "group_set", column<PetscInt>(vertices, &Point::group_set));
  const auto has_mass = [](const Point& vertex) { return vertex.mass > 0; };
  if (on_any_rank(comm, std::any_of(vertices.begin(), vertices.end(), has_mass))) {
    file.write(of_vertices + "mass", column<double>(vertices, &Point::mass));
  }

  const SortedRows by_cell(comm, column<PetscInt>(rows.cells, &Point::id));
  const auto cells = by_cell.sorted(rows.cells);
  const std::string of_cells = group + "/cells/";
  file.write(of_cells + "id", column<PetscInt>(cells, &Point::id));
  file.write(of_cells + "group_set", column<PetscInt>(cells, &Point::group_set));
  file.write(of_cells + "corners", by_cell.sorted(rows.cell_corners, rows.corners), rows.corners);
  file.write(of_cells + "rank", by_cell.sorted(rows.part));
  if (rows.has_uv) {
    file.write(of_cells + "uv", column<double>(cells, &Point::uv), 2);
  }
  const auto fields = static_cast<int>(rows.fields.size());
  const std::vector<double> values = by_cell.sorted(rows.field_values, fields);
  for (int field = 0; field < fields; ++field) {
    std::vector<double> one;
    for (std::size_t k = static_cast<std::size_t>(field); k < values.size(); k += static_cast<std::size_t>(fields)) {
      one.push_back(values[k]);
    }
    file.write(of_cells + field_prefix + std::to_string(field), one);
  }
}

MeshRows read_mesh(const Hdf5File& file, const std::string& group) {
  const int ranks = ranks_of(file.comm());
  MeshRows rows;
  rows.corners = file.read_all<int>(group + "/corners").at(0);
  rows.groups = file.read_lines(group + "/groups");
  rows.fields = file.read_lines(group + "/fields");
  rows.group_sets.clear();
  const std::vector<int> sets = file.read_all<int>(group + "/group_sets");
  for (auto next = sets.begin(); next != sets.end(); next += 1 + *next) {
    rows.group_sets.emplace_back(next + 1, next + 1 + *next);
  }

  const std::string of_vertices = group + "/vertices/";
  const std::string of_cells = group + "/cells/";
  rows.has_uv = file.has(of_vertices + "uv");
  file.require_equal_rows(group + "/vertices");
  file.require_equal_rows(group + "/cells");
  const auto vertex_ids = file.read<PetscInt>(of_vertices + "id");
  rows.vertices.resize(vertex_ids.size());
  set(rows.vertices, vertex_ids, &Point::id);
  set(rows.vertices, file.read<double>(of_vertices + "position", 3), &Point::position);
  set(rows.vertices, file.read<PetscInt>(of_vertices + "group_set"), &Point::group_set);
  if (file.has(of_vertices + "mass")) {
    set(rows.vertices, file.read<double>(of_vertices + "mass"), &Point::mass);
  }
  const auto cell_ids = file.read<PetscInt>(of_cells + "id");
  rows.cells.resize(cell_ids.size());
  set(rows.cells, cell_ids, &Point::id);
  if (file.has(of_cells + "group_set")) {  // older files have none
    set(rows.cells, file.read<PetscInt>(of_cells + "group_set"), &Point::group_set);
  }
  rows.cell_corners = file.read<PetscInt>(of_cells + "corners", rows.corners);
  if (rows.has_uv) {
    set(rows.vertices, file.read<double>(of_vertices + "uv", 2), &Point::uv);
    set(rows.cells, file.read<double>(of_cells + "uv", 2), &Point::uv);
  }
  if (file.read_all<int>(group + "/ranks").at(0) == ranks) {
    rows.part = file.read<int>(of_cells + "rank");
    together(file.comm(), [&] {
      for (const int rank : rows.part) {
        if (rank < 0 || rank >= ranks) {
          throw Error(file.path() + ": table " + of_cells + "rank: " + std::to_string(rank) + "; expected 0 to " +
                      std::to_string(ranks - 1));
        }
      }
    });
  }
  const std::size_t fields = rows.fields.size();
  rows.field_values.resize(fields * rows.cells.size());
  for (std::size_t field = 0; field < fields; ++field) {
    const auto values = file.read<double>(of_cells + field_prefix + std::to_string(field));
    for (std::size_t cell = 0; cell < values.size(); ++cell) {
      rows.field_values[cell * fields + field] = values[cell];
    }
  }
  return rows;
}

}  // namespace pellicle::state
