// What a checkpoint keeps of a sheet: little more than its fields, and all that does not follow from them.

#include <gtest/gtest.h>

#include <filesystem>

#include "meshing/generators.h"
#include "state/hdf5_file.h"
#include "tests/io/files.h"
#include "tests/support/solver_options.h"
#include "tests/support/state_values.h"
#include "tests/world/one_object.h"

namespace pellicle {
namespace {

constexpr double h = 2e-3;  // [s]

TEST(CheckpointSize, IsLittleMoreThanTheFieldsAndASheetThatHasBurntIsWhole) {
  const TestFolder folder;
  Options options;
  options.sheet.thickness = 2e-3;
  options.sheet.perturbation = 0.1;
  options.project.max_steps = 2;
  options.heat.initial_temperature = 600;
  options.heat.convection = 20;
  options.heat.sources["ball"].centre = {0.3, 0.2, 0};
  options.heat.sources["ball"].radius = 0.05;
  options.heat.sources["ball"].temperature = 2000;
  options.heat.sources["ball"].rate = 1e4;
  options.combustion.mass_loss_rate = 1;
  options.ablation.loss_mass = 0.5;
  options.ablation.compact_fraction = 0;
  options.pins["left"].vertices = {0};
  options.output.directory = folder / "out";
  options.output.name = "sheet";
  OneObject run(rectangle_mesh({150, 140}, {1, 1}), options);
  run.draw();
  for (int step = 0; step < 3; ++step) {
    const StepResult result = run.world().step(h);
    ASSERT_TRUE(result.converged) << result.reason;
    run.record(0);
  }
  const Sheet& sheet = run.sheet();
  ASSERT_LT(sheet.elements.global, 150 * 140) << "corners have lost cells";
  ASSERT_GT(sheet.elements.global, 120 * 140);
  const std::string path = folder / "state.h5";
  {
    Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::create);
    run.save(file);
    file.close();
  }
  const FieldRegistry& fields = run.state();
  const double bytes = static_cast<double>(fields.record_size(Item::particle)) * sheet.particles.global +
                       static_cast<double>(fields.record_size(Item::cell)) * sheet.elements.global;
  EXPECT_LT(static_cast<double>(std::filesystem::file_size(path)), 1.3 * bytes);

  const Hdf5File file(PETSC_COMM_WORLD, path, Hdf5File::Mode::read);
  const Object again("", options, file);
  EXPECT_EQ(again.surface().persistent_id, sheet.persistent_id);
  EXPECT_EQ(again.surface().cells, sheet.cells);
  EXPECT_EQ(again.surface().rest, sheet.rest);
  EXPECT_EQ(again.surface().uv, sheet.uv);
  EXPECT_EQ(again.surface().initial_mass, sheet.initial_mass);
  EXPECT_EQ(again.surface().element_mass, sheet.element_mass);
  for (const auto& [name, difference] : differences(PETSC_COMM_WORLD, run.state(), again.state())) {
    // Target lengths follow from the masses, also of springs that are dead, whose lengths are not used.
    if (name.find("target_length") == std::string::npos) {
      EXPECT_EQ(difference, 0) << name;
    }
  }
}

}  // namespace
}  // namespace pellicle
