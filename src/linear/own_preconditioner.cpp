#include "linear/own_preconditioner.h"

#include "base/error.h"
#include "base/handle.h"

namespace pellicle::linear {

namespace {

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

PetscErrorCode set_up(PC pc) {
  return as_petsc_callback([&] {
    const PCType type = type_of(pc);
    Mat matrix = nullptr;
    check(PCGetOperators(pc, nullptr, &matrix));
    const OwnPreconditioner* offered = offered_by(matrix, type);
    if (offered == nullptr) {
      throw Error("the matrix has no preconditioner " + std::string(type));
    }
    check(PCSetApplicationContext(pc, const_cast<OwnPreconditioner*>(offered)));
    const char* name = nullptr;
    check(PCShellGetName(pc, &name));
    if (name == nullptr || offered->words != name) {  // PETSc would copy it at each set-up.
      check(PCShellSetName(pc, offered->words.c_str()));
    }
    if (offered->update) {
      offered->update();
    }
  });
}

PetscErrorCode apply(PC pc, Vec in, Vec out) {
  return as_petsc_callback([&] {
    void* offered = nullptr;
    check(PCGetApplicationContext(pc, &offered));
    static_cast<const OwnPreconditioner*>(offered)->apply(in, out);
  });
}

/// Makes a preconditioner of an own type: a shell that keeps the type's name, as in the options.
PetscErrorCode create(PC pc) {
  return as_petsc_callback([&] {
    const std::string type = type_of(pc);  // PCSetType frees the name.
    check(PCSetType(pc, PCSHELL));
    check(PCShellSetSetUp(pc, set_up));
    check(PCShellSetApply(pc, apply));
    check(PCShellSetApplyTranspose(pc, apply));
    check(PetscObjectChangeTypeName(reinterpret_cast<PetscObject>(pc), type.c_str()));
  });
}

}  // namespace

void offer_preconditioner(Mat matrix, const std::string& type, const OwnPreconditioner& offered) {
  check(PCRegister(type.c_str(), create));
  Handle<PetscContainer, PetscContainerDestroy> container;
  check(PetscContainerCreate(comm_of(matrix), container.create()));
  check(PetscContainerSetPointer(container, const_cast<OwnPreconditioner*>(&offered)));
  check(PetscObjectCompose(reinterpret_cast<PetscObject>(matrix), key_of(type).c_str(),
                           reinterpret_cast<PetscObject>(PetscContainer(container))));
}

bool is_own_type(const std::string& type) {
  PetscErrorCode (*registered)(PC) = nullptr;
  check(PetscFunctionListFind(PCList, type.c_str(), &registered));
  return registered == create;
}

bool offers_preconditioner(Mat matrix, const std::string& type) { return offered_by(matrix, type) != nullptr; }

}  // namespace pellicle::linear
