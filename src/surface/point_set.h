#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "parallel/layout.h"

namespace pellicle {

/// How well the mesh is spread over the ranks.
struct PartitionQuality {
  PetscInt edge_cut = 0;   ///< pairs of neighbouring cells on different ranks
  double imbalance = 1.0;  ///< largest number of cells of a rank over the mean
};

/// The particles of a distributed mesh: what the sheets of both chains have.
struct PointSet {
  Layout particles;
  std::vector<PetscInt> persistent_id;  ///< of each local particle
  std::vector<bool> is_lattice;         ///< of each local particle: the lattice points of a two-layer shell
  std::vector<int> cell_count;          ///< cells round each owned particle; 0 for a lattice point
  Eigen::Matrix3Xd rest;                ///< undeformed positions of the local particles [m], (3 x local)
  Eigen::Matrix2Xd uv;                  ///< texture coordinates of the local particles, (2 x local), or no columns
  std::map<std::string, std::vector<PetscInt>> groups;  ///< named sets of local particles (vertices of the mesh)
  PartitionQuality partition;

  MPI_Comm comm() const { return particles.comm; }
};

}  // namespace pellicle
