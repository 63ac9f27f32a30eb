#include "linear/named_fields.h"

#include <fmt/format.h>
#include <petscdmshell.h>

#include "base/error.h"

namespace pellicle::linear {

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
    const auto components = static_cast<PetscInt>(fields.components.size());
    *count = components + (fields.border.empty() ? 0 : 1);
    check(PetscMalloc1(*count, names));
    check(PetscMalloc1(*count, rows));
    if (dms != nullptr) {
      *dms = nullptr;
    }
    for (PetscInt field = 0; field < *count; ++field) {
      const bool is_border = field == components;
      const std::string& name = is_border ? fields.border : fields.components[field];
      check(PetscStrallocpy(name.c_str(), &(*names)[field]));
      check(ISCreateStride(comm_of(dm), is_border ? fields.border_rows : (end - first) / components,
                           is_border ? end : first + field, is_border ? 1 : components, &(*rows)[field]));
    }
  });
}

}  // namespace

DmHandle make_dm(Mat matrix, const std::string& prefix, const NamedFields& fields) {
  DmHandle dm;
  VecHandle vector;
  check(DMShellCreate(comm_of(matrix), dm.create()));
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
  const std::string words =
      fmt::format("{}{}{}", fmt::join(fields.components, ", "), fields.border.empty() ? "" : ", ", fields.border);
  check(PetscObjectSetName(reinterpret_cast<PetscObject>(DM(dm)), words.c_str()));
  check(DMSetFromOptions(dm));
  check(DMViewFromOptions(dm, nullptr, "-dm_view"));
  return dm;
}

}  // namespace pellicle::linear
