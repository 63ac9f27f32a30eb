#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::surface {

/// The colours of the weave of a sheet: the springs along its cells, in both layers; in a sheet of one layer only the
/// blue ones act.
inline constexpr std::array<Colour, 2> weave_colours{Colour::green, Colour::blue};

/// Whether springs of a colour belong to the net.
inline bool is_of_weave(Colour colour) {
  return std::find(weave_colours.begin(), weave_colours.end(), colour) != weave_colours.end();
}

/// Strains d/l - 1 of springs of length d and target length l.
struct WeaveStrain {
  double largest = 0;                               ///< |d/l - 1| of the active springs of the weave
  Colour colour = Colour::blue;                     ///< of the spring with the largest strain
  std::array<PetscInt, 2> ids{-1, -1};              ///< persistent ids of this spring's ends; -1: no active spring
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< of this spring's middle [m]
  double mean = 0;                                  ///< of |d/l - 1| over load-bearing springs of all colours
  std::array<double, 4> largest_of{};               ///< of each colour; 0 where none lives or acts
  std::array<double, 4> rms_of{};                   ///< root mean square of each colour
};

/// Strains of a sheet; among equal largest strains that of the spring with the least ids. Collective.
/// @param x positions of the local particles [m]
/// @param target_length l of the local springs of each colour [m]
/// @param bears whether each owned spring of each colour, if it lives and acts, is in the mean
WeaveStrain weave_strain(const Sheet& sheet, const Field& x, const std::array<std::vector<double>, 4>& target_length,
                         const ActiveSet& active, const std::array<std::vector<bool>, 4>& bears);

/// Strains of a sheet, with all springs that live and act in the mean.
inline WeaveStrain weave_strain(const Sheet& sheet, const Field& x,
                                const std::array<std::vector<double>, 4>& target_length, const ActiveSet& active) {
  return weave_strain(sheet, x, target_length, active, active.springs);
}

/// "3.2 % at (0.1, 0.2, 0.3) m"
std::string words_of(double strain, const Eigen::Vector3d& place);

/// "the blue spring of particles 3 and 4 is strained by 3.2 % at (0.1, 0.2, 0.3) m, above project.strain_limit 0.01"
std::string beyond_limit(const WeaveStrain& strain, double limit);

}  // namespace pellicle::surface
