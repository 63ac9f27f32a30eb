#include "solvers/own_preconditioner.h"

#include <petsc/private/pcimpl.h>  // as PETSc's own types: a registered one has no public constructor

#include <set>

#include "base/error.h"
#include "base/handle.h"

namespace pellicle {
inline namespace solvers {

namespace {

std::set<std::string>& own_types() {
  static std::set<std::string> types;
  return types;
}

/// Name under which a matrix keeps its preconditioner. Short, so that asking for it allocates nothing.
std::string key_of(const std::string& type) { return "own_pc_" + type; }

const OwnPreconditioner* offered_by(Mat matrix, const std::string& type) {
  PetscContainer container = nullptr;
  check(PetscObjectQuery(reinterpret_cast<PetscObject>(matrix), key_of(type).c_str(),
                         reinterpret_cast<PetscObject*>(&container)));
  void* offered = nullptr;
  if (container != nullptr) {
    check(PetscContainerGetPointer(container, &offered));
  }
  return static_cast<const OwnPreconditioner*>(offered);
}

const OwnPreconditioner& preconditioner_of(PC pc) {
  const std::string type = reinterpret_cast<PetscObject>(pc)->type_name;
  const OwnPreconditioner* offered = pc->pmat != nullptr ? offered_by(pc->pmat, type) : nullptr;
  if (offered == nullptr) {
    throw Error("the matrix has no preconditioner " + type);
  }
  return *offered;
}

PetscErrorCode set_up(PC pc) {
  return as_petsc_callback([&] {
    const OwnPreconditioner& offered = preconditioner_of(pc);
    pc->data = const_cast<OwnPreconditioner*>(&offered);
    if (offered.update) {
      offered.update();
    }
  });
}

PetscErrorCode apply(PC pc, Vec in, Vec out) {
  return as_petsc_callback([&] { static_cast<const OwnPreconditioner*>(pc->data)->apply(in, out); });
}

PetscErrorCode view(PC pc, PetscViewer viewer) {
  return as_petsc_callback(
      [&] { check(PetscViewerASCIIPrintf(viewer, "  %s\n", preconditioner_of(pc).words.c_str())); });
}

PetscErrorCode create(PC pc) {
  pc->ops->setup = set_up;
  pc->ops->apply = apply;
  pc->ops->applytranspose = apply;
  pc->ops->view = view;
  return 0;
}

}  // namespace

void offer_preconditioner(Mat matrix, const std::string& type, const OwnPreconditioner& offered) {
  if (own_types().insert(type).second) {
    check(PCRegister(type.c_str(), create));
  }
  Handle<PetscContainer, PetscContainerDestroy> container;
  check(PetscContainerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(matrix)), container.create()));
  check(PetscContainerSetPointer(container, const_cast<OwnPreconditioner*>(&offered)));
  check(PetscObjectCompose(reinterpret_cast<PetscObject>(matrix), key_of(type).c_str(),
                           reinterpret_cast<PetscObject>(PetscContainer(container))));
}

bool is_own_type(const std::string& type) { return own_types().count(type) > 0; }

bool offers_preconditioner(Mat matrix, const std::string& type) { return offered_by(matrix, type) != nullptr; }

}  // namespace solvers
}  // namespace pellicle
