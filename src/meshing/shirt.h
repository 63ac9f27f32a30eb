#pragma once

#include <array>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// A T-shirt of quads: a front and a back in the shape of a T, sewn together along the sides, the shoulders and the
/// sleeves, open at waist, cuffs and neck. It stands round the origin, z upwards, its front towards -y, and faces
/// outward. Most of the torso and of the sleeves are elliptic tubes; between them, the shoulder seams and the neckline
/// lies a thin plate: the sum of squares of the points' umbrella vectors (sum of x_j - x_i over the neighbours j) is
/// least. Edges differ most where the neckline turns: by a factor of 2.7 at 60 x 78 cells of equal sides.
///
/// Points have 3 edges at the openings, 4 elsewhere (and where the neckline turns down), 6 in the armpits.
/// Texture coordinates: the cut laid flat, the front in the left half of the texture and the back, as it is seen from
/// behind, in the right half; along a seam they belong to face corners. Point groups "waist", "cuffs", "neck" (the
/// openings) and "shoulders" (the seams from the neck to the sleeves). Points and faces are numbered row by row upwards
/// from the waist, those of the front (with the seams) first. Not collective.
/// @param cells across the torso, and from waist to shoulder
/// @param size of the torso laid flat: its width, which is half its girth, and height from waist to shoulder [m]
/// @throws Error unless there are at least 8 cells each way and sizes are above 0.
SurfaceMesh shirt_mesh(std::array<int, 2> cells, std::array<double, 2> size);

}  // namespace meshing
}  // namespace pellicle
