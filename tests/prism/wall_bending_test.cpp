#include "prism/wall_bending.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "energies/tangent.h"
#include "geometry/principal_axes.h"
#include "linear/ksp.h"
#include "meshing/generators.h"
#include "meshing/triangulation.h"
#include "tests/prism/balloons.h"
#include "tests/prism/elements.h"
#include "tests/support/shaken_mesh.h"

namespace pellicle::wall_bending_test {
namespace {

constexpr double thickness = 2e-3;  // [m]
constexpr double shear = 4e5;       // mu [Pa]
/// Of a wall that keeps its volume.
constexpr double rigidity = shear * thickness * thickness * thickness / 3;

/// A wall with its bending.
struct BentWall : TestedWall {
  BentWall(MPI_Comm comm, const SurfaceMesh& mesh, WallOptions options = {}, bool is_clamped = false)
      : TestedWall(comm, mesh, with_thickness(std::move(options))),
        bending(elements, Projectors(local()), std::vector<bool>(local(), is_clamped)) {
    bending.begin_step(x, thickness_ratio);
  }

  static WallOptions with_thickness(WallOptions options) {
    options.thickness = thickness;
    return options;
  }
  std::size_t local() const { return static_cast<std::size_t>(membrane.particles.local()); }

  /// Moves every vertex to where `place` has it, and by up to `noise_size` from there.
  template <class Place>
  void move(const Place& place, double noise_size = 0) {
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const PetscInt id = membrane.persistent_id[i];
      x.vector(i) = place(Eigen::Vector3d(membrane.rest.col(i)));
      for (int c = 0; c < 3; ++c) {
        x.vector(i)[c] += noise_size * noise(id, c, 0);
      }
    }
  }
  double energy(const Field& at) const { return summed(bending.value(at)); }
  Eigen::Matrix3Xd gradient(const Field& at) const {
    Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, membrane.particles.owned);
    bending.add_gradient(at, sum);
    return by_id(sum);
  }
  /// H w by persistent id.
  Eigen::Matrix3Xd times(const Field& w, const std::string& mat_type, double psd_blend) {
    Choice<TangentMatrix> type = TangentMatrix::baij;
    type = mat_type;
    Tangent tangent(membrane.particles, {&bending}, Projectors(local()), type, "prism_");
    tangent.update(x, psd_blend);
    return product(tangent.matrix(), w);
  }
  /// By global numbers, on a single rank.
  Eigen::MatrixXd hessian(double psd_blend) {
    class Dense : public HessianBlocks {
     public:
      Dense(const std::vector<VertexPair>& pairs, Eigen::MatrixXd& sum) : pairs_(pairs), sum_(sum) {}
      void add(std::size_t pair, const Eigen::Matrix3d& block) const override {
        sum_.block<3, 3>(3 * pairs_[pair].row, 3 * pairs_[pair].column) += block;
      }

     private:
      const std::vector<VertexPair>& pairs_;
      Eigen::MatrixXd& sum_;
    };
    const Eigen::Index size = 3 * membrane.particles.global;
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
    const std::vector<VertexPair> pairs = bending.pattern();
    bending.update_hessian(x, psd_blend);
    bending.add_hessian(Dense(pairs, sum));
    return sum;
  }

  WallBending bending;
};

SurfaceMesh torus() { return triangulated(torus_mesh({18, 10}, 0.1, 0.04)); }

/// A disc whose inner points are shaken within their plane by a fraction of the edges.
SurfaceMesh shaken_disc(int rings, double radius, double fraction) {
  return shaken(disc_mesh(rings, radius), fraction * radius / rings, "rim");
}

/// Meshes with a deformation of each that is not small.
struct Shape {
  std::string name;
  SurfaceMesh mesh;
  bool is_clamped = false;
};

std::vector<Shape> shapes() {
  return {{"sphere", icosphere_mesh(1, 0.1)}, {"torus", torus()}, {"clamped disc", shaken_disc(4, 0.1, 0.2), true}};
}

void deform(BentWall& wall) {
  wall.move(
      [](const Eigen::Vector3d& r) {
        return Eigen::Vector3d(1.2 * r.x(), 0.9 * r.y() + 0.3 * r.z(), 1.1 * r.z() + 2 * r.x() * r.y());
      },
      2e-3);
}

TEST(WallBending, AnUndeformedWallOfAnyShapeIsAtRest) {
  for (const Shape& shape : shapes()) {
    BentWall wall(PETSC_COMM_WORLD, shape.mesh, {}, shape.is_clamped);
    EXPECT_LT(wall.energy(wall.x), 1e-24 * rigidity) << shape.name;
    EXPECT_LT(largest(wall.gradient(wall.x)), 1e-10 * rigidity / 0.1) << shape.name;
  }
}

TEST(WallBending, RigidMotionCostsNothing) {
  const Eigen::AngleAxisd turn(2, Eigen::Vector3d(1, -2, 0.5).normalized());
  for (const Shape& shape : {shapes()[0], shapes()[1]}) {
    BentWall wall(PETSC_COMM_WORLD, shape.mesh);
    wall.move([&](const Eigen::Vector3d& r) { return Eigen::Vector3d(turn * r + Eigen::Vector3d(1, 2, 3)); });
    EXPECT_LT(wall.energy(wall.x), 1e-22 * rigidity) << shape.name;
    EXPECT_LT(largest(wall.gradient(wall.x)), 1e-9 * rigidity / 0.1) << shape.name;

    // Nor does it in a deformed state: no resulting force, no resulting moment.
    deform(wall);
    const Eigen::Matrix3Xd forces = wall.gradient(wall.x);
    const Eigen::Matrix3Xd places = wall.by_id(wall.x.values().leftCols(wall.membrane.particles.owned));
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < forces.cols(); ++i) {
      moment += Eigen::Vector3d(places.col(i)).cross(Eigen::Vector3d(forces.col(i)));
    }
    EXPECT_LT(forces.rowwise().sum().norm(), 1e-12 * forces.norm()) << shape.name;
    EXPECT_LT(moment.norm(), 1e-13 * forces.norm()) << shape.name;
  }
}

TEST(WallBending, TheGradientIsTheDerivativeOfTheEnergy) {
  for (const Shape& shape : shapes()) {
    BentWall wall(PETSC_COMM_WORLD, shape.mesh, {}, shape.is_clamped);
    deform(wall);
    wall.bending.begin_step(wall.x, wall.thickness_ratio);
    const Field along = wall.random_field(1, 4);
    const Eigen::Matrix3Xd displacement = wall.by_id(along.values().leftCols(wall.membrane.particles.owned));
    const double slope = wall.gradient(wall.x).cwiseProduct(displacement).sum();
    // The remainder of the Taylor series is of second order, and central differences leave one of third.
    const auto remainder = [&](double step) {
      return std::abs(wall.energy(wall.moved(along, step)) - wall.energy(wall.x) - step * slope);
    };
    EXPECT_NEAR(remainder(1e-5) / remainder(5e-6), 4, 0.1) << shape.name;
    const double step = 1e-7;
    const double difference =
        (wall.energy(wall.moved(along, step)) - wall.energy(wall.moved(along, -step))) / (2 * step);
    EXPECT_NEAR(difference, slope, 1e-6 * std::abs(slope)) << shape.name;
  }
}

TEST(WallBending, TheHessianIsTheDerivativeOfTheGradient) {
  for (const Shape& shape : shapes()) {
    BentWall wall(PETSC_COMM_WORLD, shape.mesh, {}, shape.is_clamped);
    deform(wall);
    wall.bending.begin_step(wall.x, wall.thickness_ratio);
    const Field along = wall.random_field(1, 4);
    const Eigen::Matrix3Xd product = wall.times(along, "baij", Curvature::exact);
    const double step = 1e-7;
    const Eigen::Matrix3Xd difference =
        (wall.gradient(wall.moved(along, step)) - wall.gradient(wall.moved(along, -step))) / (2 * step);
    EXPECT_LT(largest(product - difference), 1e-6 * largest(product)) << shape.name;
  }
}

TEST(WallBending, AllMatricesAgree) {
  BentWall wall(PETSC_COMM_WORLD, torus());
  deform(wall);
  const Field along = wall.random_field(1, 4);
  for (const double psd_blend : {Curvature::exact, Curvature::psd}) {
    const Eigen::Matrix3Xd product = wall.times(along, "baij", psd_blend);
    for (const char* type : {"aij", "sbaij", "shell"}) {
      EXPECT_LT(largest(wall.times(along, type, psd_blend) - product), 1e-13 * largest(product)) << type;
    }
  }
}

TEST(WallBending, ThePositivePartHasNoNegativeEigenvalueAndIsExactAtRest) {
  for (const Shape& shape : shapes()) {
    BentWall wall(PETSC_COMM_SELF, shape.mesh, {}, shape.is_clamped);
    const Eigen::MatrixXd at_rest = wall.hessian(Curvature::exact);
    EXPECT_LT((wall.hessian(Curvature::psd) - at_rest).norm(), 1e-9 * at_rest.norm()) << shape.name;
    deform(wall);
    wall.bending.begin_step(wall.x, wall.thickness_ratio);
    const Eigen::MatrixXd exact = wall.hessian(Curvature::exact);
    EXPECT_LT((exact - exact.transpose()).norm(), 1e-13 * exact.norm()) << shape.name;
    const Eigen::VectorXd of_exact = principal_axes(exact).values;
    EXPECT_LT(of_exact[0], -1e-3 * of_exact.maxCoeff()) << "no test of " << shape.name;
    const Eigen::VectorXd values = principal_axes(wall.hessian(Curvature::psd)).values;
    EXPECT_GT(values[0], -1e-13 * values.maxCoeff()) << shape.name;

    const Eigen::MatrixXd positive = wall.hessian(Curvature::psd);
    const Eigen::MatrixXd on_the_way = 0.75 * exact + 0.25 * positive;
    EXPECT_LT((wall.hessian(0.25) - on_the_way).norm(), 1e-13 * exact.norm()) << shape.name;
  }
}

TEST(WallBending, AnyNumberOfRanksGivesTheSame) {
  std::vector<Shape> all = shapes();
  all.push_back({"four triangles, which leave ranks empty", square_mesh({1, 1}, {0.1, 0.1}), true});
  for (const Shape& shape : all) {
    BentWall wall(PETSC_COMM_WORLD, shape.mesh, {}, shape.is_clamped);
    BentWall alone(PETSC_COMM_SELF, shape.mesh, {}, shape.is_clamped);
    for (BentWall* each : {&wall, &alone}) {
      deform(*each);
      each->bending.begin_step(each->x, each->thickness_ratio);
    }
    EXPECT_NEAR(wall.energy(wall.x), alone.energy(alone.x), 1e-12 * alone.energy(alone.x)) << shape.name;
    const Eigen::Matrix3Xd expected = alone.gradient(alone.x);
    EXPECT_LT(largest(wall.gradient(wall.x) - expected), 1e-11 * largest(expected)) << shape.name;
    const Eigen::Matrix3Xd product = alone.times(alone.random_field(1, 4), "baij", Curvature::exact);
    EXPECT_LT(largest(wall.times(wall.random_field(1, 4), "baij", Curvature::exact) - product),
              1e-11 * largest(product))
        << shape.name;
  }
}

/// A flat wall stretched along x and y, then bent in its present lengths.
struct Plate {
  SurfaceMesh mesh;
  WallOptions options{};
  Eigen::Vector2d stretch = Eigen::Vector2d::Ones();
  PlateCurvature curvature;

  /// Of its present area [J/m^2].
  double energy() const {
    BentWall wall(PETSC_COMM_WORLD, mesh, options);
    constexpr double small = 1e-4;  // of slopes, the square of which does not count
    const auto bend = [&](double fraction) {
      wall.move([&](const Eigen::Vector3d& r) {
        const double x = stretch[0] * r.x(), y = stretch[1] * r.y();
        return Eigen::Vector3d(x, y,
                               fraction * (curvature[0] * x * x / 2 + curvature[1] * x * y + curvature[2] * y * y / 2));
      });
    };
    bend(0);
    wall.elements.update_thickness(wall.x, wall.thickness_ratio);
    wall.bending.begin_step(wall.x, wall.thickness_ratio);
    bend(small);
    double area = 0;
    for (PetscInt e = 0; e < wall.membrane.elements.owned; ++e) {
      area += wall.wall.rest[e].area * stretch.prod();
    }
    MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return wall.energy(wall.x) / (small * small * area);
  }
};

/// D/2 ((1 - nu) k:k + nu (tr k)^2).
double energy_of_plate(double rigidity_of_it, double poisson, const PlateCurvature& k) {
  return rigidity_of_it / 2 *
         ((1 - poisson) * (k[0] * k[0] + 2 * k[1] * k[1] + k[2] * k[2]) + poisson * std::pow(k[0] + k[2], 2));
}

TEST(WallBending, EvenCurvatureHasTheEnergyOfAPlateOnAnyMesh) {
  for (const PlateCurvature& k : {PlateCurvature(1, 0, 0), PlateCurvature(0.3, 0.8, -1), PlateCurvature(1, 0, 1)}) {
    for (const SurfaceMesh& mesh : {disc_mesh(5, 0.1), shaken_disc(5, 0.1, 0.3), square_mesh({6, 4}, {0.1, 0.1})}) {
      const double energy = energy_of_plate(rigidity, 0.5, k);
      EXPECT_NEAR((Plate{mesh, {}, {1, 1}, k}.energy()), energy, 1e-6 * energy);
    }
  }
}

TEST(WallBending, ModuliAreThoseOfSmallStrain) {
  const PlateCurvature k(0.3, 0.8, -0.6);
  for (const auto& [law, poisson] : {std::pair("st_venant_kirchhoff", 0.3), std::pair("neo_hookean", 0.1)}) {
    WallOptions options;
    options.thickness_rule = "plane_stress";
    options.material.law = law;
    options.material.young_modulus = 1e6;
    options.material.poisson_ratio = poisson;
    const double of_wall = 1e6 * std::pow(thickness, 3) / (12 * (1 - poisson * poisson));
    const double energy = energy_of_plate(of_wall, poisson, k);
    EXPECT_NEAR((Plate{disc_mesh(4, 0.1), options, {1, 1}, k}.energy()), energy, 1e-6 * energy) << law;
    options.thickness_rule = "incompressible";
    const double kept = energy_of_plate(1e6 / (2 * (1 + poisson)) * std::pow(thickness, 3) / 3, 0.5, k);
    EXPECT_NEAR((Plate{disc_mesh(4, 0.1), options, {1, 1}, k}.energy()), kept, 1e-6 * kept) << law;
  }
}

TEST(WallBending, AStretchedWallIsAPlateOfItsPresentLengthsAndThickness) {
  const PlateCurvature k(0.3, 0.8, -0.6);
  const double energy = energy_of_plate(rigidity / std::pow(2 * 1.3, 3), 0.5, k);
  EXPECT_NEAR((Plate{shaken_disc(5, 0.1, 0.2), {}, {2, 1.3}, k}.energy()), energy, 1e-6 * energy);
}

TEST(WallBending, AWallThatHasShrunkIsAtRestAsASmallerOne) {
  BentWall wall(PETSC_COMM_WORLD, torus());
  const std::size_t elements = wall.membrane.triangles.size();
  wall.elements.set_burnt(std::vector<double>(elements, 0.5), std::vector<double>(elements, 0.8));
  wall.move([](const Eigen::Vector3d& r) { return Eigen::Vector3d(0.8 * r); });
  wall.bending.begin_step(wall.x, wall.thickness_ratio);
  EXPECT_LT(wall.energy(wall.x), 1e-24 * rigidity);
  EXPECT_LT(largest(wall.gradient(wall.x)), 1e-10 * rigidity / 0.1);
}

TEST(WallBending, SidesOfLostElementsAreFree) {
  BentWall wall(PETSC_COMM_WORLD, shaken_disc(6, 0.1, 0.2));
  std::vector<double> stiffness;
  double area = 0;
  for (std::size_t e = 0; e < wall.membrane.triangles.size(); ++e) {
    const bool is_lost = wall.membrane.element_id[e] < 6;
    stiffness.push_back(is_lost ? 0 : 1);
    area += e < static_cast<std::size_t>(wall.membrane.elements.owned) && !is_lost ? wall.wall.rest[e].area : 0;
  }
  MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  wall.elements.set_burnt(stiffness, std::vector<double>(stiffness.size(), 1.0));
  wall.bending.begin_step(wall.x, wall.thickness_ratio);
  wall.move([](const Eigen::Vector3d& r) { return Eigen::Vector3d(r.x(), r.y(), 5e-5 * r.x() * r.x()); });
  const double energy = energy_of_plate(rigidity, 0.5, {1e-4, 0, 0}) * area;
  EXPECT_NEAR(wall.energy(wall.x), energy, 1e-6 * energy);
  // What is left of a vertex whose triangles have gone is anywhere.
  for (PetscInt i = 0; i < wall.membrane.particles.local(); ++i) {
    if (wall.membrane.persistent_id[i] == 0) {
      wall.x.vector(i) << 5, 7, 9;
    }
  }
  EXPECT_NEAR(wall.energy(wall.x), energy, 1e-6 * energy);
}

}  // namespace
}  // namespace pellicle::wall_bending_test
