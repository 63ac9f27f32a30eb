#pragma once

#include <array>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

// Open meshes and a torus, with texture coordinates; of quads unless they say triangles. All lie round the origin;
// points and faces are numbered row by row, the first direction fastest; faces are oriented alike. Not collective.

/// A rectangle in the x-y plane with normal +z: `cells` along x and y, `size` [m]. Texture coordinates are (0, 0) at
/// the corner of smallest x and y and (1, 1) at the opposite one. Point groups "left", "right" (along x), "bottom",
/// "top" (along y). @throws Error unless there are cells and sizes are above 0.
SurfaceMesh rectangle_mesh(std::array<int, 2> cells, std::array<double, 2> size);

/// A torus round the z axis with normals outward: `cells` round the axis and round the tube, radii [m]. Texture
/// coordinates grow from 0 to 1 in both directions, with a seam: they belong to face corners.
/// @throws Error unless there are at least 3 cells each way and 0 < tube radius < major radius.
SurfaceMesh torus_mesh(std::array<int, 2> cells, double major_radius, double tube_radius);

/// A rectangle bent upwards to an arch over the y direction (a barrel roof, ridge along x), isometric to the flat
/// `size` [m] (length, arc length), `arch` the angle of the arc [rad]. The quads stand on their points: a lattice of
/// `cells` (columns, rows) turned by 45 degrees, with the cells between, so that the boundary is a zigzag of points of
/// 2 edges and of 4; the four corner quads are left out, which gives points of 3. Faces: 2 n m - n - m - 3.
/// The centre of curvature is on the x axis; normals point away from it. Texture coordinates as for the rectangle,
/// along the arc, and so are the groups, of the teeth. @throws Error unless both cells are at least 2, sizes above 0
/// and 0 < arch < 2 pi.
SurfaceMesh roof_mesh(std::array<int, 2> cells, std::array<double, 2> size, double arch);

/// A flat disc of triangles in the x-y plane with normal +z: `rings` of triangles round its centre, ring k with 6 k
/// points of equal distance at its outside, 1 + 3 n (n + 1) points in all, numbered outwards. Texture coordinates are
/// those of the square round it. Point groups "centre" and "rim". @throws Error unless rings and radius [m] are above
/// 0.
SurfaceMesh disc_mesh(int rings, double radius);

/// A flat rectangle of triangles in the x-y plane with normal +z, a corner at the origin and x, y >= 0: `cells` along x
/// and y, each cut by both its diagonals (a criss-cross mesh, the same in every mirror), `size` [m]. Points of the
/// cells' corners come first, then those of their middles. Texture coordinates and groups as for the rectangle.
/// @throws Error unless there are cells and sizes are above 0.
SurfaceMesh square_mesh(std::array<int, 2> cells, std::array<double, 2> size);

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

}  // namespace pellicle::meshing
