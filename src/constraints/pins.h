#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "options/options.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::constraints {

enum class Layer { corners, lattice, both };
inline std::vector<std::string> names_of(Layer) { return {"corners", "lattice", "both"}; }

/// Selection of particles in a deck, for pins, attachments and forces. Several selectors add up.
struct SelectionOptions {
  std::vector<std::string> corners;  ///< "all", or names such as "max_y" or "min_x_max_y"
  std::vector<double> box;           ///< two opposite points of a box in the undeformed mesh [m], or empty
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of a ball in the undeformed mesh [m]
  std::optional<double> radius;                      ///< of the ball [m]
  Choice<Layer> layer = Layer::both;                 ///< layer from which box and ball select
  std::vector<int> vertices;                         ///< persistent ids
  std::string group;                                 ///< of the mesh
};

void describe(OptionTable& table, SelectionOptions& options);

/// Whether each local particle, ghosts included, is selected. Collective.
/// @param key of the selecting object, "pins.hook"
/// @throws Error that names the key, the same on all ranks: a selector that selects nothing, or none given
std::vector<bool> select(const Surface& points, const std::string& key, const SelectionOptions& options);

/// The smallest box round the undeformed places of the chosen owned particles of all ranks [m]. Collective.
Eigen::AlignedBox3d bounding_box(const Surface& points, const std::vector<bool>& chosen);

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
  const std::vector<PetscInt>& numbers() const { return numbers_; }

  /// Whether each local particle, ghosts included, is pinned.
  const std::vector<bool>& pinned() const { return pinned_; }

  /// For each local particle, ghosts included, whether its tangent plane is constrained as well.
  std::vector<bool> clamped() const;

  /// Sets the positions of pinned local particles, ghosts included, at `time` [s]. Not collective.
  /// @param positions [m]
  void impose(Field& positions, double time) const;

 private:
  struct Pin {
    PinOptions options;
    std::vector<PetscInt> particles;  ///< local numbers, ghosts included
  };

  const Surface* points_;
  std::vector<Pin> pins_;
  std::vector<PetscInt> numbers_;
  std::vector<bool> pinned_;
};

}  // namespace pellicle::constraints
