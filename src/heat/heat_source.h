#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "options/options.h"
#include "parallel/field.h"
#include "surface/surface.h"

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

/// Data of a step for heat sources, with ghosts up to date.
struct HeatSourceInput {
  const Surface& surface;
  const Field& positions;              ///< at the start of the step [m]
  const Field& mass;                   ///< [kg]
  const std::vector<double>& texture;  ///< value in [0, 1] at each local particle, of a texture
  double time = 0;                     ///< start of the step [s]
  double time_step = 0;                ///< h [s]
  double capacity = 0;                 ///< c [J/(kg K)]
};

/// One step of exchange with an active source, T^ext of eq. 1: T += f max(T_source - T, 0). The fraction f of a ball is
/// (1 - exp(-rate h)) (1 - (r/R)^2)^2 at distance r < R of its centre at the start of the step; that of a texture with
/// value v is 1 - exp(-rate v h). Particles of mass 0 have been removed. Not collective: ghosts are heated alike.
/// @returns the heat added to the owned particles [J].
double apply_heat_source(Field& temperature, const HeatSource& source, const HeatSourceInput& input);

}  // namespace pellicle::heat
