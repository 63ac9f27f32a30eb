#pragma once

#include <petscksp.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "base/error.h"

namespace pellicle::base {

/// Owns one PETSc object: move-only, destroyed with its scope. Every handle must die before PetscFinalize.
template <class T, PetscErrorCode (*destroy)(T*)>
class Handle {
 public:
  Handle() = default;
  Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (object_ != nullptr) {
      destroy(&object_);
    }
  }

  /// The object itself, for calls that use it.
  operator T() const { return object_; }  // NOLINT(google-explicit-constructor)

  /// The slot for a creating call: `check(MatCreate(comm, a.create()));` An object constrained before is destroyed.
  T* create() {
    *this = Handle();
    return &object_;
  }

  /// The slot for a call that creates the object the first time and fills it again later (MAT_REUSE_MATRIX).
  T* slot() { return &object_; }

 private:
  T object_ = nullptr;
};

using VecHandle = Handle<Vec, VecDestroy>;
using MatHandle = Handle<Mat, MatDestroy>;
using KspHandle = Handle<KSP, KSPDestroy>;

/// The communicator of a PETSc object, such as a Mat.
template <class Object>
MPI_Comm comm_of(Object* object) {
  return PetscObjectComm(reinterpret_cast<PetscObject>(object));
}

/// The name of a PETSc object's type; null: it has none. Not collective.
template <class Object>
const char* type_of(Object* object) {
  const char* type = nullptr;
  check(PetscObjectGetType(reinterpret_cast<PetscObject>(object), &type));
  return type;
}

/// The preconditioner of a solver. Not collective.
inline PC preconditioner_of(KSP solver) {
  PC preconditioner = nullptr;
  check(KSPGetPC(solver, &preconditioner));
  return preconditioner;
}

/// Whether a PETSc object is of one of some types. Not collective.
template <class Object>
bool has_type(Object* object, std::initializer_list<const char*> types) {
  return std::any_of(types.begin(), types.end(), [object](const char* type) {
    PetscBool is_type = PETSC_FALSE;
    check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(object), type, &is_type));
    return is_type == PETSC_TRUE;
  });
}

}  // namespace pellicle::base
