#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "energies/newton_options.h"

namespace pellicle::elastic {

/// Stiffness of a sheet as a material. Values that are not given follow from Young's modulus, Poisson's ratio and the
/// physical thickness, or else have defaults (stiffness_of).
struct SheetMaterial {
  std::optional<double> tensile_stiffness;  ///< of a strip along the warp, force per width and strain [N/m]
  std::optional<double> shear_stiffness;    ///< [N/m]
  std::optional<double> bending_stiffness;  ///< moment per width and curvature, along the warp [N m]
  std::optional<double> weft_tensile_stiffness;
  std::optional<double> weft_bending_stiffness;
  std::optional<double> young_modulus;  ///< E [Pa]
  double poisson_ratio = 1.0 / 3;
  std::optional<double> physical_thickness;         ///< h of the material [m]
  Eigen::Vector3d warp = Eigen::Vector3d::UnitX();  ///< direction of the warp, laid on the undeformed surface
  std::string tensile_texture;
  std::string shear_texture;
  std::string bending_texture;
  std::vector<double> stiffness_range{0, 1};  ///< factors where these textures are black and white
  double damping = 1e-3;                      ///< viscosity over stiffness [s]
};

void describe(OptionTable& table, SheetMaterial& options);

/// Stiffnesses along the warp and the weft.
struct Stiffness {
  std::array<double, 2> tensile{};  ///< [N/m]
  double shear = 0;                 ///< [N/m]
  std::array<double, 2> bending{};  ///< [N m]
};

/// All stiffnesses that the options give or imply.
/// @throws Error when a modulus is given without a thickness or the other way round, or the warp has no direction
Stiffness stiffness_of(const SheetMaterial& options);

/// Options of the balance of an elastic sheet in a step.
struct ElasticOptions : NewtonOptions {
  ElasticOptions() {
    solver_prefix = "elastic_";
    max_iterations = 50;  // and again if a strain limit needs another round
    snes_rtol = 1e-2;
    ksp_rtol = 1e-2;
    mat_type = TangentMatrix::shell;
    factor = TangentFactorisation::never;
    patch_size = 64;
    far = FarTangent::positive;
  }

  /// Residual over the largest force at which a step has converged, that is snes_rtol; none: by the time scheme.
  std::optional<double> newton_tolerance;
  double usual_h = 2e-3;  ///< usual length of a step, by which the preconditioner is chosen [s]
  /// Limit on the strain of the weave's springs at the end of a step; the deck's `project.strain_limit`.
  std::optional<double> strain_limit;
};

void describe(OptionTable& table, ElasticOptions& options);
/// Declares the options that also act on the contact of sheets of other dynamics.
void describe_balance(OptionTable& table, ElasticOptions& options);

/// The mass-spring sheet with which projection is compared (burning paper, section 8), and options of its balance in a
/// step.
struct SpringOptions : NewtonOptions {
  SpringOptions() {
    solver_prefix = "spring_";
    newton = NewtonEnd::fixed;
    max_iterations = 10;
    ksp_rtol = 1e-6;
    factor = TangentFactorisation::never;
    far = FarTangent::positive;
  }

  double stiffness = 100;  ///< k of every spring [N/m]
  double damping = 0;      ///< c/k of the dashpot beside every spring [s]
  /// Update at which Newton's method ends, over the mean spring length; the remaining forces are about its square times
  /// k times this length.
  double newton_tolerance = 1e-4;
};

void describe(OptionTable& table, SpringOptions& options);

}  // namespace pellicle::elastic
