// A field that a program adds to a state takes part in everything by its one declaration.

#include <gtest/gtest.h>

#include <filesystem>

#include "state/hdf5_file.h"
#include "tests/io/files.h"
#include "tests/support/frames.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"
#include "tests/support/state_values.h"
#include "tests/world/one_object.h"

namespace pellicle {
namespace {

Options strip_options(const std::string& directory) {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.thickness = 0.05;
  options.heat.initial_temperature = 0;  // so that mass may be changed without a word to the heat ledger
  options.ablation.loss_mass = 0.5;
  options.ablation.compact_fraction = 0.05;
  options.output.directory = directory;
  options.output.name = "strip";
  return options;
}

/// What is to be at each particle and cell, by its persistent id.
double dampness(PetscInt id) { return 0.5 + id; }

class AddedField : public ::testing::Test {
 protected:
  TestFolder folder_;
  Options options_ = strip_options(folder_ / "out");
  OneObject run_{grid_mesh(5, 1, 0.1), options_};

  void declare() {
    Field& damp = run_.state().add<Field>({"dampness", "kg/m^2", Item::particle, Drawn::yes});
    for (PetscInt i = 0; i < run_.sheet().particles.local(); ++i) {
      damp.data()[i] = dampness(run_.sheet().persistent_id[i]);
    }
    run_.state().add<PetscInt>({"visits", "", Item::object}) = 7;
    run_.state().add<std::vector<bool>>({"marked", "", Item::cell}).flip();
  }

  static void expect_there(Object& object) {
    const FieldRegistry::Entry* entry = object.state().find("dampness");
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(entry->declaration.unit, "kg/m^2");
    EXPECT_EQ(entry->declaration.drawn, Drawn::yes);
    const Field& damp = *std::get<Field*>(entry->storage);
    ASSERT_EQ(damp.values().cols(), object.surface().particles.local());
    for (PetscInt i = 0; i < object.surface().particles.local(); ++i) {
      EXPECT_EQ(damp.data()[i], dampness(object.surface().persistent_id[i]));
    }
    EXPECT_EQ(*std::get<PetscInt*>(object.state().find("visits")->storage), 7);
    const auto& marked = *std::get<std::vector<bool>*>(object.state().find("marked")->storage);
    EXPECT_EQ(marked, std::vector<bool>(object.surface().cells.size(), true));
  }

  void step() {
    const StepResult result = run_.world().step(2e-3);
    ASSERT_TRUE(result.converged) << result.reason;
    run_.record(0);
  }
};

TEST_F(AddedField, IsPutBackWithAStep) {
  declare();
  run_.keep();
  spoil(run_.state());
  run_.restore();
  expect_there(run_.object());
}

TEST_F(AddedField, MovesWhenTheSheetIsCompacted) {
  declare();
  run_.draw();
  const PetscInt before = run_.sheet().elements.global;
  // The last of five cells has burnt away, with its corners.
  Field& mass = *std::get<Field*>(run_.state().find("mass")->storage);
  for (PetscInt i = 0; i < run_.sheet().particles.local(); ++i) {
    mass.data()[i] *= run_.sheet().rest(0, i) > 0.35 ? 0.4 : 1;
  }
  step();
  ASSERT_LT(run_.sheet().elements.global, before) << "nothing was compacted";
  expect_there(run_.object());
}

TEST_F(AddedField, IsInACheckpointAndComparedWithIt) {
  declare();
  run_.draw();
  step();
  {
    Hdf5File file(PETSC_COMM_WORLD, folder_ / "state.h5", Hdf5File::Mode::create);
    run_.save(file);
    file.close();
  }
  const Hdf5File file(PETSC_COMM_WORLD, folder_ / "state.h5", Hdf5File::Mode::read);
  Object again("", options_, file);
  expect_there(again);
  for (const auto& [name, difference] : differences(PETSC_COMM_WORLD, run_.state(), again.state())) {
    EXPECT_EQ(difference, 0) << name;
  }
  if (again.surface().particles.owned > 0) {
    std::get<Field*>(again.state().find("dampness")->storage)->data()[0] += 1;
  }
  for (const auto& [name, difference] : differences(PETSC_COMM_WORLD, run_.state(), again.state())) {
    EXPECT_EQ(difference > 0, name == "dampness") << name;
  }
}

TEST_F(AddedField, IsDrawn) {
  declare();
  run_.draw();
  if (ranks() > 1) {
    return;  // Frames are read by one rank.
  }
  const auto frames = read_pvd(folder_ / "out/strip.pvd");
  const DrawnFrame frame = read_frame(frames.begin()->first, frames.begin()->second);
  ASSERT_EQ(frame.points.count("dampness"), 1U);
}

}  // namespace
}  // namespace pellicle
