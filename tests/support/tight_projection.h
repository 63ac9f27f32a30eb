#pragma once

#include <string>

namespace pellicle {

/// The projection and the frames of small scenes, as the end of a deck. Inner tolerances leave no noise for buckling to
/// amplify.
inline const std::string tight_projection = R"(
dynamics: projection
project:
  weight_red: 0.5
  weight_green: 0.5
  weight_blue: 0.5
  weight_yellow: 0.5
  shift: 1e-2
  ksp_rtol: 1e-12
output:
  directory: out
  name: scene
)";

}  // namespace pellicle
