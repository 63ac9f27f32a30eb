// How Newton's method converges in a step of the balloon.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "meshing/closed_shapes.h"
#include "tests/support/print_once.h"
#include "tests/world/static_balloon.h"

namespace pellicle::newton_convergence_test {
namespace {

/// An ellipsoid of rubber blown up to twice its volume and at rest: in tension everywhere, so that the elements need no
/// mending to be positive.
class NewtonTest : public ::testing::Test {
 protected:
  explicit NewtonTest(const std::string& thickness_rule) {
    options_.force.gravity.setZero();
    options_.wall.thickness_rule = thickness_rule;
    options_.wall.material.lambda = 4e5;
    ChamberOptions& gas = options_.chambers["gas"];
    gas.law = "volume";
    gas.volume_ratio = {{0, 1}, {1, ratio}};
    start_ = balloon(options_);
    for (int i = 1; i <= 25; ++i) {
      start_->reach(0.05 * i);
    }
  }

  /// Options of one more step: the gas, by another law, pushes a little more than it did. Tight solvers.
  Options options_of_step(const std::string& law, double ambient = GasOptions().ambient_pressure) const {
    Options options = options_;
    options.gas.ambient_pressure = ambient;
    options.prism.positive_elements = false;
    options.prism.max_iterations = 200;
    options.prism.ksp_rtol = 1e-13;
    options.prism.snes_rtol = 1e-12;
    const double pressure = start_->pressure();
    ChamberOptions& gas = options.chambers["gas"];
    gas = {};
    gas.law = law;
    if (law == "relative") {
      gas.pressure = {{0, 1.05 * pressure * ratio}};
    } else if (law == "pressure") {
      gas.pressure = {{0, 1.05 * pressure}};
    } else if (law == "volume") {
      gas.volume_ratio = {{0, 1.1 * ratio}};
    } else {
      const double exponent = law == "adiabatic" ? 1.4 : 1;
      gas.amount_ratio = {{0, 1.002 * (1 + pressure / ambient) * std::pow(ratio, exponent)}};
    }
    return options;
  }

  /// The balloon before that step.
  std::unique_ptr<StaticBalloon> start(const Options& options) const {
    auto result = balloon(options);
    result->state() = start_->state();
    return result;
  }

  static constexpr double end = 1.26;  ///< of the step [s]

 private:
  static std::unique_ptr<StaticBalloon> balloon(const Options& options) {
    return std::make_unique<StaticBalloon>(ellipsoid_mesh(2, {0.1, 0.095, 0.11}), options);
  }

  static constexpr double ratio = 2;  // of the volumes
  Options options_;
  std::unique_ptr<StaticBalloon> start_;
};

/// The largest r_{k+1} / r_k^2 as long as rounding does not show [1/N].
double quadratic_factor(const std::vector<double>& residuals) {
  double factor = 0;
  for (std::size_t k = 0; k + 1 < residuals.size(); ++k) {
    if (residuals[k] > 1e-8) {
      factor = std::max(factor, (residuals[k + 1] - 1e-10) / (residuals[k] * residuals[k]));
    }
  }
  return factor;
}

using Case = std::tuple<std::string, std::string>;  // thickness rule, law of the gas
class NewtonConvergence : public NewtonTest, public ::testing::WithParamInterface<Case> {
 protected:
  NewtonConvergence() : NewtonTest(std::get<0>(GetParam())) {}
};
INSTANTIATE_TEST_SUITE_P(Rules, NewtonConvergence,
                         ::testing::Combine(::testing::Values("incompressible", "plane_stress", "fixed", "global"),
                                            ::testing::Values("relative", "isothermal", "adiabatic", "pressure",
                                                              "volume")),
                         [](const auto& info) { return std::get<0>(info.param) + "_" + std::get<1>(info.param); });

TEST_P(NewtonConvergence, IsQuadraticWithTheExactTangentOnly) {
  const auto& [rule, law] = GetParam();
  double exact = 0;  // what is left after five iterations [N]
  for (const char* tangent : {"exact", "rank1", "paper"}) {
    Options options = options_of_step(law);
    options.gas.tangent = tangent;
    options.prism.newton = "fixed";
    std::vector<double> norms;
    print_once("%s, %s, %s:", rule.c_str(), law.c_str(), tangent);
    for (int iterations = 1; iterations <= 5; ++iterations) {
      options.prism.max_iterations = iterations;
      const AloneStep step = start(options)->step_to(end);
      ASSERT_TRUE(step.converged) << step.reason;
      norms.push_back(step.balance.residual);
      print_once(" %.1e", step.balance.residual);
    }
    print_once("%s\n", " N");
    if (options.gas.tangent == GasTangent::exact) {
      exact = norms.back();
      EXPECT_LT(exact, 1e-9);
      EXPECT_LT(quadratic_factor(norms), 3);
    } else {
      EXPECT_GT(norms.back(), 100 * exact) << tangent;
    }
  }
}

class GasTangents : public NewtonTest {
 protected:
  GasTangents() : NewtonTest("incompressible") {}
};

TEST_F(GasTangents, GiveTheSameAnswer) {
  for (const char* law : {"relative", "isothermal", "adiabatic", "volume"}) {
    // Under thin air: a third of the gas's stiffness, the paper's, takes hundreds of iterations at one atmosphere.
    Options options = options_of_step(law, 1000);
    const auto exact = start(options);
    exact->reach(end);
    for (const char* tangent : {"rank1", "paper"}) {
      options.gas.tangent = tangent;
      const auto other = start(options);
      other->reach(end);
      double difference = 0;
      for (PetscInt i = 0; i < exact->membrane().particles.owned; ++i) {
        difference =
            std::max(difference, (other->state().position.vector(i) - exact->state().position.vector(i)).norm());
      }
      MPI_Allreduce(MPI_IN_PLACE, &difference, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
      print_once("%s, %s: %.1e m, %d Newton iterations, exact %d\n", law, tangent, difference, other->newton_iterations,
                 exact->newton_iterations);
      EXPECT_LT(difference, 1e-8 * 0.1) << law << " " << tangent;
      EXPECT_NEAR(other->pressure(), exact->pressure(), 1e-8 * exact->pressure()) << law << " " << tangent;
    }
  }
}

}  // namespace
}  // namespace pellicle::newton_convergence_test
