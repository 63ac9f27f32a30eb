// A stage of a program of one's own works on sheets and on walls alike: the example of docs/extending.md. And so do the
// stages that are made of functions.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "meshing/closed_shapes.h"
#include "parallel/collective.h"
#include "parallel/field.h"
#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"
#include "world/stage.h"

namespace pellicle::own_stage_test {
namespace {

constexpr double h = 1e-3;  // [s]

/// Hot gas lifts what is hot: an upward acceleration in proportion to the temperature above that of the surroundings.
class Updraught : public Stage {
 public:
  /// @param acceleration of what is 1000 K hotter than the surroundings [m/s^2] @param ambient temperature [K]
  Updraught(const Surface& surface, State& state, double acceleration, double ambient)
      : surface_(surface),
        state_(state),
        acceleration_(acceleration),
        ambient_(ambient),
        lifted_(*std::get<Field*>(state.find("lifted")->storage)) {}

  StageResult begin(Step& step) override {
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {  // Ghosts are moved alike: they need no exchange.
      const double excess = std::max(state_.burning->temperature.data()[i] - ambient_, 0.0);
      const double gained = step.h * acceleration_ * excess / 1000;
      state_.velocity.vector(i).z() += gained;
      lifted_.data()[i] += gained;
    }
    return {};
  }

  void report(Report& report, const Step& /*step*/) const override {
    const double own = surface_.particles.owned > 0 ? lifted_.values().maxCoeff() : 0;
    report.add("lifted_max", "m/s", max_over_ranks(surface_.comm(), own));
  }

 private:
  const Surface& surface_;
  State& state_;
  double acceleration_;
  double ambient_;
  Field& lifted_;  ///< what the stage has added to velocities since time 0 [m/s]
};

/// A sheet or a wall in free space, 500 K hotter than what is round it.
std::unique_ptr<Alone> hot_object(ChainKind chain) {
  Options options;
  options.force.gravity.setZero();
  options.heat.initial_temperature = 800;
  options.heat.ambient_temperature = 300;
  options.combustion.ignition_temperature = 2000;
  options.prism.mass_damping = 0;
  options.ablation.strength = 1e9;  // so that a wall has temperatures
  return std::make_unique<Alone>(chain == ChainKind::burn ? grid_mesh(4, 3, 0.1) : icosphere_mesh(1, 0.1), options,
                                 chain);
}

class OwnStage : public ::testing::TestWithParam<ChainKind> {
 protected:
  std::unique_ptr<Alone> alone_ = hot_object(GetParam());

  void steps(int count) {
    for (int n = 0; n < count; ++n) {
      const AloneStep step = alone_->advance(h);
      ASSERT_TRUE(step.converged) << step.reason;
    }
  }
  /// Mean velocity of the particles of all ranks along z [m/s].
  double rise() const {
    const PetscInt owned = alone_->surface().particles.owned;
    const double sum = alone_->state().velocity.values().row(2).head(owned).sum();
    return sum_over_ranks(PETSC_COMM_WORLD, sum) / alone_->surface().particles.global;
  }
};

TEST_P(OwnStage, LiftsWhatIsHot) {
  Object& object = alone_->object;
  object.state().add<Field>({"lifted", "m/s", Item::particle, Drawn::yes});
  object.add_stage(
      [](const Surface& surface, State& state) { return std::make_unique<Updraught>(surface, state, 4, 300); });
  steps(5);
  const double expected = 5 * h * 4 * 0.5;
  EXPECT_NEAR(rise(), expected, 1e-9 * expected);
  EXPECT_NEAR(alone_->figure("lifted_max"), expected, 1e-12);

  // The field of the stage is restored with the others.
  object.keep();
  steps(1);
  object.restore();
  EXPECT_NEAR(alone_->figure("lifted_max"), expected, 1e-12);
}

TEST_P(OwnStage, FunctionsAccelerateAndHeat) {
  Object& object = alone_->object;
  object.add_stage(accelerating([](const Eigen::Vector3d&, const Eigen::Vector3d&, double time) {
    return Eigen::Vector3d(0, 0, time < 2.5 * h ? 3 : 0);
  }));
  const double capacity = object.options().heat.capacity;
  object.add_stage(heating([](const Eigen::Vector3d&, double) { return 2e4; }, capacity));
  const double before = alone_->figure("heat_content");
  steps(4);
  EXPECT_NEAR(rise(), 3 * h * 3, 1e-9 * 3 * h * 3);
  const double heat = 4 * h * 2e4 * alone_->figure("mass_left");  // [J]
  EXPECT_NEAR(alone_->figure("heat_content") - before, heat, 1e-9 * before);
  EXPECT_NEAR(alone_->figure("heat_in"), heat, 1e-9 * before);
}

TEST_P(OwnStage, AFieldIsAVectorOfPetscWithoutACopy) {
  Object& object = alone_->object;
  Field& temperature = object.field("temperature");
  const VecHandle vec = vec_of(object.surface().particles, temperature);
  PetscInt size = 0;
  check(VecGetSize(vec, &size));
  EXPECT_EQ(size, object.surface().particles.global);
  check(VecSet(vec, 321));
  for (PetscInt i = 0; i < object.surface().particles.owned; ++i) {
    EXPECT_EQ(temperature.data()[i], 321);
  }
  EXPECT_THROW(object.field("pressure"), std::logic_error);
}

INSTANTIATE_TEST_SUITE_P(Chains, OwnStage, ::testing::Values(ChainKind::burn, ChainKind::inflate),
                         [](const auto& chain) { return Choice<ChainKind>(chain.param).name(); });

}  // namespace
}  // namespace pellicle::own_stage_test
