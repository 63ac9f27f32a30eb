#pragma once

#include <petscsf.h>

#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "projection/spring_lines.h"
#include "surface/sheet.h"

namespace pellicle::projection {

/// Twice the particle that two springs share, plus one if it is the first end of one and the second of the other, so
/// that the gradients by it have different signs; -1 if they share none.
PetscInt joint_of(const SpringSet& springs, PetscInt one, PetscInt other);

/// A matrix of some rows and columns of J W J^T (burning paper, eq. 16) of one colour. Its pattern is made once, from
/// the topology; `update` fills in values without communication.
class GramBlock {
 public:
  /// @param rows owned spring of each row of this rank, or -1 for an empty row
  /// @param columns global column of each local spring, or -1 for none
  /// @param owned_columns number of columns of this rank
  /// @param is_skipped whether the entry of a row's spring and a column's spring is left out, may be empty
  /// @throws Error if two springs join the same two particles. Collective.
  GramBlock(const SpringSet& springs, const Layout& particles, const std::vector<PetscInt>& rows,
            const std::vector<PetscInt>& columns, PetscInt owned_columns,
            const std::function<bool(PetscInt, PetscInt)>& is_skipped = {});

  /// Collective.
  /// @param gradient of the local springs, (3 x local)
  /// @param inverse_mass of the local particles
  /// @param diagonal entry of each owned spring with itself
  void update(const Eigen::Matrix3Xd& gradient, const std::vector<double>& inverse_mass,
              const std::vector<double>& diagonal);

  Mat matrix() const { return matrix_; }

 private:
  /// A stored entry.
  struct Entry {
    PetscInt spring;  ///< of the column
    PetscInt joint;   ///< of the row's spring with it (joint_of)
  };
  /// The entries of the columns of this rank, or of the columns of other ranks, in the order of the matrix.
  struct Part {
    std::vector<PetscInt> springs;     ///< springs of the rows with entries
    std::vector<PetscInt> offsets{0};  ///< (these rows + 1)
    std::vector<Entry> entries;
    std::vector<PetscInt> diagonal;  ///< entries of springs with themselves
  };

  static void fill(Mat matrix, const Part& part, const Eigen::Matrix3Xd& gradient,
                   const std::vector<double>& inverse_mass, const std::vector<double>& diagonal);

  Part own_;
  Part foreign_;
  MatHandle matrix_;
};

/// Products with a range of rows of a block at a time, so that they are used while in the cache.
class GramRows {
 public:
  /// @param matrix of a GramBlock. Collective.
  explicit GramRows(Mat matrix);

  /// Fetches the values of other ranks' columns; `in` may not change between the two calls. Collective.
  /// @param in values of this rank's columns
  void begin(const double* in);
  void end(const double* in);
  /// out = `count` rows from `first` on, times `in`. @param out (count)
  void multiply(std::size_t first, std::size_t count, const double* in, double* out) const;

  /// out -= `count` transposed rows from `first` on, times `values`; parts for other ranks' columns wait for `send`.
  /// @param values (count)
  void subtract_transposed(std::size_t first, std::size_t count, const double* values, double* out);
  /// Adds the waiting contributions of all ranks to `out`. Collective.
  void send(double* out);

 private:
  /// Compressed rows of PETSc. The pattern stays, so that these do.
  struct Rows {
    const PetscInt* offsets = nullptr;
    const PetscInt* columns = nullptr;
    const double* values = nullptr;
  };
  static Rows rows_of(Mat matrix);
  /// The rows with foreign columns in a range.
  std::pair<const std::size_t*, const std::size_t*> foreign_rows(std::size_t first, std::size_t count) const;

  Rows own_;
  Rows foreign_;                           ///< on several ranks
  std::vector<std::size_t> foreign_rows_;  ///< rows with foreign columns
  Handle<PetscSF, PetscSFDestroy> sf_;     ///< on several ranks
  std::vector<double> ghosts_;             ///< values of foreign columns
  std::vector<double> changes_;            ///< contributions to foreign columns
};

}  // namespace pellicle::projection
