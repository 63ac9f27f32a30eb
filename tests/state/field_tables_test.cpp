#include <gtest/gtest.h>

#include "base/error.h"
#include "state/field_registry.h"
#include "state/hdf5_file.h"
#include "surface/shell.h"
#include "tests/io/files.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"
#include "tests/support/state_values.h"

namespace pellicle {
namespace {

/// A field of each kind on a sheet.
struct AllKinds : FieldRegistry {
  explicit AllKinds(const Sheet& sheet) : FieldRegistry(sheet.particles, static_cast<PetscInt>(sheet.cells.size())) {}

  Field& place = add<Field>({"place", "m", Item::particle}, 3);
  std::vector<PetscInt>& pin = add<std::vector<PetscInt>>({"pin", "", Item::particle});
  std::vector<bool>& marked = add<std::vector<bool>>({"marked", "", Item::cell}, 4);
  std::vector<double>& birth = add<std::vector<double>>({"birth", "s", Item::cell});
  std::vector<PetscInt>& list = add<std::vector<PetscInt>>({"list", "", Item::object});
  Eigen::VectorXd& pressure = add<Eigen::VectorXd>({"pressure", "Pa", Item::object}, 2);
  double& time = add<double>({"time", "s", Item::object});
  double& loss = add<double>({"loss", "kg", Item::sum});
  Field& speed = add<Field>({"speed", "m/s", Item::particle, Drawn::no, true});
};

std::vector<PetscInt> cell_ids(const Sheet& sheet) {
  std::vector<PetscInt> ids;
  for (const PetscInt lattice : sheet.lattice) {
    ids.push_back(sheet.persistent_id[lattice]);
  }
  return ids;
}

/// Values that follow from the persistent ids.
void fill(AllKinds& fields, const Sheet& sheet) {
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const PetscInt id = sheet.persistent_id[i];
    fields.place.vector(i) = Eigen::Vector3d(id, 0.5 * id, -id);
    fields.pin[i] = id % 3 - 1;
  }
  const std::vector<PetscInt> ids = cell_ids(sheet);
  for (std::size_t c = 0; c < ids.size(); ++c) {
    fields.birth[c] = 0.1 * ids[c];
    for (std::size_t k = 0; k < 4; ++k) {
      fields.marked[4 * c + k] = (static_cast<std::size_t>(ids[c]) + k) % 2 == 0;
    }
  }
  fields.list = {4, 9, 11};
  fields.pressure << 1.5, -2.5;
  fields.time = 0.125;
  fields.loss = 1 + this_rank();
}

TEST(FieldTables, AreReadAsTheyWereWrittenGhostsIncluded) {
  const TestFolder folder;
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(5, 3, 1), {});
  const std::vector<PetscInt> cells = cell_ids(sheet);
  AllKinds written(sheet);
  fill(written, sheet);
  written.speed.values().setOnes();  // which follows, and is not kept
  {
    Hdf5File file(PETSC_COMM_WORLD, folder / "fields.h5", Hdf5File::Mode::create);
    const auto& ids = sheet.persistent_id;
    write_fields(file, "some/object", written, {ids.begin(), ids.begin() + sheet.particles.owned},
                 {cells.begin(), cells.begin() + sheet.elements.owned});
    file.close();
  }
  const Hdf5File file(PETSC_COMM_WORLD, folder / "fields.h5", Hdf5File::Mode::read);
  EXPECT_FALSE(file.has("some/object/particles/speed"));
  AllKinds read(sheet);
  read_fields(file, "some/object", read, sheet.persistent_id, cells);
  AllKinds expected(sheet);
  fill(expected, sheet);
  EXPECT_EQ(values_of(read), values_of(expected));

  AllKinds more(sheet);
  more.add<double>({"wind", "m/s", Item::object});
  EXPECT_THROW(read_fields(file, "some/object", more, sheet.persistent_id, cells), Error) << "has no such table";
}

TEST(FieldTables, SumsStayWhatTheyAreOnOtherNumbersOfRanks) {
  const TestFolder folder;
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(2, 1, 1), {});
  {
    AllKinds written(sheet);
    written.loss = 3;
    Hdf5File file(PETSC_COMM_WORLD, folder / "fields.h5", Hdf5File::Mode::create);
    const auto& ids = sheet.persistent_id;
    const std::vector<PetscInt> cells = cell_ids(sheet);
    write_fields(file, "object", written, {ids.begin(), ids.begin() + sheet.particles.owned},
                 {cells.begin(), cells.begin() + sheet.elements.owned});
    file.close();
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  if (this_rank() == 0 && ranks() > 1) {  // one rank reads what several have written
    const Sheet alone = make_sheet(PETSC_COMM_SELF, grid_mesh(2, 1, 1), {});
    const Hdf5File file(PETSC_COMM_SELF, folder / "fields.h5", Hdf5File::Mode::read);
    AllKinds read(alone);
    read_fields(file, "object", read, alone.persistent_id, cell_ids(alone));
    EXPECT_EQ(read.loss, 3 * ranks());
  }
  MPI_Barrier(PETSC_COMM_WORLD);
}

}  // namespace
}  // namespace pellicle
