#pragma once

#include <petscdm.h>

#include <string>
#include <vector>

#include "base/handle.h"

namespace pellicle::linear {

using DmHandle = Handle<DM, DMDestroy>;

/// Names of the rows of a system, which repeat: x, y, z, x, y, z, ...; the rows of a border, the last of rank 0, have a
/// name of their own.
struct NamedFields {
  std::vector<std::string> components;
  std::string border;
  PetscInt border_rows = 0;  ///< of this rank
};

/// Makes a DM with the fields of a matrix's vectors, so that `-<prefix>dm_view` shows them and PCFIELDSPLIT splits by
/// their names. Collective.
DmHandle make_dm(Mat matrix, const std::string& prefix, const NamedFields& fields);

}  // namespace pellicle::linear
