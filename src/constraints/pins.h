#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "base/options.h"
#include "constraints/selection.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace constraints {

/// Particles that are held, as a deck gives them: one of the named objects `pins`.
struct PinOptions : SelectionOptions {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Rows path;                                           ///< time [s], displacement [m]
  bool clamped = false;                                ///< the sheet's direction at its edge, too
};

void describe(OptionTable& table, PinOptions& options);

/// Which particles are held, and where they are at each time: their undeformed place, displaced without rotation.
class Pins {
 public:
  /// Collective. The points must outlive the pins.
  /// @throws Error that names the pin and the key: a selector that selects nothing, a particle in two pins, a bad path
  Pins(const Surface& points, const std::map<std::string, PinOptions>& options);

  /// Pins that have been chosen before. The points must outlive the pins. Not collective.
  /// @param numbers pin of each local particle, see numbers
  /// @throws Error on a bad path
  Pins(const Surface& points, const std::map<std::string, PinOptions>& options, const std::vector<PetscInt>& numbers);

  /// Number of the pin that holds each local particle, -1 where none does.
  std::vector<PetscInt> numbers() const;

  /// Of each local particle, ghosts included.
  const std::vector<bool>& pinned() const { return pinned_; }

  /// For each local particle, ghosts included, whether its tangent plane is held as well.
  std::vector<bool> clamped() const;

  /// Puts the pinned local particles, ghosts included, where they are at `time` [s]. Not collective.
  /// @param positions [m]
  void impose(Field& positions, double time) const;

 private:
  void add(const std::string& name, const PinOptions& options);
  void hold(const std::vector<PetscInt>& numbers);

  struct Pin {
    std::string name;
    Eigen::Vector3d velocity;
    Rows path;
    bool is_clamp;
    std::vector<PetscInt> particles;  ///< local numbers, ghosts included
  };

  const Surface* points_;
  std::vector<Pin> pins_;
  std::vector<bool> pinned_;
};

}  // namespace constraints
}  // namespace pellicle
