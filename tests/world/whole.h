#pragma once

#include <mpi.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/by_id.h"
#include "world/state.h"

namespace pellicle {

/// What all ranks together have of a sheet.
struct Whole {
  struct Spring {
    std::size_t colour;
    int a;
    int b;
    double target;  ///< [m]
    bool lives;
  };
  struct Cell {
    std::array<int, 4> corners;
    int lattice;
    std::array<bool, 4> triangles;  ///< which live
  };

  /// Collective.
  Whole(const Sheet& sheet, const State& state)
      : x(by_id(sheet, state.position)),
        v(by_id(sheet, state.velocity)),
        temperature(by_id(sheet, state.burning->temperature).row(0)),
        mass(by_id(sheet, state.burning->mass).row(0)),
        mass_change(by_id(sheet, state.burning->mass_change).row(0)) {
    const auto id = [&](PetscInt i) { return static_cast<double>(sheet.persistent_id[i]); };
    std::vector<double> own_springs;
    for (std::size_t colour = 0; colour < 4; ++colour) {
      const SpringSet& set = sheet.springs[colour];
      for (PetscInt s = 0; s < set.owned(); ++s) {
        own_springs.insert(own_springs.end(),
                           {static_cast<double>(colour), id(set.ends[s][0]), id(set.ends[s][1]),
                            state.target_length[colour][s], state.burning->active.springs[colour][s] ? 1.0 : 0.0});
      }
    }
    const std::vector<double> all_springs = of_all_ranks(own_springs);
    for (auto row = all_springs.begin(); row != all_springs.end(); row += 5) {
      springs.push_back(
          {static_cast<std::size_t>(row[0]), static_cast<int>(row[1]), static_cast<int>(row[2]), row[3], row[4] > 0});
    }
    std::vector<double> own_cells;
    for (PetscInt c = 0; c < sheet.elements.owned; ++c) {
      for (const PetscInt corner : sheet.cells[c]) {
        own_cells.push_back(id(corner));
      }
      own_cells.push_back(id(sheet.lattice[c]));
      const auto first = state.burning->active.triangles.begin() + static_cast<std::ptrdiff_t>(4 * c);
      own_cells.insert(own_cells.end(), first, first + 4);
    }
    const std::vector<double> all_cells = of_all_ranks(own_cells);
    for (auto row = all_cells.begin(); row != all_cells.end(); row += 9) {
      Cell& cell = cells.emplace_back();
      std::copy_n(row, 4, cell.corners.begin());
      cell.lattice = static_cast<int>(row[4]);
      std::copy_n(row + 5, 4, cell.triangles.begin());
    }
  }

  static std::vector<double> of_all_ranks(const std::vector<double>& own) {
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    const auto count = static_cast<int>(own.size());
    std::vector<int> counts(ranks);
    MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, PETSC_COMM_WORLD);
    std::vector<int> offsets(counts.size(), 0);
    std::partial_sum(counts.begin(), counts.end() - 1, offsets.begin() + 1);
    std::vector<double> all(offsets.back() + counts.back());
    MPI_Allgatherv(own.data(), count, MPI_DOUBLE, all.data(), counts.data(), offsets.data(), MPI_DOUBLE,
                   PETSC_COMM_WORLD);
    return all;
  }

  /// A value of each active triangle: half of it to the cell's lattice point, a quarter to each of its corners.
  template <class Value>
  Eigen::RowVectorXd shared(const Value& of_triangle) const {
    Eigen::RowVectorXd result = Eigen::RowVectorXd::Zero(mass.size());
    for (const Cell& cell : cells) {
      const double value = of_triangle(cell);
      for (std::size_t k = 0; k < 4; ++k) {
        if (cell.triangles[k]) {
          result[cell.lattice] += value / 2;
          result[cell.corners[k]] += value / 4;
          result[cell.corners[(k + 1) % 4]] += value / 4;
        }
      }
    }
    return result;
  }

  /// ||C|| of one colour (eq. 10), or of all. @param x positions [m]
  double error(const Eigen::MatrixXd& x, std::optional<std::size_t> colour = {}) const {
    double sum = 0;
    for (const Spring& spring : springs) {
      if (spring.lives && spring.colour == colour.value_or(spring.colour)) {
        const double squared = (x.col(spring.a) - x.col(spring.b)).squaredNorm();
        sum += std::pow(squared / spring.target - spring.target, 2);
      }
    }
    return std::sqrt(sum);
  }

  /// |d/l - 1| of the active springs of a colour.
  std::vector<double> strains(std::size_t colour) const {
    std::vector<double> result;
    for (const Spring& spring : springs) {
      if (spring.lives && spring.colour == colour) {
        result.push_back(std::abs((x.col(spring.a) - x.col(spring.b)).norm() / spring.target - 1));
      }
    }
    return result;
  }

  /// Masses of the parts that springs hold together, the part of most particles first [kg].
  std::vector<double> pieces() const {
    std::vector<int> part(mass.size());
    std::iota(part.begin(), part.end(), 0);
    for (bool changed = true; changed;) {
      changed = false;
      for (const Spring& spring : springs) {
        int& a = part[spring.a];
        int& b = part[spring.b];
        if (spring.lives && a != b) {
          a = b = std::min(a, b);
          changed = true;
        }
      }
    }
    std::map<int, std::pair<int, double>> parts;  // particles and mass
    for (const Spring& spring : springs) {
      if (spring.lives) {
        parts[part[spring.a]] = {};
      }
    }
    for (std::size_t i = 0; i < part.size(); ++i) {
      if (const auto found = parts.find(part[i]); found != parts.end()) {
        found->second.first += 1;
        found->second.second += mass[static_cast<Eigen::Index>(i)];
      }
    }
    std::vector<std::pair<int, double>> sorted;
    for (const auto& [number, piece] : parts) {
      sorted.push_back(piece);
    }
    std::sort(sorted.rbegin(), sorted.rend());
    std::vector<double> masses;
    for (const auto& [particles, piece_mass] : sorted) {
      masses.push_back(piece_mass);
    }
    return masses;
  }

  Eigen::MatrixXd x;
  Eigen::MatrixXd v;
  Eigen::RowVectorXd temperature;
  Eigen::RowVectorXd mass;
  Eigen::RowVectorXd mass_change;
  std::vector<Spring> springs;
  std::vector<Cell> cells;
};

}  // namespace pellicle
