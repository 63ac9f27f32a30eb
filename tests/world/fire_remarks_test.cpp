#include <gtest/gtest.h>

#include "surface/shell.h"
#include "tests/support/grid_mesh.h"
#include "world/fire_stages.h"

namespace pellicle::fire_remarks_test {
namespace {

/// The strip of docs/fire.md.
Options strip() {
  Options options;
  options.heat.diffusivity = 1e-3;
  options.heat.burning_heat = 1200;
  options.heat.sources["lighter"].temperature = 1200;
  options.combustion.ignition_temperature = 500;
  options.combustion.mass_loss_rate = 0.015;
  options.combustion.min_mass = 0.3;
  options.ablation.loss_mass = 0.4;
  return options;
}

bool has(const std::vector<std::string>& lines, const std::string& words) {
  return lines.size() == 1 && lines.front().find(words) != std::string::npos;
}

/// The record of a fire at time 0.
Eigen::VectorXd start_of_fire() {
  const Sheet sheet = make_sheet(PETSC_COMM_SELF, grid_mesh(1, 1, 1), {});
  return State(sheet, {}, 0).burning->fire_record;
}

TEST(FireRemarks, SayHowAFrontGoesAndWhereCellsAreTooLarge) {
  EXPECT_TRUE(has(front_remarks(strip(), 5e-3), "about 0.081 m/s and is 0.012 m wide, 2.5 cells"));
  EXPECT_FALSE(has(front_remarks(strip(), 5e-3), "expected"));
  EXPECT_TRUE(has(front_remarks(strip(), 0.05), "expected 2 at least, sides of 0.0062 m"));
}

TEST(FireRemarks, SayNothingOfFrontsThatNothingLightsOrThatDie) {
  Options cold = strip();
  cold.heat.sources["lighter"].temperature = 450;
  EXPECT_TRUE(front_remarks(cold, 5e-3).empty());
  Options weak = strip();
  weak.heat.burning_heat = 600;
  EXPECT_TRUE(front_remarks(weak, 5e-3).empty());
  Options hot = strip();
  hot.heat.initial_temperature = 900;
  EXPECT_TRUE(front_remarks(hot, 5e-3).empty());
}

TEST(FireRemarks, SayWhenFireWentOut) {
  Eigen::VectorXd record = start_of_fire();
  for (const auto& [time, burnt] :
       {std::pair(0.0, 0.0), std::pair(1.0, 0.2), std::pair(2.0, 0.3), std::pair(3.0, 0.3)}) {
    note_fire(record, time, 2 - burnt, burnt, 900);
  }
  EXPECT_TRUE(has(fire_remarks(strip(), record), "it went out at 2 s, when 15 % of the mass had burnt"));
  note_fire(record, 4, 1.6, 0.4, 900);
  EXPECT_TRUE(fire_remarks(strip(), record).empty()) << "it burns";
}

TEST(FireRemarks, SayThatNothingHasCaughtFire) {
  Eigen::VectorXd record = start_of_fire();
  note_fire(record, 0, 1, 0, 300);
  note_fire(record, 1, 1, 0, 440);
  Options options = strip();
  options.heat.sources["lighter"].temperature = 450;
  EXPECT_TRUE(has(fire_remarks(options, record), "nothing has caught fire; the hottest was 440 K"));
  options.heat.sources.clear();
  EXPECT_TRUE(fire_remarks(options, record).empty()) << "nothing was to";
}

}  // namespace
}  // namespace pellicle::fire_remarks_test
