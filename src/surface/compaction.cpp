#include "surface/compaction.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "surface/distribution.h"
#include "surface/shell_assembly.h"

namespace pellicle {

namespace {

// What is sent of a particle: id, place, texture coordinates, initial mass, then the caller's data. Of a cell also the
// ids of its corners, its rank and the caller's data, behind those of its lattice particle.
constexpr Eigen::Index mass_row = 6;
constexpr Eigen::Index particle_rows = 7;
constexpr Eigen::Index cell_rows = 5;
constexpr Eigen::Index rank_row = 4;  // behind the corners

/// Columns of some owned particles.
Eigen::MatrixXd pack(const Sheet& sheet, const std::vector<PetscInt>& particles, const Eigen::MatrixXd& data) {
  Eigen::MatrixXd sent(particle_rows + data.rows(), static_cast<Eigen::Index>(particles.size()));
  for (Eigen::Index column = 0; column < sent.cols(); ++column) {
    const PetscInt i = particles[static_cast<std::size_t>(column)];
    sent.col(column).head<4>() << sheet.persistent_id[static_cast<std::size_t>(i)], sheet.rest.col(i);
    sent.col(column).segment<2>(4) = sheet.uv.cols() > 0 ? Eigen::Vector2d(sheet.uv.col(i)) : Eigen::Vector2d::Zero();
    sent(mass_row, column) = sheet.initial_mass[static_cast<std::size_t>(i)];
    sent.col(column).tail(data.rows()) = data.col(i);
  }
  return sent;
}

/// The columns of all ranks, on rank 0, in the order of their ids. Collective.
Eigen::MatrixXd gather(MPI_Comm comm, const Eigen::MatrixXd& sent) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  const auto count = static_cast<int>(sent.cols());
  std::vector<int> counts(static_cast<std::size_t>(ranks), 0);
  std::vector<int> offsets(static_cast<std::size_t>(ranks), 0);
  MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm);
  std::partial_sum(counts.begin(), counts.end() - 1, offsets.begin() + 1);
  Eigen::MatrixXd received(sent.rows(), rank == 0 ? offsets.back() + counts.back() : 0);
  MPI_Datatype column = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(static_cast<int>(sent.rows()), MPI_DOUBLE, &column);
  MPI_Type_commit(&column);
  MPI_Gatherv(sent.data(), count, column, received.data(), counts.data(), offsets.data(), column, 0, comm);
  MPI_Type_free(&column);

  std::vector<Eigen::Index> order(static_cast<std::size_t>(received.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&received](Eigen::Index a, Eigen::Index b) { return received(0, a) < received(0, b); });
  return received(Eigen::all, order);
}

/// Columns of some owned cells. @param rank this one
Eigen::MatrixXd pack_cells(const Sheet& sheet, const std::vector<PetscInt>& cells, const Eigen::MatrixXd& particle_data,
                           const Eigen::MatrixXd& cell_data, int rank) {
  std::vector<PetscInt> lattice;
  for (const PetscInt cell : cells) {
    lattice.push_back(sheet.lattice[static_cast<std::size_t>(cell)]);
  }
  Eigen::MatrixXd sent(particle_rows + particle_data.rows() + cell_rows + cell_data.rows(),
                       static_cast<Eigen::Index>(cells.size()));
  sent.topRows(particle_rows + particle_data.rows()) = pack(sheet, lattice, particle_data);
  for (Eigen::Index i = 0; i < sent.cols(); ++i) {
    const PetscInt cell = cells[static_cast<std::size_t>(i)];
    auto column = sent.col(i).tail(cell_rows + cell_data.rows());
    for (std::size_t k = 0; k < 4; ++k) {
      const PetscInt corner = sheet.cells[static_cast<std::size_t>(cell)][k];
      column[static_cast<Eigen::Index>(k)] = sheet.persistent_id[static_cast<std::size_t>(corner)];
    }
    column[rank_row] = rank;
    column.tail(cell_data.rows()) = cell_data.col(cell);
  }
  return sent;
}

/// What is left of a sheet, in the memory of rank 0.
struct Remainder {
  SurfaceMesh mesh;  ///< points and faces in the order of their ids
  Distribution::Source source;
};

/// @param cells all that stay
/// @param corners all of them and perhaps more
/// @param data_rows of the callers' particle data and cell data
Remainder join(const Eigen::MatrixXd& cells, const Eigen::MatrixXd& corners, PetscInt first_lattice_id,
               const std::array<Eigen::Index, 2>& data_rows) {
  const Eigen::Index particle_data = data_rows[0];  // Clang lets no lambda use a structured binding.
  const Eigen::Index cell_data = data_rows[1];
  const Eigen::Index first_cell_row = particle_rows + particle_data;
  const auto cell_corner = [&](Eigen::Index cell, Eigen::Index k) {
    return static_cast<std::size_t>(cells(first_cell_row + k, cell));
  };
  constexpr int unused = -1;
  std::vector<int> vertex_of_id(static_cast<std::size_t>(first_lattice_id), unused);
  for (Eigen::Index cell = 0; cell < cells.cols(); ++cell) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      vertex_of_id[cell_corner(cell, k)] = 0;
    }
  }
  Remainder rest;
  std::vector<Distribution::Data>& data = rest.source.data;
  Eigen::MatrixXd& extra = rest.source.extra;
  extra.setZero(1 + particle_data + cell_data, cells.cols() + corners.cols());
  const auto add = [&](const Eigen::MatrixXd& received, Eigen::Index column) {
    const auto point = static_cast<Eigen::Index>(data.size());
    Distribution::Data& added = data.emplace_back();
    added.id = received(0, column);
    Eigen::Map<Eigen::Vector3d>(added.position) = received.col(column).segment<3>(1);
    Eigen::Map<Eigen::Vector2d>(added.uv) = received.col(column).segment<2>(4);
    extra.col(point).head(1 + particle_data) = received.col(column).segment(mass_row, 1 + particle_data);
  };
  for (Eigen::Index cell = 0; cell < cells.cols(); ++cell) {
    add(cells, cell);
    extra.col(cell).tail(cell_data) = cells.col(cell).tail(cell_data);
  }
  for (Eigen::Index corner = 0; corner < corners.cols(); ++corner) {
    int& vertex = vertex_of_id[static_cast<std::size_t>(corners(0, corner))];
    if (vertex != unused) {
      vertex = static_cast<int>(rest.mesh.points.size());
      rest.mesh.points.emplace_back(corners.col(corner).segment<3>(1));
      add(corners, corner);
    }
  }
  extra.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(data.size()));
  for (Eigen::Index cell = 0; cell < cells.cols(); ++cell) {
    auto& face = rest.mesh.faces.emplace_back(4);
    for (std::size_t k = 0; k < 4; ++k) {
      face[k] = vertex_of_id[cell_corner(cell, static_cast<Eigen::Index>(k))];
    }
  }
  return rest;
}

/// Records as columns of numbers that are copied and never looked at.
Eigen::MatrixXd columns_of(const Records& records) {
  const auto rows = static_cast<Eigen::Index>((records.bytes() + sizeof(double) - 1) / sizeof(double));
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows, records.count());
  for (PetscInt item = 0; item < records.count(); ++item) {
    std::copy_n(records.at(item), records.bytes(), reinterpret_cast<std::byte*>(columns.col(item).data()));
  }
  return columns;
}

}  // namespace

CompactedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles,
                       const Records& cell_records, const SheetOptions& options) {
  const Eigen::MatrixXd particle_data = columns_of(particles);
  const Eigen::MatrixXd cell_data = columns_of(cell_records);
  MPI_Comm comm = sheet.comm();
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  std::vector<PetscInt> cells;
  for (PetscInt cell = 0; cell < sheet.owned_cells; ++cell) {
    if (kept[static_cast<std::size_t>(cell)]) {
      cells.push_back(cell);
    }
  }
  std::vector<PetscInt> corners(static_cast<std::size_t>(sheet.owned_corners));
  std::iota(corners.begin(), corners.end(), 0);

  const Eigen::MatrixXd all_cells = gather(comm, pack_cells(sheet, cells, particle_data, cell_data, rank));
  const Eigen::MatrixXd all_corners = gather(comm, pack(sheet, corners, particle_data));

  // The most cells of a rank, and whether there are texture coordinates.
  std::array<PetscInt, 2> maxima{static_cast<PetscInt>(cells.size()), sheet.uv.cols() > 0 ? 1 : 0};
  auto total = static_cast<PetscInt>(cells.size());
  MPI_Allreduce(MPI_IN_PLACE, maxima.data(), 2, MPIU_INT, MPI_MAX, comm);
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, comm);
  Remainder rest;
  if (rank == 0) {
    rest = join(all_cells, all_corners, sheet.first_lattice_id, {particle_data.rows(), cell_data.rows()});
    rest.source.has_uv = maxima[1] != 0;
    if (static_cast<double>(maxima[0]) * ranks <= options.imbalance_limit * static_cast<double>(total)) {
      const Eigen::RowVectorXi part = all_cells.row(particle_rows + particle_data.rows() + rank_row).cast<int>();
      rest.source.part.assign(part.begin(), part.end());
    }
  }
  const Distribution distribution(comm, rest.mesh, std::move(rest.source), shell_layers, options);
  AssembledShell shell = assemble_shell(distribution);

  CompactedSheet compacted;
  compacted.sheet = std::move(shell.sheet);
  compacted.sheet.first_lattice_id = sheet.first_lattice_id;
  compacted.sheet.id_end = sheet.id_end;
  const auto set = [](Records& records, PetscInt item, const auto& column) {
    const Eigen::VectorXd numbers = column;
    std::copy_n(reinterpret_cast<const std::byte*>(numbers.data()), records.bytes(), records.at(item));
  };
  compacted.particles = Records(particles.bytes(), static_cast<PetscInt>(shell.points.size()));
  for (PetscInt i = 0; i < compacted.particles.count(); ++i) {
    set(compacted.particles, i,
        distribution.extra(shell.points[static_cast<std::size_t>(i)]).segment(1, particle_data.rows()));
  }
  const std::vector<PetscInt>& lattice = compacted.sheet.lattice;
  compacted.cells = Records(cell_records.bytes(), static_cast<PetscInt>(lattice.size()));
  for (PetscInt cell = 0; cell < compacted.cells.count(); ++cell) {
    const auto particle = static_cast<std::size_t>(lattice[static_cast<std::size_t>(cell)]);
    set(compacted.cells, cell, distribution.extra(shell.points[particle]).tail(cell_data.rows()));
  }
  return compacted;
}

}  // namespace pellicle
