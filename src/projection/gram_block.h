#pragma once

#include <petscsf.h>

#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "projection/spring_lines.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace projection {

/// Some rows and columns of J W J^T (burning paper, eq. 16) of one colour as a matrix. Its pattern is made once, from
/// the topology; `update` fills in values and does not communicate.
class GramBlock {
 public:
  /// @param rows owned spring of each row of this rank, or -1 for an empty row
  /// @param columns global column of each local spring, or -1 for none
  /// @param owned_columns number of columns of this rank
  /// @param is_skipped whether the entry of a row's spring and a column's spring is left out, may be empty
  /// @throws Error when two springs join the same two particles. Collective.
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
  /// One stored entry: its column's spring, and twice the particle that both springs share, plus one if it is a
  /// different end of each, so that their gradients by it have different signs.
  struct Entry {
    PetscInt spring;
    PetscInt signed_particle;
  };
  /// The entries of the columns of this rank, or of the columns of other ranks, in the order of the matrix.
  struct Part {
    std::vector<PetscInt> springs;     ///< of the rows that have entries
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

/// Products with some rows of a block at a time, so that a caller can use them before they leave the cache.
class GramRows {
 public:
  /// @param matrix of a GramBlock. Collective.
  explicit GramRows(Mat matrix);

  /// Brings the values of the columns of other ranks; between the two calls they may not be changed. Collective.
  /// @param in values of this rank's columns
  void begin(const double* in);
  void end(const double* in);
  /// out = the rows from `first` on, times these values. @param out (count)
  void multiply(std::size_t first, std::size_t count, const double* in, double* out) const;

  /// out -= the same rows, transposed, times values. What is of other ranks' columns waits for `send`.
  /// @param values (count)
  void subtract_transposed(std::size_t first, std::size_t count, const double* values, double* out);
  /// Collective.
  void send(double* out);

 private:
  /// Compressed rows, as PETSc keeps them.
  struct Rows {
    const PetscInt* offsets = nullptr;
    const PetscInt* columns = nullptr;
    const double* values = nullptr;
  };
  static Rows rows_of(Mat matrix);
  /// Those of the rows with foreign columns that are in a range.
  std::pair<const std::size_t*, const std::size_t*> foreign_rows(std::size_t first, std::size_t count) const;

  Rows own_;
  Rows foreign_;                           ///< on several ranks
  std::vector<std::size_t> foreign_rows_;  ///< that have foreign columns
  Handle<PetscSF, PetscSFDestroy> sf_;     ///< on several ranks
  std::vector<double> ghosts_;             ///< by foreign column
  std::vector<double> changes_;            ///< likewise
};

}  // namespace projection
}  // namespace pellicle
