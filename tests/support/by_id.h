#pragma once

#include <Eigen/Core>

#include "parallel/field.h"
#include "surface/sheet.h"

namespace pellicle {

/// A particle field of all ranks by persistent id, (components x ids). Collective.
inline Eigen::MatrixXd by_id(const Sheet& sheet, const Field& field) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(field.components(), sheet.id_end);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    all.col(sheet.persistent_id[static_cast<std::size_t>(i)]) = field.values().col(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM, sheet.comm());
  return all;
}

}  // namespace pellicle
