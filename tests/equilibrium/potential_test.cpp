// A potential that the program does not know takes part in a step: springs between vertices that share no element, on
// whichever ranks, and whose pairs change.

#include "energies/potential.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "energies/tangent.h"
#include "equilibrium/gas_filled_part.h"
#include "equilibrium/implicit_step.h"
#include "equilibrium/wall_part.h"
#include "geometry/pressure_load.h"
#include "meshing/closed_shapes.h"
#include "parallel/collective.h"
#include "prism/wall_potential.h"
#include "tests/support/print_once.h"
#include "tests/support/solver_options.h"

namespace pellicle::potential_test {
namespace {

using Pairs = std::vector<std::array<PetscInt, 2>>;

/// sum k/2 (|x_a - x_b| - L)^2 over pairs of vertices, given by persistent ids.
class Springs : public Potential {
 public:
  explicit Springs(const Surface& points)
      : vertices_(points.particles), global_of_id_(static_cast<std::size_t>(vertices_.global), 0) {
    for (PetscInt i = 0; i < vertices_.owned; ++i) {
      const PetscInt id = points.persistent_id[i];
      global_of_id_[id] = vertices_.to_global(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, global_of_id_.data(), static_cast<int>(vertices_.global), MPIU_INT, MPI_SUM,
                  vertices_.comm);
    join({});
  }

  /// Collective.
  void join(const Pairs& pairs) {
    springs_.clear();
    ++version_;
    std::map<PetscInt, PetscInt> local;  // of global numbers
    for (PetscInt i = 0; i < vertices_.local(); ++i) {
      local[vertices_.to_global(i)] = i;
    }
    std::vector<PetscInt> beyond;
    for (const auto& pair : pairs) {
      for (const auto& [a, b] : {std::pair(pair[0], pair[1]), std::pair(pair[1], pair[0])}) {
        const PetscInt row = global_of_id_[a];
        const PetscInt column = global_of_id_[b];
        if (local.count(row) == 0 || local[row] >= vertices_.owned) {
          continue;
        }
        if (local.count(column) == 0) {
          local[column] = vertices_.local() + static_cast<PetscInt>(beyond.size());
          beyond.push_back(column);
        }
        springs_.push_back({local[row], local[column], column});
      }
    }
    reach_ = with_ghosts(vertices_, beyond);
  }

  double value(const Field& x) const override {
    double sum = 0;
    const Field all = everywhere(x);
    for (const Spring& spring : springs_) {
      const double stretch = (all.vector(spring.from) - all.vector(spring.to)).norm() - length;
      sum += stiffness / 4 * stretch * stretch;  // each is there from both ends
    }
    return sum;
  }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override {
    const Field all = everywhere(x);
    for (const Spring& spring : springs_) {
      const Eigen::Vector3d d = all.vector(spring.from) - all.vector(spring.to);
      gradient.col(spring.from) += stiffness * (1 - length / d.norm()) * d;
    }
  }
  std::vector<VertexPair> pattern() const override {
    std::vector<VertexPair> pairs;
    for (const Spring& spring : springs_) {
      pairs.push_back({spring.from, vertices_.to_global(spring.from)});
      pairs.push_back({spring.from, spring.global_to});
    }
    return pairs;
  }
  PetscInt pattern_version() const override { return version_; }
  void update_hessian(const Field& x, double psd_blend) override {
    const Field all = everywhere(x);
    hessian_.clear();
    for (const Spring& spring : springs_) {
      const Eigen::Vector3d d = all.vector(spring.from) - all.vector(spring.to);
      const double fraction = 1 - length / d.norm();
      const double across = psd_blend == Curvature::psd ? std::max(fraction, 0.0) : fraction;
      const Eigen::Matrix3d along = d * d.transpose() / d.squaredNorm();
      hessian_.emplace_back(stiffness * (across * (Eigen::Matrix3d::Identity() - along) + along));
    }
  }
  void add_hessian(const HessianBlocks& blocks) const override {
    for (std::size_t s = 0; s < hessian_.size(); ++s) {
      blocks.add(2 * s, hessian_[s]);
      blocks.add(2 * s + 1, -hessian_[s]);
    }
  }

  double stiffness = 2;  ///< [N/m]
  double length = 0.02;  ///< [m]

 private:
  struct Spring {
    PetscInt from, to;  ///< owned, and of `reach_`
    PetscInt global_to;
  };

  Field everywhere(const Field& x) const {
    Field all(reach_, 3);
    all.values().leftCols(vertices_.owned) = x.values().leftCols(vertices_.owned);
    all.update_ghosts();
    return all;
  }

  const Layout& vertices_;
  std::vector<PetscInt> global_of_id_;
  Layout reach_;
  PetscInt version_ = 0;
  std::vector<Spring> springs_;
  std::vector<Eigen::Matrix3d> hessian_;
};

/// Two choices of as many pairs, from one end of the vertices' ids to the other.
Pairs some_pairs(int choice) {
  Pairs pairs;
  for (PetscInt i = 0; i < 20; ++i) {
    pairs.push_back({i, 161 - (choice == 0 ? i : 7 * i % 60)});
  }
  return pairs;
}

/// An icosphere, somewhat blown up, with pins and gas, and springs across it.
struct SpringBalloon {
  explicit SpringBalloon(PrismOptions given = {})
      : options(std::move(given)),
        membrane(make_membrane(PETSC_COMM_WORLD, icosphere_mesh(2, 0.1), {})),
        wall(make_wall(membrane, {}, {})),
        mass(vertex_masses(membrane, wall)),
        elements(membrane, wall),
        pins(membrane, {{"top", top()}}),
        constraints(membrane, {}, pins),
        chambers(membrane, {}, {{"air", air()}}, constraints.origin, {}, constraints.projectors),
        loads(membrane, std::vector<double>(membrane.persistent_id.size(), 0.0), {}, {}),
        springs(membrane),
        x(membrane.particles, 3),
        velocity(membrane.particles, 3),
        thickness_ratio(membrane.triangles.size(), 1.0) {
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      x.vector(i) = Eigen::Vector3d(1.3, 1.2, 1.25).cwiseProduct(membrane.rest.col(i));
    }
    pins.impose(x, 0);
    springs.join(some_pairs(0));
  }

  WallModel model() { return {elements, constraints, pins, loads, mass, {0, 0, -9.81}, {&springs}}; }

  static PinOptions top() {
    PinOptions pin;
    pin.centre = {0, 0, 0.1};
    pin.radius = 0.02;
    return pin;
  }
  static ChamberOptions air() {
    ChamberOptions chamber;
    chamber.law = "pressure";
    chamber.pressure = {{0, 1000}};
    return chamber;
  }

  PrismOptions options;
  Membrane membrane;
  Wall wall;
  std::vector<double> mass;
  PrismElements elements;
  Pins pins;
  Constraints constraints;
  Chambers chambers;
  GasStep gas_step{&chambers.initial_exchange()};
  PointLoads loads;
  Springs springs;
  Field x, velocity;
  std::vector<double> thickness_ratio;
};

/// Steps of it from the same start.
class BalancedBalloon {
 public:
  explicit BalancedBalloon(SpringBalloon& balloon)
      : balloon_(balloon),
        wall_(balloon.model(), balloon.options),
        part_(wall_, {{"", &balloon.chambers, &balloon.gas_step}, &wall_.start()},
              [this](std::vector<double> pressure) { wall_.set_load(std::move(pressure), {}); }),
        objective_({&part_}, {}, balloon.options.mat_type, balloon.options.solver_prefix),
        solver_(objective_, balloon.options) {}

  ImplicitResult advance(double h) {
    wall_.begin_step(balloon_.x, {&balloon_.velocity, balloon_.thickness_ratio, 0, h});
    part_.begin_step(Eigen::VectorXd::Zero(1), h, h, h);
    return solver_.advance(h, factorised_);
  }

 private:
  SpringBalloon& balloon_;
  WallPart wall_;
  GasFilledPart part_;
  StepObjective objective_;
  ImplicitStep solver_;
  FactorisedSteps factorised_;
};

TEST(WallPartTest, CountsTheElementsOfAllRanksThatTurnOver) {
  SpringBalloon balloon;
  const WallPart wall(balloon.model(), balloon.options);
  Field mirrored(balloon.membrane.particles, 3);
  mirrored.values() = balloon.x.values();
  mirrored.values().row(2) *= -1;
  int expected = 0;
  for (PetscInt e = 0; e < balloon.membrane.elements.owned; ++e) {
    const auto& [a, b, c] = balloon.membrane.triangles[e];
    const auto area = [a = a, b = b, c = c](const Field& x) {
      return area_vector(x.vector(a), x.vector(b), x.vector(c));
    };
    expected += area(balloon.x).dot(area(mirrored)) > 0 ? 0 : 1;
  }
  expected = sum_over_ranks(PETSC_COMM_WORLD, expected);
  EXPECT_GT(expected, 100);
  EXPECT_EQ(wall.inverted(balloon.x, mirrored), expected);
}

struct Way {
  std::string mat_type;
  std::vector<std::pair<std::string, std::string>> solver;
};

const std::vector<Way>& ways() {
  static const std::vector<Way> all{
      {"baij", {}},
      {"baij", {{"snes_lag_preconditioner", "4"}}},
      {"aij", {{"pc_type", "cholesky"}, {"ksp_type", "preonly"}, {"pc_factor_mat_solver_type", "mumps"}}},
      {"aij", {{"pc_type", "bjacobi"}}},
      {"aij", {}},
      {"sbaij", {}},
      {"shell", {}}};
  return all;
}

TEST(Potential, HessianIsTheDerivativeOfTheGradientWhateverTheMatrixAndThePairs) {
  for (const char* type : {"baij", "aij", "sbaij", "shell"}) {
    SpringBalloon balloon;
    balloon.options.positive_elements = false;
    WallPotential wall(balloon.elements, balloon.options);
    const std::vector<Potential*> potentials{&wall, &balloon.springs};
    const auto& projectors = balloon.constraints.projectors;
    Tangent tangent(balloon.membrane.particles, potentials, projectors, Choice<TangentMatrix>(type), "prism_");
    const Mat matrix = tangent.matrix();
    const PetscInt owned = balloon.membrane.particles.owned;

    Field direction(balloon.membrane.particles, 3);  // where vertices may move
    for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
      const double id = balloon.membrane.persistent_id[i];
      direction.vector(i) = projectors[i] * Eigen::Vector3d(std::sin(id), std::cos(3 * id), std::sin(2 + 5 * id));
    }
    const auto moved = [&](double step) {
      Field result(balloon.membrane.particles, 3);
      result.values() = balloon.x.values() + step * direction.values();
      return result;
    };
    const auto gradient = [&](double step) {
      Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, owned);
      for (const Potential* potential : potentials) {
        potential->add_gradient(moved(step), sum);
      }
      for (PetscInt i = 0; i < owned; ++i) {
        sum.col(i) = (projectors[i] * sum.col(i)).eval();
      }
      return sum;
    };
    const auto value = [&](double step) {
      double sum = 0;
      for (const Potential* potential : potentials) {
        sum += potential->value(moved(step));
      }
      MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
      return sum;
    };
    const auto largest = [](const Eigen::Matrix3Xd& values) {
      double result = values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0;
      MPI_Allreduce(MPI_IN_PLACE, &result, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
      return result;
    };
    VecHandle in, out;
    check(MatCreateVecs(matrix, in.create(), out.create()));
    double* values = nullptr;
    check(VecGetArrayWrite(in, &values));
    Eigen::Map<Eigen::Matrix3Xd>(values, 3, owned) = direction.values().leftCols(owned);
    check(VecRestoreArrayWrite(in, &values));

    for (const int choice : {0, 1, 0}) {
      balloon.springs.join(some_pairs(choice));
      tangent.update(balloon.x, Curvature::exact);
      EXPECT_EQ(tangent.matrix(), matrix);
      EXPECT_FALSE(tangent.renew_pattern()) << "of the same pairs";
      check(MatMult(matrix, in, out));
      const double* product = nullptr;
      check(VecGetArrayRead(out, &product));
      const Eigen::Matrix3Xd got = Eigen::Map<const Eigen::Matrix3Xd>(product, 3, owned);
      check(VecRestoreArrayRead(out, &product));
      constexpr double step = 1e-6;  // [m]
      const Eigen::Matrix3Xd expected = (gradient(step) - gradient(-step)) / (2 * step);
      EXPECT_LE(largest(got - expected), 1e-7 * largest(expected)) << type << ", choice " << choice;
      double slope = gradient(0).cwiseProduct(direction.values().leftCols(owned)).sum();
      MPI_Allreduce(MPI_IN_PLACE, &slope, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
      EXPECT_NEAR((value(step) - value(-step)) / (2 * step), slope, 1e-6 * std::abs(slope)) << type;
    }
    balloon.springs.join({});
    EXPECT_TRUE(tangent.renew_pattern());
  }
}

// Two steps from the same start, the second with other pairs: in each of its iterations the residual is squared.
TEST(Potential, NewtonConvergesQuadraticallyAlsoAfterThePairsHaveChanged) {
  std::vector<double> first_norms;
  for (const Way& displacement : ways()) {
    SolverOptions solver;
    for (const auto& [name, text] : displacement.solver) {
      solver.set("prism_" + name, text);
    }
    std::vector<double> norms;
    std::string line = displacement.mat_type;
    for (int iterations = 1; iterations <= 5; ++iterations) {
      PrismOptions options;
      options.mat_type = displacement.mat_type;
      options.positive_elements = false;
      options.newton = NewtonEnd::fixed;
      options.max_iterations = iterations;
      options.ksp_rtol = 1e-13;
      options.snes_rtol = 1e-13;
      SpringBalloon balloon(options);
      BalancedBalloon step(balloon);
      ImplicitResult result;
      for (const int choice : {0, 1}) {
        balloon.springs.join(some_pairs(choice));
        result = step.advance(0.003);
        ASSERT_TRUE(result.converged) << displacement.mat_type << ": " << result.reason;
      }
      norms.push_back(result.residual);
      char text[40];
      std::snprintf(text, sizeof text, " %.1e", result.residual);
      line += text;
    }
    print_once("%s N\n", line.c_str());
    for (std::size_t k = 0; k + 1 < norms.size(); ++k) {
      EXPECT_LT(norms[k + 1], 30 * norms[k] * norms[k] + 1e-10) << displacement.mat_type;
    }
    EXPECT_LT(norms.back(), 1e-10) << displacement.mat_type;
    if (first_norms.empty()) {
      first_norms = norms;
    }
    EXPECT_NEAR(norms[1], first_norms[1], 1e-4 * norms[1]) << displacement.mat_type << ": not the same step";
  }
}

// Springs that are compressed make the tangent indefinite, its diagonal blocks too: multigrid is then made from the
// positive tangent, on all levels, also after the pairs have changed.
TEST(Potential, NewtonFindsItsWayWhereCompressedSpringsMakeTheTangentIndefinite) {
  PrismOptions options;
  options.positive_elements = false;
  SpringBalloon balloon(options);
  balloon.springs.stiffness = 30;
  balloon.springs.length = 0.12;
  BalancedBalloon step(balloon);
  for (const int choice : {0, 1}) {
    balloon.springs.join(some_pairs(choice));
    const ImplicitResult result = step.advance(0.01);
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_GT(result.concave_iterations, 0);
    EXPECT_LT(result.relative_residual, 1e-3);
  }
}

}  // namespace
}  // namespace pellicle::potential_test
