#include "parallel/exchange.h"

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::parallel {

GhostExchange::GhostExchange(const Layout& layout) : owned_(layout.owned) {
  if (!on_any_rank(layout.comm, layout.ghosts() > 0)) {
    return;
  }
  Handle<PetscLayout, PetscLayoutDestroy> owners;
  check(PetscLayoutCreateFromSizes(layout.comm, layout.owned, layout.global, 1, owners.create()));
  check(PetscSFCreate(layout.comm, sf_.create()));
  check(PetscSFSetGraphLayout(sf_, owners, layout.ghosts(), nullptr, PETSC_COPY_VALUES, layout.ghost_global.data()));
  check(PetscSFSetUp(sf_));
}

void GhostExchange::copy(MPI_Datatype type, std::size_t bytes, void* values) const {
  if (sf_ != nullptr) {
    void* ghosts = static_cast<char*>(values) + static_cast<std::size_t>(owned_) * bytes;
    check(PetscSFBcastBegin(sf_, type, values, ghosts, MPI_REPLACE));
    check(PetscSFBcastEnd(sf_, type, values, ghosts, MPI_REPLACE));
  }
}

void GhostExchange::combine(MPI_Datatype type, std::size_t bytes, MPI_Op operation, void* values) const {
  if (sf_ != nullptr) {
    const void* ghosts = static_cast<char*>(values) + static_cast<std::size_t>(owned_) * bytes;
    check(PetscSFReduceBegin(sf_, type, ghosts, values, operation));
    check(PetscSFReduceEnd(sf_, type, ghosts, values, operation));
  }
}

}  // namespace pellicle::parallel
