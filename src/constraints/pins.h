#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "constraints/selection.h"
#include "options/options.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::constraints {

/// Held particles in a deck, one of the named objects `pins`.
struct PinOptions : SelectionOptions {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Rows path;                                           ///< time [s], displacement [m]
  bool clamped = false;  ///< whether the sheet's direction at its edge is constrained, too
  /// Displacement [m] at a time [s] that a program prescribes in place of path and velocity; empty: these count.
  /// Attachments ignore it.
  std::function<Eigen::Vector3d(double time)> motion;

  /// Whether pinned particles are led away from their undeformed places.
  bool moves() const { return motion || !path.empty() || velocity != Eigen::Vector3d::Zero(); }
};

void describe(OptionTable& table, PinOptions& options);

/// @throws Error that begins with the key, "pins.hook", if the motion is invalid
void require_motion(const std::string& key, const PinOptions& options);

/// Held particles with their places at each time: the undeformed ones, displaced without rotation.
class Pins {
 public:
  /// Collective. The points must outlive the pins.
  /// @throws Error that names the pin and the key: a selector that selects nothing, a particle in two pins, a bad path
  Pins(const Surface& points, const std::map<std::string, PinOptions>& options);

  /// Restores pins from their numbers. The points must outlive the pins. Not collective.
  /// @param numbers pin of each local particle, as returned by `numbers`
  /// @throws Error on a bad path
  Pins(const Surface& points, const std::map<std::string, PinOptions>& options, const std::vector<PetscInt>& numbers);

  /// Number of the pin of each local particle; -1: none.
  std::vector<PetscInt> numbers() const;

  /// Whether each local particle, ghosts included, is pinned.
  const std::vector<bool>& pinned() const { return pinned_; }

  /// For each local particle, ghosts included, whether its tangent plane is constrained as well.
  std::vector<bool> clamped() const;

  /// Sets the positions of pinned local particles, ghosts included, at `time` [s]. Not collective.
  /// @param positions [m]
  void impose(Field& positions, double time) const;

 private:
  struct Pin {
    Eigen::Vector3d velocity;
    Rows path;
    std::function<Eigen::Vector3d(double)> motion;
    bool is_clamp;
    std::vector<PetscInt> particles;  ///< local numbers, ghosts included
  };

  const Surface* points_;
  std::vector<Pin> pins_;
  std::vector<bool> pinned_;
};

}  // namespace pellicle::constraints
