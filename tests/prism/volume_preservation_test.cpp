#include "prism/volume_preservation.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <cmath>

#include "meshing/readers.h"
#include "parallel/collective.h"
#include "tests/support/balls.h"
#include "tests/support/print_once.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

Eigen::Vector3d uneven_stretch(const Eigen::Vector3d& point) {
  const Eigen::Vector3d q = 40 * point;
  return Eigen::Vector3d(1.3 * point.x(), 1.2 * point.y(), 1.25 * point.z()) +
         0.003 * Eigen::Vector3d(std::sin(q.y()), std::cos(q.z()), std::sin(q.x() + q.y()));
}

/// A balloon with an uneven wall, inflated unevenly.
struct Balloon {
  explicit Balloon(const SurfaceMesh& mesh, MPI_Comm comm = PETSC_COMM_WORLD)
      : membrane(make_membrane(comm, mesh, {})), positions(membrane.particles, 3) {
    WallOptions options;
    options.thickness_rule = "global";
    RegionOptions top;
    top.centre = {0, 0, 0.05};
    top.radius = 0.03;
    top.thickness = 0.2e-3;
    top.density = 1300;
    options.regions["top"] = top;
    wall = make_wall(membrane, options, {});
    projectors = Projectors(static_cast<std::size_t>(membrane.particles.local()));
    thickness_ratio.assign(membrane.triangles.size(), 0.9);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      positions.vector(i) = uneven_stretch(membrane.rest.col(i));
    }
  }

  StageResult preserve(const VolumeOptions& options) {
    return VolumePreservation(membrane, wall, projectors, options).advance(positions, thickness_ratio);
  }

  /// (V - V0) / V0 of a piece, V = sum A h. Collective.
  double volume_error(int piece = 0) const {
    double initial = 0;
    double present = 0;
    for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
      if (membrane.piece[e] == piece) {
        const auto& [a, b, c] = membrane.triangles[e];
        const Eigen::Vector3d e12 = positions.vector(b) - positions.vector(a);
        const Eigen::Vector3d e13 = positions.vector(c) - positions.vector(a);
        present += e12.cross(e13).norm() / 2 * thickness_ratio[e] * wall.thickness[e];
        initial += wall.rest[e].area * wall.thickness[e];
      }
    }
    initial = sum_over_ranks(membrane.comm(), initial);
    return (sum_over_ranks(membrane.comm(), present) - initial) / initial;
  }

  /// Collective. [kg m]
  Eigen::Vector3d first_moment() const {
    const std::vector<double> mass = vertex_masses(membrane, wall);
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < mass.size(); ++i) {
      moment += mass[i] * positions.vector(static_cast<PetscInt>(i));
    }
    MPI_Allreduce(MPI_IN_PLACE, moment.data(), 3, MPI_DOUBLE, MPI_SUM, membrane.comm());
    return moment;
  }

  Membrane membrane;
  Wall wall;
  Projectors projectors;
  Field positions;
  std::vector<double> thickness_ratio;
};

SurfaceMesh small_ball() { return icosphere_mesh(2, 0.05); }

TEST(VolumePreservation, GradientIsThatOfTheVolume) {
  Eigen::Matrix<double, 3, 4> x;
  x << 0.1, 0.9, 0.2, 0.5,  //
      0.2, 0.1, 0.8, 0.4,   //
      0.3, 0.2, -0.1, 0.9;
  const auto volume = [](const Eigen::Matrix<double, 3, 4>& at) {
    return prism_volume(at.col(1) - at.col(0), at.col(2) - at.col(0), at.col(3) - at.col(0));
  };
  const Eigen::Matrix<double, 3, 4> gradient = volume(x).gradient;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::Matrix<double, 3, 4> ahead = x;
    Eigen::Matrix<double, 3, 4> behind = x;
    ahead(i) += 1e-4;
    behind(i) -= 1e-4;
    // The volume is linear in each coordinate.
    EXPECT_NEAR((volume(ahead).value - volume(behind).value) / 2e-4, gradient(i), 1e-11);
  }
  EXPECT_LT(gradient.rowwise().sum().norm(), 1e-15) << "moving all alike changes nothing";
}

TEST(VolumePreservation, VirtualVertexStandsAtTheThicknessOverTheMiddle) {
  const Eigen::Vector3d e12(0.3, 0.1, 0.2);
  const Eigen::Vector3d e13(-0.1, 0.4, 0.1);
  const Eigen::Vector3d e14 = edge_to_virtual_vertex(e12, e13, 0.02);
  const Eigen::Vector3d up = e14 - (e12 + e13) / 3;
  EXPECT_NEAR(up.norm(), 0.02, 1e-15);
  EXPECT_NEAR(up.dot(e12), 0, 1e-16);
  EXPECT_NEAR(up.dot(e13), 0, 1e-16);
  EXPECT_NEAR(prism_volume(e12, e13, e14).value, 0.02 * e12.cross(e13).norm() / 2, 1e-16);
}

TEST(VolumePreservation, DefaultRuleConvergesQuadratically) {
  Balloon balloon(small_ball());
  VolumeOptions once;
  once.max_iterations = 1;
  once.tolerance = 1e-13;
  std::vector<double> errors{std::abs(balloon.volume_error())};
  for (int n = 0; n < 3; ++n) {
    const StageResult result = balloon.preserve(once);
    EXPECT_TRUE(result.converged) << result.reason;
    errors.push_back(std::abs(balloon.volume_error()));
    EXPECT_NEAR(result.error, errors.back(), 1e-13);
  }
  print_once("relative volume error %.2g, %.2g, %.2g, %.2g\n", errors[0], errors[1], errors[2], errors[3]);
  EXPECT_GT(errors[0], 0.3);
  EXPECT_LT(errors[1], 0.02 * errors[0] * errors[0]);
  EXPECT_GT(errors[1], 1e-5) << "one correction alone is not exact";
  EXPECT_LT(errors[2], 0.02 * errors[1] * errors[1] + 1e-13);
  EXPECT_LT(errors[3], 1e-13);
}

TEST(VolumePreservation, WorksToTheTolerance) {
  for (const char* rule : {"mass", "muller06"}) {
    Balloon balloon(small_ball());
    VolumeOptions options;
    options.rule = rule;
    const StageResult result = balloon.preserve(options);
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_LE(result.error, options.tolerance);
    EXPECT_NEAR(balloon.volume_error(), 0, options.tolerance);
    EXPECT_LE(result.iterations, rule == std::string("mass") ? 3 : 20) << rule;
    const StageResult again = balloon.preserve(options);
    EXPECT_EQ(again.iterations, 0) << "nothing is left to correct";
  }
}

TEST(VolumePreservation, CorrectionsThatRunOutAreNoFailure) {
  Balloon balloon(small_ball());
  VolumeOptions options;
  options.rule = "muller06";
  options.max_iterations = 2;
  const StageResult result = balloon.preserve(options);
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.iterations, 2);
  EXPECT_GT(result.error, options.tolerance);
}

TEST(VolumePreservation, RuleAsPrintedDivergesAndLeavesAllAsItWas) {
  Balloon balloon(small_ball());
  const Balloon untouched(small_ball());
  VolumeOptions options;
  options.rule = "printed";
  const StageResult result = balloon.preserve(options);
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.reason.find("diverged"), std::string::npos) << result.reason;
  EXPECT_EQ(balloon.positions.values(), untouched.positions.values());
  EXPECT_EQ(balloon.thickness_ratio, untouched.thickness_ratio);
}

TEST(VolumePreservation, CentreOfMassOfAClosedMembraneStays) {
  Balloon balloon(small_ball());
  const Eigen::Vector3d before = balloon.first_moment();
  const Eigen::MatrixXd start = balloon.positions.values();
  EXPECT_GT(balloon.preserve({}).iterations, 1);
  const double moved = (balloon.positions.values() - start).cwiseAbs().maxCoeff();
  double mass = 0;
  for (const double m : vertex_masses(balloon.membrane, balloon.wall)) {
    mass += m;
  }
  mass = sum_over_ranks(PETSC_COMM_WORLD, mass);
  const Eigen::Vector3d drift = (balloon.first_moment() - before) / mass;
  EXPECT_GT(sum_over_ranks(PETSC_COMM_WORLD, moved), 1e-7);
  EXPECT_LT(drift.norm(), 1e-15);
}

TEST(VolumePreservation, HeldVerticesStay) {
  Balloon balloon(small_ball());
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    const double height = balloon.membrane.rest(2, i);
    if (height > 0.04) {
      balloon.projectors.bind(static_cast<std::size_t>(i), Eigen::Matrix3d::Zero());
    } else if (height < 0) {
      balloon.projectors.bind(static_cast<std::size_t>(i), Eigen::Vector3d(1, 1, 0).asDiagonal());
    }
  }
  const Eigen::MatrixXd start = balloon.positions.values();
  const StageResult result = balloon.preserve({});
  EXPECT_TRUE(result.converged) << result.reason;
  EXPECT_LE(result.iterations, 3) << "the constraint is solved with what may move";
  EXPECT_NEAR(balloon.volume_error(), 0, 1e-9);
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    const Eigen::Vector3d moved = balloon.positions.values().col(i) - start.col(i);
    const double height = balloon.membrane.rest(2, i);
    if (height > 0.04) {
      EXPECT_EQ(moved.norm(), 0);
    } else {
      EXPECT_GT(moved.head<2>().norm(), 0);
      EXPECT_EQ(moved.z() == 0, height < 0);
    }
  }
}

TEST(VolumePreservation, EachPieceKeepsItsOwnVolume) {
  Balloon balloon(joined(small_ball(), icosphere_mesh(2, 0.04), {0.3, 0, 0}));
  ASSERT_EQ(balloon.membrane.pieces(), 2);
  // The second is as it was at first.
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    if (balloon.membrane.rest(0, i) > 0.2) {
      balloon.positions.vector(i) = balloon.membrane.rest.col(i);
    }
  }
  for (std::size_t e = 0; e < balloon.thickness_ratio.size(); ++e) {
    balloon.thickness_ratio[e] = balloon.membrane.piece[e] == 1 ? 1 : 0.9;
  }
  EXPECT_GT(balloon.volume_error(0), 0.3);
  EXPECT_TRUE(balloon.preserve({}).converged);
  EXPECT_NEAR(balloon.volume_error(0), 0, 1e-9);
  EXPECT_NEAR(balloon.volume_error(1), 0, 1e-14);
  for (PetscInt i = 0; i < balloon.membrane.particles.local(); ++i) {
    if (balloon.membrane.rest(0, i) > 0.2) {
      EXPECT_LT((balloon.positions.vector(i) - balloon.membrane.rest.col(i)).norm(), 1e-16);
    }
  }
}

TEST(VolumePreservation, ThicknessStaysPositive) {
  Balloon balloon(small_ball());
  for (std::size_t e = 0; e < balloon.thickness_ratio.size(); ++e) {
    balloon.thickness_ratio[e] = balloon.membrane.element_id[e] % 7 == 0 ? 1e-3 : 1;
  }
  const StageResult result = balloon.preserve({});
  EXPECT_TRUE(result.converged) << result.reason;
  EXPECT_NEAR(balloon.volume_error(), 0, 1e-9);
  for (const double ratio : balloon.thickness_ratio) {
    EXPECT_GT(ratio, 0);
  }
}

TEST(VolumePreservation, RanksAgree) {
  const SurfaceMesh mesh = joined(small_ball(), icosphere_mesh(2, 0.04), {0.3, 0, 0});
  Balloon spread(mesh);
  Balloon whole(mesh, PETSC_COMM_SELF);
  EXPECT_TRUE(spread.preserve({}).converged);
  EXPECT_TRUE(whole.preserve({}).converged);
  Eigen::MatrixXd expected(3, whole.membrane.particles.global);
  for (PetscInt i = 0; i < whole.membrane.particles.local(); ++i) {
    expected.col(whole.membrane.persistent_id[i]) = whole.positions.vector(i);
  }
  std::vector<double> ratios(whole.thickness_ratio.size());
  for (std::size_t e = 0; e < ratios.size(); ++e) {
    ratios[whole.membrane.element_id[e]] = whole.thickness_ratio[e];
  }
  for (PetscInt i = 0; i < spread.membrane.particles.local(); ++i) {
    const PetscInt id = spread.membrane.persistent_id[i];
    EXPECT_LT((spread.positions.vector(i) - expected.col(id)).norm(), 1e-15) << "ghosts too";
  }
  for (std::size_t e = 0; e < spread.thickness_ratio.size(); ++e) {
    EXPECT_NEAR(spread.thickness_ratio[e], ratios[spread.membrane.element_id[e]], 1e-11);
  }
}

/// The case B1 of the independent implementation.
class VolumeReference : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string base = (shared_folder() / "reference" / "B1_icosphere").string();
    if (!std::filesystem::exists(base + ".obj")) {
      GTEST_SKIP() << "no reference case at " << base;
    }
    params = YAML::LoadFile(base + ".params.json");
    expected = YAML::LoadFile(base + ".expected.json")["shell"];
    membrane = make_membrane(PETSC_COMM_WORLD, read_mesh(base + ".obj"), {});
    WallOptions options;
    options.thickness = params["h0"].as<double>();
    options.density = params["rho"].as<double>();
    wall = make_wall(membrane, options, {});
    projectors = Projectors(static_cast<std::size_t>(membrane.particles.local()));
    positions = Field(membrane.particles, 3);
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      positions.vector(i) = vector(params["x"], membrane.persistent_id[i]);
    }
    thickness_ratio.assign(membrane.triangles.size(), 1);  // the case's h_ratio is for its forces
  }

  static Eigen::Vector3d vector(const YAML::Node& list, PetscInt row) {
    return {list[row][0].as<double>(), list[row][1].as<double>(), list[row][2].as<double>()};
  }

  YAML::Node params;
  YAML::Node expected;
  Membrane membrane;
  Wall wall;
  Projectors projectors;
  Field positions;
  std::vector<double> thickness_ratio;
};

TEST_F(VolumeReference, VolumeAndGradients) {
  double sum = 0;
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, membrane.particles.owned);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const auto& corners = membrane.triangles[e];
    const PetscInt id = membrane.element_id[e];
    const Eigen::Vector3d x1 = positions.vector(corners[0]);
    const Eigen::Vector3d e12 = positions.vector(corners[1]) - x1;
    const Eigen::Vector3d e13 = positions.vector(corners[2]) - x1;
    const Eigen::Vector3d e14 = edge_to_virtual_vertex(e12, e13, thickness_ratio[e] * wall.thickness[e]);
    const PrismVolume volume = prism_volume(e12, e13, e14);
    EXPECT_LT((x1 + e14 - vector(expected["x4"], id)).norm(), 1e-10);
    EXPECT_LT((volume.gradient.col(3) - vector(expected["grad4"], id)).norm(), 1e-13);
    sum += static_cast<PetscInt>(e) < membrane.elements.owned ? volume.value : 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (corners[k] < membrane.particles.owned) {
        gradient.col(corners[k]) += volume.gradient.col(static_cast<Eigen::Index>(k));
      }
    }
  }
  const auto volume = expected["volume"].as<double>();
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, sum), volume, 1e-9 * volume);
  for (PetscInt i = 0; i < membrane.particles.owned; ++i) {
    const PetscInt id = membrane.persistent_id[i];
    EXPECT_LT((gradient.col(i) - vector(expected["grad"], id)).norm(), 1e-12);
  }
}

TEST_F(VolumeReference, OneCorrectionOfTwoRules) {
  const Eigen::MatrixXd start = positions.values();
  for (const char* rule : {"mass", "muller06"}) {
    positions.values() = start;
    thickness_ratio.assign(membrane.triangles.size(), 1);
    VolumeOptions options;
    options.rule = rule;
    options.max_iterations = 1;
    const StageResult result =
        VolumePreservation(membrane, wall, projectors, options).advance(positions, thickness_ratio);
    EXPECT_NEAR(result.error, std::abs(expected[rule]["C_rel"][1].as<double>()), 1e-9) << rule;
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const PetscInt id = membrane.persistent_id[i];
      EXPECT_LT((positions.vector(i) - vector(expected[rule]["x"], id)).norm(), 1e-9 * 0.065) << rule;
    }
    for (std::size_t e = 0; e < thickness_ratio.size(); ++e) {
      const auto thickness = expected[rule]["h"][membrane.element_id[e]].as<double>();
      EXPECT_NEAR(thickness_ratio[e] * wall.thickness[e], thickness, 1e-9 * thickness) << rule;
    }
  }
}

}  // namespace
}  // namespace pellicle
