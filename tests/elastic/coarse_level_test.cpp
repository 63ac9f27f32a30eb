// The coarse level of rigid patches, which is summed up term by term, is that of the sheet's tangent.

#include <gtest/gtest.h>
#include <petscksp.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "base/error.h"
#include "elastic/bending_potential.h"
#include "elastic/spring_potential.h"
#include "energies/rigid_patches.h"
#include "energies/tangent.h"
#include "energies/vertex_potential.h"
#include "linear/ksp.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/undeformed_springs.h"

namespace pellicle::coarse_level_test {
namespace {

/// A spring between the first and the last particle of rank 0, as contact couples particles: only when they touch.
class Tie : public Potential {
 public:
  explicit Tie(const Layout& vertices) : vertices_(vertices) {}
  void tighten() { is_tight_ = vertices_.first == 0 && vertices_.owned > 1; }

  double value(const Field& /*x*/) const override { return 0; }
  void add_gradient(const Field& /*x*/, Eigen::Matrix3Xd& /*gradient*/) const override {}
  std::vector<VertexPair> pattern() const override {
    const PetscInt last = vertices_.owned - 1;
    return last < 1 ? std::vector<VertexPair>() : std::vector<VertexPair>{{0, 0}, {0, last}, {last, 0}, {last, last}};
  }
  void update_hessian(const Field& /*x*/, double /*psd_blend*/) override {}
  void add_hessian(const HessianBlocks& /*blocks*/) const override {}
  bool has_terms() const override { return true; }
  void visit(HessianTerms& terms) const override {
    if (is_tight_) {
      terms.add_differences({{0, vertices_.owned - 1, {3, -2, 1}, 0.5}});
    }
  }

 private:
  const Layout& vertices_;
  bool is_tight_ = false;
};

/// The tangent of a crumpled sheet that is clamped along x = 0 and slides along a line at some particles.
class Crumpled {
 public:
  Crumpled()
      : sheet_(make_sheet(PETSC_COMM_WORLD, grid_mesh(11, 8, 0.1), one_surface())),
        clamped_(at_clamp(sheet_)),
        x(sheet_.particles, 3),
        springs_(sheet_),
        bending_(sheet_, Eigen::Vector3d::UnitX(), clamped_),
        inertia_(make_vertex_potential(
            sheet_.particles,
            [](PetscInt i, const Eigen::Vector3d&) {
              return PointPotential{0, Eigen::Vector3d::Zero(), (2.0 + i % 2) * Eigen::Matrix3d::Identity()};
            })),
        tie(sheet_.particles) {
    x.values() = sheet_.rest;
    projectors = Projectors(static_cast<std::size_t>(sheet_.particles.local()));
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      const auto id = static_cast<double>(sheet_.persistent_id[i]);
      x.vector(i) += 0.02 * Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
      if (clamped_[i]) {
        projectors.bind(static_cast<std::size_t>(i), Eigen::Matrix3d::Zero());
      } else if (sheet_.persistent_id[i] % 13 == 0) {
        const Eigen::Vector3d along = Eigen::Vector3d(1, 2, 3).normalized();
        projectors.bind(static_cast<std::size_t>(i), along * along.transpose());
      }
    }
    const ActiveSet active(sheet_);
    const std::vector<double> ones(projectors.size(), 1);
    const Stiffness stiffness = stiffness_of({});
    SheetSprings material(sheet_, stiffness, Eigen::Vector3d::UnitX(), {});
    springs_.set(undeformed_springs(sheet_, material.stiffness(active)));
    Field start(sheet_.particles, 3);
    start.values() = sheet_.rest;
    start.values().row(2) = 0.1 * (5 * sheet_.rest.row(0)).array().sin();  // Normals differ.
    constexpr double viscosity = 3;
    bending_.begin_step(active, start, {ones, 0, {1, 2}, ones, viscosity});
    tangent.emplace(sheet_.particles, std::vector<Potential*>{&springs_, &bending_, inertia_.get(), &tie}, projectors,
                    TangentMatrix::shell, "");
    tangent->update(x, Curvature::psd);
  }

  const std::vector<std::array<PetscInt, 3>>& triangles() const { return sheet_.triangles; }

 private:
  static SheetOptions one_surface() {
    SheetOptions options;
    options.is_one_surface = true;
    return options;
  }
  static std::vector<bool> at_clamp(const Sheet& sheet) {
    std::vector<bool> clamped;
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      clamped.push_back(sheet.rest(0, i) < 0.01);
    }
    return clamped;
  }

  Sheet sheet_;
  std::vector<bool> clamped_;

 public:
  Field x;
  Projectors projectors;
  std::optional<Tangent> tangent;

 private:
  SpringPotential springs_;
  BendingPotential bending_;
  std::unique_ptr<Potential> inertia_;

 public:
  Tie tie;
};

/// The matrix of the coarse level of a solver, times motions of the patches, is what the tangent makes of them.
void expect_the_tangent(const KspHandle& solver, const Mat fine) {
  PC pc = nullptr;
  KSP coarse_solver = nullptr;
  Mat interpolation = nullptr;
  Mat coarse = nullptr;
  check(KSPGetPC(solver, &pc));
  check(PCMGGetCoarseSolve(pc, &coarse_solver));
  check(PCMGGetInterpolation(pc, 1, &interpolation));
  check(KSPGetOperators(coarse_solver, &coarse, nullptr));
  VecHandle motion;
  VecHandle force;
  VecHandle wanted;
  VecHandle moved;
  VecHandle product;
  check(MatCreateVecs(interpolation, motion.create(), moved.create()));
  check(VecDuplicate(motion, force.create()));
  check(VecDuplicate(motion, wanted.create()));
  check(VecDuplicate(moved, product.create()));
  PetscInt first = 0;
  PetscInt last = 0;
  check(VecGetOwnershipRange(motion, &first, &last));
  for (int k = 0; k < 5; ++k) {
    for (PetscInt i = first; i < last; ++i) {
      check(VecSetValue(motion, i, std::sin(3.7 * i + k), INSERT_VALUES));
    }
    check(VecAssemblyBegin(motion));
    check(VecAssemblyEnd(motion));
    check(MatMult(coarse, motion, force));
    check(MatMult(interpolation, motion, moved));
    check(MatMult(fine, moved, product));
    check(MatMultTranspose(interpolation, product, wanted));
    double size = 0;
    double error = 0;
    check(VecNorm(wanted, NORM_2, &size));
    check(VecAXPY(force, -1, wanted));
    check(VecNorm(force, NORM_2, &error));
    EXPECT_GT(size, 1);
    EXPECT_LT(error, 1e-10 * size);
  }
}

// The second comparison is made when only one rank has couplings that it did not have before.
TEST(CoarseLevel, IsTheTangentBetweenMotionsOfPatches) {
  Crumpled sheet;
  KspDefaults defaults;
  defaults.preconditioner = PCMG;
  const Mat fine = sheet.tangent->matrix();
  const KspHandle solver = make_ksp(fine, fine, "coarse_level_test_", defaults);
  RigidPatches patches(solver, *sheet.tangent, sheet.triangles(), 20);
  patches.refresh(sheet.x);
  expect_the_tangent(solver, fine);
  sheet.tie.tighten();
  sheet.tangent->update(sheet.x, Curvature::psd);
  patches.refresh(sheet.x);
  expect_the_tangent(solver, fine);
}

}  // namespace
}  // namespace pellicle::coarse_level_test
