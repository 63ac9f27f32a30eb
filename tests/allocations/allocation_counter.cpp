// This program's own malloc and operator new, and two functions of PETSc's, which count and hand on to those of the
// libraries. Symbols of a program come before those of shared libraries, so that libraries call these, too.

#include "tests/allocations/allocation_counter.h"

#include <dlfcn.h>
#include <petsc/private/petscimpl.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

extern "C" {
// Of the C library, behind its malloc.
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);
// Where the code of this program lies, by the linker.
extern const char __executable_start;
extern const char etext;
}

namespace pellicle {
namespace {

thread_local Requests counted;

/// @param caller the address to which a request for memory returns
void count(const void* caller) { ++(caller >= &__executable_start && caller < &etext ? counted.own : counted.foreign); }

void* allocate(std::size_t size, std::size_t alignment) {
  ++counted.own;
  void* memory = alignment > 0 ? __libc_memalign(alignment, size) : __libc_malloc(size);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}

/// The function of the library that has this name, behind that of this program.
template <class Function>
Function* next_of(const char* name, Function* /*here*/) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

Requests requests() { return counted; }

}  // namespace pellicle

void* operator new(std::size_t size) { return pellicle::allocate(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return pellicle::allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { __libc_free(memory); }
void operator delete(void* memory, std::size_t) noexcept { __libc_free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { __libc_free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { __libc_free(memory); }

extern "C" {

void* malloc(std::size_t size) {
  pellicle::count(__builtin_return_address(0));
  return __libc_malloc(size);
}

void* calloc(std::size_t number, std::size_t size) {
  pellicle::count(__builtin_return_address(0));
  return __libc_calloc(number, size);
}

void* realloc(void* memory, std::size_t size) {
  pellicle::count(__builtin_return_address(0));
  return __libc_realloc(memory, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  pellicle::count(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  pellicle::count(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  pellicle::count(__builtin_return_address(0));
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : ENOMEM;
}

PetscErrorCode PetscOptionsFindPair(PetscOptions options, const char prefix[], const char name[], const char* value[],
                                    PetscBool* is_set) {
  static const auto next = pellicle::next_of("PetscOptionsFindPair", PetscOptionsFindPair);
  if (std::strcmp(name, "-ksp_converged_reason") != 0 && std::strcmp(name, "-mat_view") != 0) {
    ++pellicle::counted.option_lookups;
  }
  return next(options, prefix, name, value, is_set);
}

PetscErrorCode PetscHeaderCreate_Private(PetscObject object, PetscClassId id, const char class_name[],
                                         const char description[], const char manual_section[], MPI_Comm comm,
                                         PetscObjectDestroyFunction destroy, PetscObjectViewFunction view) {
  static const auto next = pellicle::next_of("PetscHeaderCreate_Private", PetscHeaderCreate_Private);
  ++pellicle::counted.objects;
  return next(object, id, class_name, description, manual_section, comm, destroy, view);
}

}  // extern "C"
