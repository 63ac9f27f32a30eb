#include "elastic/bending_potential.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "surface/shell.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/product.h"

namespace pellicle {
namespace {

Sheet one_surface(MPI_Comm comm, const SurfaceMesh& mesh) {
  SheetOptions options;
  options.is_one_surface = true;
  return make_sheet(comm, mesh, options);
}

Sheet flat_sheet(MPI_Comm comm, const std::function<Eigen::Vector3d(double, double)>& place) {
  SurfaceMesh mesh = grid_mesh(12, 8, 0.1);
  for (Eigen::Vector3d& point : mesh.points) {
    point = place(point.x(), point.y());
  }
  return one_surface(comm, mesh);
}

/// A sheet whose bending is examined.
struct Bent {
  explicit Bent(Sheet made, std::array<double, 2> stiffness_of = {2, 2})
      : sheet(std::move(made)),
        none(static_cast<std::size_t>(sheet.particles.local()), false),
        ones(none.size(), 1),
        active(sheet),
        x(sheet.particles, 3),
        potential(sheet, Eigen::Vector3d::UnitX(), none),
        stiffness(stiffness_of) {
    x.values() = sheet.rest;
    begin(ones);
  }
  void begin(const std::vector<double>& shrinkage, double layer_distance = 0, double damping_over_step = 0) {
    potential.begin_step(active, x, {shrinkage, layer_distance, stiffness, ones, damping_over_step});
  }
  double energy() const {
    double sum = potential.value(x);
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
    return sum;
  }
  Eigen::Matrix3Xd gradient() const {
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, sheet.particles.owned);
    potential.add_gradient(x, result);
    return result;
  }

  Sheet sheet;
  std::vector<bool> none;
  std::vector<double> ones;
  ActiveSet active;
  Field x;
  BendingPotential potential;
  std::array<double, 2> stiffness;
};

TEST(BendingPotentialTest, ACylinderOfAnyDirectionHasTheEnergyOfAPlate) {
  for (const double aspect : {1.0, 2.0}) {
    Bent bent(flat_sheet(PETSC_COMM_WORLD, [&](double x, double y) { return Eigen::Vector3d(x, y / aspect, 0); }));
    double area = 0;
    for (const auto& s : bent.potential.stencils().stencils()) {
      area += s.centre < bent.sheet.particles.owned ? s.area : 0;
    }
    MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPI_DOUBLE, MPI_SUM, bent.sheet.comm());
    for (const double angle : {0.0, 0.3, M_PI / 4, 1.2, M_PI / 2}) {
      const double radius = 5;
      const Eigen::Vector3d along(std::cos(angle), std::sin(angle), 0);
      for (PetscInt i = 0; i < bent.sheet.particles.local(); ++i) {
        const Eigen::Vector3d r = bent.sheet.rest.col(i);
        const double s = along.dot(r);
        bent.x.vector(i) = r + (radius * std::sin(s / radius) - s) * along +
                           radius * (1 - std::cos(s / radius)) * Eigen::Vector3d::UnitZ();
      }
      EXPECT_NEAR(bent.energy(), 2 * area / (2 * radius * radius), 1e-3 * area / (radius * radius)) << angle;
    }
  }
}

TEST(BendingPotentialTest, AStripOfAnyWidthResistsFoldsBackAndForth) {
  const double height = 1e-3;
  const double edge = 0.1;
  for (const int width : {1, 2, 3, 8}) {
    Bent bent(one_surface(PETSC_COMM_WORLD, grid_mesh(60, width, edge)));
    for (PetscInt i = 0; i < bent.sheet.particles.local(); ++i) {
      if (!bent.sheet.is_lattice[i]) {
        const auto column = std::lround(bent.sheet.rest(0, i) / edge);
        bent.x.vector(i).z() += column % 2 == 0 ? height : -height;
      }
    }
    // Each cell is tilted by 2 h / a, against the next: folds of 4 h / a, curvatures of 4 h / a^2.
    const double curvature = 4 * height / (edge * edge);
    const double area = 60 * width * edge * edge;
    EXPECT_GT(bent.energy(), 0.6 * 2 * area * curvature * curvature / 2) << width;
  }
}

TEST(BendingPotentialTest, BesideDeadCellsIsAnEdge) {
  Bent whole(one_surface(PETSC_COMM_WORLD, grid_mesh(8, 5, 0.1)));
  Bent rest(one_surface(PETSC_COMM_WORLD, grid_mesh(6, 5, 0.1)));
  for (std::size_t cell = 0; cell < whole.sheet.cells.size(); ++cell) {
    if (whole.sheet.rest(0, whole.sheet.lattice[cell]) > 0.6) {
      std::fill_n(whole.active.triangles.begin() + static_cast<std::ptrdiff_t>(4 * cell), 4, false);
    }
  }
  for (Bent* bent : {&whole, &rest}) {
    for (PetscInt i = 0; i < bent->sheet.particles.local(); ++i) {
      const Eigen::Vector3d r = bent->sheet.rest.col(i);
      bent->x.vector(i).z() = 0.01 * std::sin(40 * r.x()) * std::cos(30 * r.y());
    }
    bent->begin(bent->ones);
  }
  EXPECT_GT(rest.energy(), 1e-3);
  EXPECT_NEAR(whole.energy(), rest.energy(), 1e-12 * rest.energy());
}

TEST(BendingPotentialTest, NothingActsOnADeadCell) {
  Bent bent(one_surface(PETSC_COMM_SELF, grid_mesh(5, 5, 0.1)));
  constexpr std::size_t middle = 12;
  std::fill_n(bent.active.triangles.begin() + 4 * middle, 4, false);
  std::vector<double> uneven = bent.ones;  // Without moments no normal is needed.
  for (std::size_t i = 0; i < uneven.size(); ++i) {
    uneven[i] = bent.sheet.is_lattice[i] ? 0.9 : 1;
  }
  bent.begin(uneven, 0.01);
  bent.x.values().row(2) = (7 * bent.sheet.rest.row(0) + 5 * bent.sheet.rest.row(1)).array().sin() / 50;
  const Eigen::Matrix3Xd gradient = bent.gradient();
  EXPECT_EQ(gradient.col(bent.sheet.lattice[middle]).norm(), 0);
  EXPECT_GT(gradient.col(bent.sheet.lattice[middle - 1]).norm(), 1e-3);
}

TEST(BendingPotentialTest, TheGradientIsTheDerivativeOfTheEnergy) {
  Bent bent(flat_sheet(PETSC_COMM_SELF,
                       [](double x, double y) {
                         return Eigen::Vector3d(x + 0.02 * std::sin(9 * y), y,
                                                0.05 * std::sin(3 * x) * std::cos(2 * y));
                       }),
            {2, 3});
  for (PetscInt i = 0; i < bent.sheet.particles.local(); ++i) {
    const auto id = static_cast<double>(bent.sheet.persistent_id[i]);
    bent.x.vector(i) += 0.01 * Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
  }
  bent.begin(std::vector<double>(bent.ones.size(), 0.9), 0.01, 3);
  bent.x.values() += 0.003 * bent.x.values().cwiseAbs();
  const Eigen::Matrix3Xd gradient = bent.gradient();
  const double scale = gradient.cwiseAbs().maxCoeff();
  for (PetscInt i = 0; i < bent.sheet.particles.owned; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double h = 1e-6;
      double& value = bent.x.data()[3 * i + k];
      const double here = value;
      value = here + h;
      const double above = bent.energy();
      value = here - h;
      const double below = bent.energy();
      value = here;
      ASSERT_NEAR((above - below) / (2 * h), gradient(k, i), 1e-6 * scale) << i << " " << k;
    }
  }
}

TEST(BendingPotentialTest, ViscosityResistsChangesOfCurvatureAlone) {
  const auto flat = [](double x, double y) { return Eigen::Vector3d(x, y, 0); };
  Bent elastic(flat_sheet(PETSC_COMM_WORLD, flat));
  Bent viscous(flat_sheet(PETSC_COMM_WORLD, flat));
  viscous.begin(viscous.ones, 0, 50);
  const auto move = [&](const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& place) {
    for (Bent* bent : {&elastic, &viscous}) {
      for (PetscInt i = 0; i < bent->sheet.particles.local(); ++i) {
        bent->x.vector(i) = place(bent->sheet.rest.col(i));
      }
    }
  };
  move([](const Eigen::Vector3d& r) {
    return Eigen::Vector3d(r.x() + 0.02 * std::sin(9 * r.x()), r.y() + 0.03 * std::sin(7 * r.x()), 0);
  });
  EXPECT_NEAR(viscous.energy(), elastic.energy(), 1e-12 * elastic.energy()) << "uneven strain";
  EXPECT_GT(elastic.energy(), 1e-3);
  move([](const Eigen::Vector3d& r) { return Eigen::Vector3d(r.x(), r.y(), 0.1 * r.x() * r.y()); });
  EXPECT_NEAR(viscous.energy(), 51 * elastic.energy(), 1e-9 * viscous.energy()) << "curvature";
}

/// How the gradient of a wavy sheet changes with its positions, which move by `by`.
struct Change {
  Eigen::Matrix3Xd by;
  Eigen::Matrix3Xd gradient;
  Eigen::Matrix3Xd product;    ///< of the Hessian with `by`
  Eigen::Matrix3Xd by_blocks;  ///< the same from its blocks
};

/// @param height of the waves at the start of the step, from which viscosity is measured
/// @param damping_over_step see BendingPotential::Input
Change change_of_a_wavy_sheet(double height, double damping_over_step) {
  // The undeformed sheet is flat: the energy is quadratic.
  Bent bent(flat_sheet(PETSC_COMM_SELF, [](double x, double y) { return Eigen::Vector3d(x, y, 0); }), {2, 3});
  for (PetscInt i = 0; i < bent.sheet.particles.local(); ++i) {
    bent.x.vector(i).z() = height * std::sin(3 * bent.x.vector(i).x());
  }
  bent.begin(bent.ones, 0, damping_over_step);
  const Eigen::Matrix3Xd before = bent.gradient();
  const PetscInt count = bent.sheet.particles.local();
  Change change{Eigen::Matrix3Xd(3, count), {}, {}, Eigen::Matrix3Xd::Zero(3, count)};
  for (PetscInt i = 0; i < count; ++i) {
    const auto id = static_cast<double>(bent.sheet.persistent_id[i]);
    change.by.col(i) = Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
  }
  bent.potential.update_hessian(bent.x, Curvature::psd);
  change.product = product_of(bent.potential, count, change.by);
  const std::vector<VertexPair> pattern = bent.potential.pattern();
  struct Sums : HessianBlocks {
    explicit Sums(std::size_t pairs) : of_pair(pairs, Eigen::Matrix3d::Zero()) {}
    void add(std::size_t pair, const Eigen::Matrix3d& block) const override { of_pair[pair] += block; }
    mutable std::vector<Eigen::Matrix3d> of_pair;
  };
  const Sums blocks(pattern.size());
  bent.potential.add_hessian(blocks);
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    change.by_blocks.col(pattern[k].row) += blocks.of_pair[k] * change.by.col(pattern[k].column);
  }
  bent.x.values() += change.by;
  change.gradient = bent.gradient() - before;
  return change;
}

TEST(BendingPotentialTest, ProductsWithTheHessianAreChangesOfTheGradient) {
  for (const double damping_over_step : {0.0, 0.5, 7.0}) {
    const Change change = change_of_a_wavy_sheet(0, damping_over_step);
    EXPECT_LT((change.product - change.gradient).norm(), 1e-10 * change.gradient.norm());
    EXPECT_LT((change.by_blocks - change.gradient).norm(), 1e-10 * change.gradient.norm());
  }
}

TEST(BendingPotentialTest, ViscosityOfABentSheetActsAlongNormalsOfItsParticles) {
  // Normals of neighbours differ by up to 5 degrees; viscosity in all directions would make the product 2.4 times as
  // long.
  const Change change = change_of_a_wavy_sheet(0.1, 7);
  EXPECT_LT((change.product - change.gradient).norm(), 0.03 * change.gradient.norm());
  EXPECT_LT((change.by_blocks - change.product).norm(), 1e-10 * change.product.norm());
}

/// The gradient of a crumpled sheet by persistent id, and a product with its Hessian.
std::map<PetscInt, std::array<Eigen::Vector3d, 2>> gradient_and_product(MPI_Comm comm) {
  Bent bent(flat_sheet(comm, [](double x, double y) { return Eigen::Vector3d(x, y + 0.02 * std::sin(9 * x), 0); }));
  Eigen::Matrix3Xd w(3, bent.sheet.particles.local());
  for (PetscInt i = 0; i < bent.sheet.particles.local(); ++i) {
    const auto id = static_cast<double>(bent.sheet.persistent_id[i]);
    w.col(i) = Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
    bent.x.vector(i) += 0.01 * w.col(i);
  }
  bent.begin(bent.ones, 0, 0.5);
  const Eigen::Matrix3Xd gradient = bent.gradient();
  bent.potential.update_hessian(bent.x, Curvature::psd);
  const Eigen::Matrix3Xd product = product_of(bent.potential, bent.sheet.particles.owned, w);
  std::map<PetscInt, std::array<Eigen::Vector3d, 2>> result;
  for (PetscInt i = 0; i < bent.sheet.particles.owned; ++i) {
    result[bent.sheet.persistent_id[i]] = {gradient.col(i), product.col(i)};
  }
  return result;
}

TEST(BendingPotentialTest, AnyNumberOfRanksGivesTheSameForces) {
  const auto alone = gradient_and_product(PETSC_COMM_SELF);
  for (const auto& [id, vectors] : gradient_and_product(PETSC_COMM_WORLD)) {
    for (std::size_t k = 0; k < 2; ++k) {
      ASSERT_LT((vectors[k] - alone.at(id)[k]).norm(), 1e-9 * (1 + alone.at(id)[k].norm())) << id << " " << k;
    }
  }
}

}  // namespace
}  // namespace pellicle
