#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "options/options.h"

namespace pellicle::heat {

/// ball: what is near a moving centre, which is drawn as a sphere; texture: an image on the surface.
enum class SourceShape { ball, texture };
inline std::vector<std::string> names_of(SourceShape) { return {"ball", "texture"}; }

/// One external heat source: a moving hot ball or a heat texture (burning paper, section 5).
struct HeatSource {
  Choice<SourceShape> shape = SourceShape::ball;
  double temperature = 1000;                           ///< [K]
  double rate = 20;                                    ///< of the exchange [1/s]
  double start_time = 0;                               ///< at which it begins to heat [s]
  std::optional<double> end_time;                      ///< at which it heats no more; none: never ends [s]
  double radius = 0.2;                                 ///< of a ball [m]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();    ///< of a ball at time 0 [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of a ball [m/s]
  Rows path;         ///< key points time, x, y, z of a ball; replaces centre and velocity
  std::string file;  ///< image of a texture; white takes the whole rate, black none

  /// Centre of a ball: linear between the key points, at rest before the first and after the last one.
  Eigen::Vector3d centre_at(double time) const;
};

/// Declares the options of one source.
void describe(OptionTable& table, HeatSource& source);

/// Checks the options of a source. @throws Error that names the source, if a texture has no file, or a path whose times
/// do not increase
void validate(const std::string& name, const HeatSource& source);

/// Discrete Laplacian of the conduction. umbrella: eq. 3 as printed.
enum class HeatOperator { consistent, umbrella };
inline std::vector<std::string> names_of(HeatOperator) { return {"consistent", "umbrella"}; }

/// automatic: shell, unless the options of the solver ask for entries of the matrix.
enum class HeatMatrix { automatic, aij, shell };
inline std::vector<std::string> names_of(HeatMatrix) { return {"auto", "aij", "shell"}; }

/// Heat of a surface (burning paper, section 5).
struct HeatOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix = "heat_";
  double initial_temperature = 300;  ///< of every particle [K]
  Choice<HeatOperator> operator_name = HeatOperator::consistent;
  double diffusivity = 2e-3;        ///< alpha [m^2/s]
  std::string diffusivity_texture;  ///< file of an image that weights alpha by particle; none when empty
  std::vector<double> diffusivity_range{0.2, 1.8};  ///< factors on alpha at black and at white
  double burning_heat = 300;                        ///< eta: rise per unit of lost mass fraction [K]
  double capacity = 1340;                           ///< c [J/(kg K)]
  double ambient_temperature = 300;                 ///< [K]
  double convection = 0;                            ///< h_c, on each side [W/(m^2 K)]
  double emissivity = 0;                            ///< epsilon, on each side
  double ksp_rtol = 1e-8;                           ///< relative to the norm of the right-hand side
  Choice<HeatMatrix> mat_type = HeatMatrix::automatic;
  std::map<std::string, HeatSource> sources;  ///< by name
};

/// Declares the options `heat.*`, the objects `heat.sources` and the solver prefix `heat_`.
void describe(OptionTable& table, HeatOptions& options);

}  // namespace pellicle::heat
