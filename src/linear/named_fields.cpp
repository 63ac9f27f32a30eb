#include "linear/named_fields.h"

#include <petscdmshell.h>

#include "base/error.h"

namespace pellicle {
inline namespace linear {

namespace {

/// The rows of each field, made on request.
PetscErrorCode split_by_fields(DM dm, PetscInt* count, char*** names, IS** rows, DM** dms) {
  return as_petsc_callback([&] {
    void* context = nullptr;
    check(DMShellGetContext(dm, &context));
    const NamedFields& fields = *static_cast<const NamedFields*>(context);
    Vec vector = nullptr;
    PetscInt first = 0;
    PetscInt end = 0;
    check(DMShellGetGlobalVector(dm, &vector));
    check(VecGetOwnershipRange(vector, &first, &end));
    end -= fields.border_rows;
    std::vector<std::string> all = fields.components;
    const auto components = static_cast<PetscInt>(all.size());
    if (!fields.border.empty()) {
      all.push_back(fields.border);
    }
    *count = static_cast<PetscInt>(all.size());
    check(PetscMalloc1(*count, names));
    check(PetscMalloc1(*count, rows));
    if (dms != nullptr) {
      *dms = nullptr;
    }
    const MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(dm));
    for (PetscInt field = 0; field < *count; ++field) {
      check(PetscStrallocpy(all[field].c_str(), &(*names)[field]));
      const bool is_border = field == components;
      check(ISCreateStride(comm, is_border ? fields.border_rows : (end - first) / components,
                           is_border ? end : first + field, is_border ? 1 : components, &(*rows)[field]));
    }
  });
}

std::string words(const NamedFields& fields) {
  std::string names;
  for (const std::string& name : fields.components) {
    names += (names.empty() ? "" : ", ") + name;
  }
  return names + (fields.border.empty() ? "" : ", " + fields.border);
}

}  // namespace

DmHandle make_dm(Mat matrix, const std::string& prefix, const NamedFields& fields) {
  DmHandle dm;
  VecHandle vector;
  check(DMShellCreate(PetscObjectComm(reinterpret_cast<PetscObject>(matrix)), dm.create()));
  check(DMSetOptionsPrefix(dm, prefix.c_str()));
  check(MatCreateVecs(matrix, vector.create(), nullptr));
  check(DMShellSetGlobalVector(dm, vector));
  check(DMShellSetMatrix(dm, matrix));
  check(DMShellSetContext(dm, new NamedFields(fields)));
  check(DMShellSetDestroyContext(dm, [](void* context) {
    delete static_cast<NamedFields*>(context);
    return PetscErrorCode(0);
  }));
  check(DMShellSetCreateFieldDecomposition(dm, split_by_fields));
  check(PetscObjectSetName(reinterpret_cast<PetscObject>(DM(dm)), words(fields).c_str()));
  check(DMSetFromOptions(dm));
  check(DMViewFromOptions(dm, nullptr, "-dm_view"));
  return dm;
}

}  // namespace linear
}  // namespace pellicle
