
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>

#include "base/error.h"
#include "energies/tangent.h"
#include "geometry/pressure_load.h"
#include "geometry/principal_axes.h"
#include "linear/ksp.h"
#include "prism/wall_potential.h"
#include "tests/prism/balloons.h"

namespace pellicle {
namespace {

constexpr double stiffness_scale = 4e5 * 0.3e-3;  // mu h [N/m]

/// A way to form the tangent: mat_type and kernel.
struct Way {
  std::string mat_type;
  std::string tangent;
};

std::vector<Way> ways() {
  return {{"baij", "exact"},  {"aij", "exact"},      {"sbaij", "exact"},
          {"shell", "exact"}, {"shell", "gradient"}, {"baij", "gradient"}};
}

/// A quadratic potential of single vertices.
struct VertexBlocks : Potential {
  explicit VertexBlocks(const Layout& layout)
      : vertices(layout), hessian(static_cast<std::size_t>(layout.owned), Eigen::Matrix3d::Zero()) {}
  double value(const Field& x) const override {
    Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, vertices.owned);
    add_gradient(x, gradient);
    return gradient.cwiseProduct(x.values().leftCols(vertices.owned)).sum() / 2;
  }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override {
    for (PetscInt i = 0; i < vertices.owned; ++i) {
      gradient.col(i) += hessian[i] * x.vector(i);
    }
  }
  std::vector<VertexPair> pattern() const override {
    std::vector<VertexPair> pairs;
    for (PetscInt i = 0; i < vertices.owned; ++i) {
      pairs.push_back({i, vertices.to_global(i)});
    }
    return pairs;
  }
  void update_hessian(const Field&, double) override {}
  void add_hessian(const HessianBlocks& blocks) const override {
    for (std::size_t i = 0; i < hessian.size(); ++i) {
      blocks.add(i, hessian[i]);
    }
  }

  const Layout& vertices;
  std::vector<Eigen::Matrix3d> hessian;
};

/// A tangent of a balloon with what it is made of.
class BalloonTangent {
 public:
  BalloonTangent(Balloon& balloon, const Way& displacement, bool positive = false)
      : balloon_(balloon),
        blocks_(balloon.membrane.particles),
        projectors(static_cast<std::size_t>(balloon.membrane.particles.local())),
        vertex_blocks(blocks_.hessian) {
    options.mat_type = displacement.mat_type;
    options.tangent = displacement.tangent;
    options.positive_elements = positive;
    options.mass_damping = 0;
  }

  /// Adds damping with this factor of the stiffness at these positions.
  void damp(double factor, const Field& start) {
    options.stiffness_damping = factor;
    damping = std::make_unique<DampingPotential>(balloon_.elements, no_mass_, options);
    damping->begin_step(start, balloon_.thickness_ratio, start.values(), 1);
  }

  Mat matrix() {
    if (tangent_ == nullptr) {
      wall_ = std::make_unique<WallPotential>(balloon_.elements, options);
      std::vector<Potential*> potentials{wall_.get(), &blocks_};
      if (damping != nullptr) {
        potentials.push_back(damping.get());
      }
      tangent_ =
          std::make_unique<Tangent>(balloon_.membrane.particles, potentials, projectors, options.mat_type, "prism_");
    }
    wall_->set_thickness(balloon_.thickness_ratio);
    wall_->set_load(load_pressure);
    tangent_->update(balloon_.x, positive ? Curvature::psd : psd_blend);
    return tangent_->matrix();
  }

  /// K w by persistent id.
  Eigen::Matrix3Xd times(const Field& w) { return balloon_.product(matrix(), w); }

 private:
  Balloon& balloon_;
  std::vector<double> no_mass_;
  VertexBlocks blocks_;
  std::unique_ptr<WallPotential> wall_;
  std::unique_ptr<Tangent> tangent_;

 public:
  PrismOptions options;
  Projectors projectors;
  std::vector<double> load_pressure;
  std::vector<Eigen::Matrix3d>& vertex_blocks;
  std::unique_ptr<DampingPotential> damping;
  bool positive = false;
  double psd_blend = 0;  ///< if it is not positive
};

/// An inflated balloon, dented, with compressed elements here and there.
struct Dented : Balloon {
  explicit Dented(MPI_Comm comm, const std::string& rule = "incompressible", double lambda = 0)
      : Balloon(comm, 2, wall_options(rule, lambda)) {
    deform({1.3, 1.1, 0.9}, 0.02);
  }

  /// Change of the elastic force by a displacement, by central differences.
  Eigen::Matrix3Xd force_change(const Field& w, double step) const {
    return by_id((force(moved(w, step)) - force(moved(w, -step))) / (2 * step));
  }
};

class TangentOf : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(all, TangentOf, ::testing::Values("fixed", "incompressible", "plane_stress"),
                         [](const auto& info) { return info.param; });

TEST_P(TangentOf, IsMinusTheDerivativeOfTheForce) {
  Dented balloon(PETSC_COMM_WORLD, GetParam(), 6e5);
  const Field w = balloon.random_field(1, 2);
  for (const bool burns : {false, true}) {
    if (burns) {
      balloon.burn();
    }
    const Eigen::Matrix3Xd expected = -balloon.force_change(w, 1e-7);
    for (const Way& displacement : ways()) {
      EXPECT_LE(largest(BalloonTangent(balloon, displacement).times(w) - expected), 1e-6 * largest(expected))
          << displacement.mat_type << " " << displacement.tangent << (burns ? ", burnt" : "");
    }
  }
}

// f(x + h w) = f(x) - h K w + O(h^2): halving h divides the remainder by 4.
TEST_P(TangentOf, LeavesARemainderOfSecondOrder) {
  Dented balloon(PETSC_COMM_WORLD, GetParam(), 6e5);
  const Field w = balloon.random_field(1, 3);
  const Eigen::Matrix3Xd product = BalloonTangent(balloon, {"baij", "exact"}).times(w);
  const Eigen::Matrix3Xd force = balloon.by_id(balloon.force(balloon.x));
  const auto remainder = [&](double h) {
    return (balloon.by_id(balloon.force(balloon.moved(w, h))) - force + h * product).norm();
  };
  for (const double h : {1e-4, 5e-5, 2.5e-5}) {
    EXPECT_NEAR(remainder(h) / remainder(h / 2), 4, 0.1);
  }
}

/// Everything that a tangent may hold.
void fill(BalloonTangent& tangent, const Balloon& balloon) {
  const Membrane& membrane = balloon.membrane;
  tangent.load_pressure.assign(membrane.triangles.size(), 2500.0);
  for (std::size_t i = 0; i < tangent.vertex_blocks.size(); ++i) {
    const Eigen::Vector3d v(1, noise(membrane.persistent_id[i], 0, 5), 0.5);
    tangent.vertex_blocks[i] = 0.1 * stiffness_scale * (Eigen::Matrix3d::Identity() + v * v.transpose());
  }
  for (std::size_t i = 0; i < tangent.projectors.size(); ++i) {
    const PetscInt id = membrane.persistent_id[i];
    const Eigen::Vector3d normal = Eigen::Vector3d(1, noise(id, 0, 6), 0).normalized();
    if (id % 5 == 0) {
      tangent.projectors.bind(i, Eigen::Matrix3d::Identity() - normal * normal.transpose());
    } else if (id % 7 == 0) {
      tangent.projectors.bind(i, normal * normal.transpose());
    } else if (id % 11 == 0) {
      tangent.projectors.bind(i, Eigen::Matrix3d::Zero());
    }
  }
  tangent.damp(0.3, balloon.moved(balloon.random_field(0.1, 7), 0.01));
}

TEST(WallTangent, AllWaysAgree) {
  for (const bool positive : {false, true}) {
    Dented balloon(PETSC_COMM_WORLD);
    const Field w = balloon.random_field(1, 4);
    BalloonTangent first(balloon, {"baij", "exact"}, positive);
    fill(first, balloon);
    const Eigen::Matrix3Xd expected = first.times(w);
    for (const Way& displacement : ways()) {
      if (displacement.tangent == "exact" || !positive) {
        BalloonTangent tangent(balloon, displacement, positive);
        fill(tangent, balloon);
        EXPECT_LE(largest(tangent.times(w) - expected), 1e-12 * largest(expected))
            << displacement.mat_type << displacement.tangent;
        EXPECT_LE(largest(tangent.times(w) - expected), 1e-12 * largest(expected)) << "a second time";
      }
    }
  }
}

TEST(WallTangent, WithoutTheDirectorsDerivativeMatrixAndProductAgree) {
  Dented balloon(PETSC_COMM_WORLD);
  const Field w = balloon.random_field(1, 4);
  const Eigen::Matrix3Xd expected = BalloonTangent(balloon, {"shell", "paper"}).times(w);
  EXPECT_LE(largest(BalloonTangent(balloon, {"baij", "paper"}).times(w) - expected), 1e-12 * largest(expected));
  EXPECT_GE(largest(BalloonTangent(balloon, {"shell", "gradient"}).times(w) - expected), 1e-3 * largest(expected));
}

TEST(WallTangent, IsSymmetric) {
  Dented balloon(PETSC_COMM_WORLD);
  const Field u = balloon.random_field(1, 4);
  const Field w = balloon.random_field(1, 5);
  const PetscInt owned = balloon.membrane.particles.owned;
  const Eigen::Matrix3Xd all_u = balloon.by_id(u.values().leftCols(owned));
  const Eigen::Matrix3Xd all_w = balloon.by_id(w.values().leftCols(owned));
  for (const Way& displacement : ways()) {
    BalloonTangent tangent(balloon, displacement);
    fill(tangent, balloon);
    const double product = tangent.times(w).cwiseProduct(all_u).sum();
    EXPECT_NEAR(tangent.times(u).cwiseProduct(all_w).sum(), product, 1e-11 * std::abs(product))
        << displacement.mat_type;
  }
}

TEST(WallTangent, RigidMotionMeetsNoStiffnessAtRest) {
  Balloon balloon(PETSC_COMM_WORLD, 2, wall_options("incompressible"));
  Field shift(balloon.membrane.particles, 3);
  shift.values().colwise() = Eigen::Vector3d(0.3, -0.5, 0.2);
  Field turn(balloon.membrane.particles, 3);
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    turn.vector(i) = Eigen::Vector3d(2, 3, -1).cross(Eigen::Vector3d(balloon.x.vector(i)));
  }
  for (const Way& displacement : ways()) {
    BalloonTangent tangent(balloon, displacement);
    EXPECT_LE(largest(tangent.times(shift)), 1e-12 * stiffness_scale) << displacement.mat_type << displacement.tangent;
    EXPECT_LE(largest(tangent.times(turn)), 1e-12 * stiffness_scale) << displacement.mat_type << displacement.tangent;
  }
}

// P K P w where the vertices may move, s w with one s where they are constrained.
TEST(WallTangent, MovesNothingInDirectionsThatAreHeld) {
  Dented balloon(PETSC_COMM_WORLD);
  const PetscInt owned = balloon.membrane.particles.owned;
  const Field w = balloon.random_field(1, 4);
  BalloonTangent constrained(balloon, {"baij", "exact"});
  fill(constrained, balloon);
  constrained.damping.reset();
  BalloonTangent free(balloon, {"baij", "exact"});
  free.load_pressure = constrained.load_pressure;
  free.vertex_blocks = constrained.vertex_blocks;
  Field projected(balloon.membrane.particles, 3);
  Eigen::Matrix3Xd along(3, owned);
  Eigen::Matrix3Xd across(3, owned);
  const auto split = [&](const auto& all, PetscInt i) {
    const auto column = static_cast<std::size_t>(i);
    const Eigen::Vector3d value = all.col(balloon.membrane.persistent_id[column]);
    along.col(i) = constrained.projectors[column] * value;
    across.col(i) = value - along.col(i);
  };
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    projected.vector(i) = constrained.projectors[i] * w.vector(i);
  }
  const Eigen::Matrix3Xd expected = free.times(projected);
  for (PetscInt i = 0; i < owned; ++i) {
    split(expected, i);
  }
  const Eigen::Matrix3Xd expected_along = balloon.by_id(along);
  const Eigen::Matrix3Xd expected_across = balloon.by_id((w.values() - projected.values()).leftCols(owned));  // times s
  const Eigen::Matrix3Xd product = constrained.times(w);
  for (PetscInt i = 0; i < owned; ++i) {
    split(product, i);
  }
  EXPECT_LE(largest(balloon.by_id(along) - expected_along), 1e-12 * largest(product));
  const Eigen::Matrix3Xd product_across = balloon.by_id(across);
  const double s = product_across.cwiseProduct(expected_across).sum() / expected_across.squaredNorm();
  EXPECT_GT(s, 0.1 * stiffness_scale);
  EXPECT_LE(largest(product_across - s * expected_across), 1e-12 * largest(product));
}

TEST(WallTangent, LoadStiffnessIsMinusTheDerivativeOfThePressureForce) {
  Dented balloon(PETSC_COMM_WORLD);
  const PetscInt owned = balloon.membrane.particles.owned;
  const double pressure = 2500;
  const Field w = balloon.random_field(1, 4);
  const auto load = [&](const Field& x) {
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, balloon.membrane.particles.local());
    for (const auto& [a, b, c] : balloon.membrane.triangles) {
      const Eigen::Vector3d fraction = pressure / 3 * area_vector(x.vector(a), x.vector(b), x.vector(c));
      for (const PetscInt i : {a, b, c}) {
        force.col(i) += fraction;
      }
    }
    return Eigen::Matrix3Xd(force.leftCols(owned));
  };
  const double step = 1e-5;  // The force is of second degree: central differences are exact.
  const Eigen::Matrix3Xd expected =
      -balloon.by_id((load(balloon.moved(w, step)) - load(balloon.moved(w, -step))) / (2 * step));
  for (const Way& displacement : ways()) {
    BalloonTangent tangent(balloon, displacement);
    const Eigen::Matrix3Xd without = tangent.times(w);
    tangent.load_pressure.assign(balloon.membrane.triangles.size(), pressure);
    EXPECT_LE(largest(tangent.times(w) - without - expected), 1e-8 * largest(expected))
        << displacement.mat_type << displacement.tangent;
  }
}

TEST(WallTangent, LaggedStiffnessStaysWhereItWasTaken) {
  Dented balloon(PETSC_COMM_WORLD);
  const Field w = balloon.random_field(1, 4);
  const Eigen::Matrix3Xd before = BalloonTangent(balloon, {"shell", "exact"}, true).times(w);
  BalloonTangent tangent(balloon, {"shell", "exact"}, true);
  tangent.damp(0.25, balloon.x);
  const Field displaced = balloon.moved(w, 1);
  balloon.deform({1.5, 1.4, 1.3}, 0.01);
  const Eigen::Matrix3Xd after = BalloonTangent(balloon, {"shell", "exact"}, true).times(w);
  EXPECT_LE(largest(tangent.times(w) - (after + 0.25 * before)), 1e-12 * largest(before));
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Constant(3, balloon.membrane.particles.owned, 2.0);
  tangent.damping->add_gradient(displaced, gradient);
  EXPECT_LE(largest(balloon.by_id(gradient) - (0.25 * before + Eigen::Matrix3Xd::Constant(3, before.cols(), 2.0))),
            1e-12 * largest(before));
  const double value = balloon.summed(tangent.damping->value(displaced));
  const PetscInt owned = balloon.membrane.particles.owned;
  EXPECT_NEAR(value, 0.125 * before.cwiseProduct(balloon.by_id(w.values().leftCols(owned))).sum(), 1e-12 * value);
}

TEST(WallTangent, ValuesAreThoseOfTheLastUpdate) {
  Dented balloon(PETSC_COMM_WORLD);
  const Field w = balloon.random_field(1, 4);
  for (const Way& displacement : ways()) {
    BalloonTangent used(balloon, displacement);
    used.times(w);
    balloon.deform({1.5, 1.2, 1.1}, 0.01);
    BalloonTangent fresh(balloon, displacement);
    const Eigen::Matrix3Xd expected = fresh.times(w);
    EXPECT_LE(largest(used.times(w) - expected), 1e-13 * largest(expected))
        << displacement.mat_type << displacement.tangent;
    balloon.deform({1.3, 1.1, 0.9}, 0.02);
  }
}

/// Of a small matrix on one rank.
double lowest_eigenvalue(Mat matrix) {
  MatHandle dense;
  check(MatComputeOperator(matrix, MATDENSE, dense.create()));
  const double* values = nullptr;
  PetscInt size = 0;
  check(MatGetSize(dense, &size, nullptr));
  check(MatDenseGetArrayRead(dense, &values));
  const double smallest = principal_axes(Eigen::Map<const Eigen::MatrixXd>(values, size, size)).values[0];
  check(MatDenseRestoreArrayRead(dense, &values));
  return smallest;
}

// On every rank for itself: the matrix is small and dense.
TEST(WallTangent, PositiveElementsHaveNoNegativeEigenvalue) {
  Balloon balloon(PETSC_COMM_SELF, 1, wall_options("incompressible"));
  balloon.deform({0.8, 0.7, 1.1}, 0.02);
  EXPECT_LT(lowest_eigenvalue(BalloonTangent(balloon, {"baij", "exact"}, false).matrix()), -0.1 * stiffness_scale);
  EXPECT_GT(lowest_eigenvalue(BalloonTangent(balloon, {"baij", "exact"}, true).matrix()), -1e-12 * stiffness_scale);
}

// Compressed, under a load that would blow it up, and free to move as a whole.
TEST(WallTangent, APositiveOneIsPositiveDefiniteWhateverTheState) {
  Balloon balloon(PETSC_COMM_SELF, 1, wall_options("incompressible"));
  balloon.deform({0.8, 0.7, 1.1}, 0.02);
  for (const Way& displacement : ways()) {
    for (const bool constrained : {false, true}) {
      BalloonTangent tangent(balloon, displacement);
      tangent.load_pressure.assign(balloon.membrane.triangles.size(), 1e4);
      if (constrained) {
        tangent.projectors.bind(3, Eigen::Vector3d(1, 0, 1).asDiagonal());
      }
      EXPECT_LT(lowest_eigenvalue(tangent.matrix()), -0.1 * stiffness_scale) << displacement.mat_type;
      tangent.positive = true;
      EXPECT_GT(lowest_eigenvalue(tangent.matrix()), 1e-7 * stiffness_scale)
          << displacement.mat_type << " " << displacement.tangent;
      tangent.positive = false;
      EXPECT_LT(lowest_eigenvalue(tangent.matrix()), -0.1 * stiffness_scale) << "the exact one again";
    }
  }
}

// K_s = (1 - s) K + s K+, with K+ that of positive elements without the pressure's stiffness.
TEST(WallTangent, AnExactOneGoesOverToThePositiveOneInProportion) {
  Balloon balloon(PETSC_COMM_SELF, 1, wall_options("incompressible"));
  balloon.deform({0.8, 0.7, 1.1}, 0.02);
  const Field direction = balloon.random_field(1, 4);
  const auto pressure = std::vector<double>(balloon.membrane.triangles.size(), 1e4);
  for (const char* type : {"baij", "shell"}) {
    BalloonTangent tangent(balloon, {type, "exact"});
    tangent.load_pressure = pressure;
    const auto product = [&](double fraction) {
      tangent.psd_blend = fraction;
      return tangent.times(direction);
    };
    const Eigen::Matrix3Xd exact = product(0);
    const Eigen::Matrix3Xd positive = BalloonTangent(balloon, {type, "exact"}, true).times(direction);
    EXPECT_GT(largest(positive - exact), 0.1 * largest(exact));
    EXPECT_LE(largest(product(1 - 1e-14) - positive), 1e-12 * largest(exact)) << type;
    EXPECT_LE(largest(product(0.25) - 0.75 * exact - 0.25 * positive), 1e-12 * largest(exact)) << type;
    EXPECT_LE(largest(product(0) - exact), 0) << type;
  }
}

TEST(WallTangent, EveryNumberOfRanksGivesTheSame) {
  Dented balloon(PETSC_COMM_WORLD);
  Dented whole(PETSC_COMM_SELF);
  BalloonTangent serial(whole, {"baij", "exact"}, true);
  fill(serial, whole);
  const Eigen::Matrix3Xd expected = serial.times(whole.random_field(1, 4));
  for (const Way& displacement : {Way{"baij", "exact"}, Way{"sbaij", "exact"}, Way{"shell", "exact"}}) {
    BalloonTangent tangent(balloon, displacement, true);
    fill(tangent, balloon);
    EXPECT_LE(largest(tangent.times(balloon.random_field(1, 4)) - expected), 1e-11 * largest(expected))
        << displacement.mat_type;
  }
}

TEST(WallTangent, SystemsAreSolvedWithTheBlocksOfTheDiagonal) {
  Dented balloon(PETSC_COMM_WORLD);
  const PetscInt owned = balloon.membrane.particles.owned;
  std::vector<int> iterations;
  for (const Way& displacement : {Way{"baij", "exact"}, Way{"aij", "exact"}, Way{"shell", "exact"}}) {
    BalloonTangent tangent(balloon, displacement, true);
    fill(tangent, balloon);
    Mat matrix = tangent.matrix();
    VecHandle x, b;
    check(MatCreateVecs(matrix, x.create(), b.create()));
    double* values = nullptr;
    check(VecGetArrayWrite(b, &values));
    Eigen::Map<Eigen::Matrix3Xd>(values, 3, owned) = balloon.random_field(1, 8).values().leftCols(owned);
    check(VecRestoreArrayWrite(b, &values));
    KspDefaults defaults;
    defaults.preconditioner = PCPBJACOBI;
    defaults.rtol = 1e-10;
    const StageResult result = solve(make_ksp(matrix, matrix, "prism_", defaults), b, x);
    EXPECT_TRUE(result.converged) << displacement.mat_type << ": " << result.reason;
    iterations.push_back(result.iterations);
    VecHandle product;
    check(VecDuplicate(b, product.create()));
    check(MatMult(matrix, x, product));
    check(VecAXPY(product, -1, b));
    double error = 0, norm = 0;
    check(VecNorm(product, NORM_2, &error));
    check(VecNorm(b, NORM_2, &norm));
    EXPECT_LE(error, 1e-8 * norm) << displacement.mat_type;
  }
  EXPECT_NEAR(iterations[1], iterations[0], 1);
  EXPECT_NEAR(iterations[2], iterations[0], 1);
}

}  // namespace
}  // namespace pellicle
