#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/choice.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace base {
class OptionTable;
}  // namespace base
inline namespace elastic {

/// Stiffness of a sheet as a material. What is not given follows from Young's modulus, Poisson's ratio and the physical
/// thickness, if these are given, and has its default otherwise (stiffness_of).
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

/// How the implicit step of the elastic sheet is solved.
struct ElasticOptions {
  /// Prefix of PETSc's options for this solver; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix = "elastic_";
  int newton_iterations = 50;      ///< at most, and again where a strain limit needs another try
  double newton_tolerance = 1e-2;  ///< residual at which Newton's method ends, over the largest norm of a kind of force
  Choice<TangentMatrix> mat_type = TangentMatrix::shell;
  int patch_size = 64;    ///< of the preconditioner, see RigidPatches
  double usual_h = 2e-3;  ///< of most steps, by which the preconditioner is chosen [s]
  /// Limit on the strain of the net's springs at the end of a step; the deck's `project.strain_limit`.
  std::optional<double> strain_limit;
};

void describe(OptionTable& table, ElasticOptions& options);
/// Those of them that are also for the contact of a sheet of other dynamics.
void describe_balance(OptionTable& table, ElasticOptions& options);

}  // namespace elastic
}  // namespace pellicle
