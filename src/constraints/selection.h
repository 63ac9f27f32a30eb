#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "options/options.h"
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

}  // namespace pellicle::constraints
