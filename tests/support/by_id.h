#pragma once

#include <Eigen/Core>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle {

/// Values of the owned particles of all ranks by persistent id, (components x ids). Collective.
/// @param values of the owned particles, and more behind them
inline Eigen::MatrixXd by_id(const Surface& surface, const Eigen::Ref<const Eigen::MatrixXd>& values) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(values.rows(), surface.id_end);
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    all.col(surface.persistent_id[i]) = values.col(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, all.data(), static_cast<int>(all.size()), MPI_DOUBLE, MPI_SUM, surface.comm());
  return all;
}

inline Eigen::MatrixXd by_id(const Surface& surface, const Field& field) { return by_id(surface, field.values()); }

}  // namespace pellicle
