#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"
#include "options/choice.h"

namespace pellicle::meshing {

enum class BlobShape { sphere, ellipsoid, box, capsule, cylinder, torus };
inline std::vector<std::string> names_of(BlobShape) {
  return {"sphere", "ellipsoid", "box", "capsule", "cylinder", "torus"};
}

enum class BlobOperation { add, subtract };
inline std::vector<std::string> names_of(BlobOperation) { return {"add", "subtract"}; }

/// A solid of a closed surface in a deck, one of the named objects `mesh.blobs`.
struct BlobOptions {
  Choice<BlobShape> shape = BlobShape::sphere;
  Choice<BlobOperation> operation = BlobOperation::add;
  Eigen::Vector3d centre{0, 0, 0};         ///< of capsule and cylinder: of the first end [m]
  double radius = 0.02;                    ///< of the torus: of the circle in the middle of its tube [m]
  Eigen::Vector3d end{0, 0, 0.05};         ///< of capsule and cylinder: centre of the other end [m]
  std::optional<double> end_radius;        ///< of the capsule, at `end` [m]; none: `radius`
  double tube_radius = 0.01;               ///< of the torus [m]
  Eigen::Vector3d size{0.05, 0.05, 0.05};  ///< of box and ellipsoid along their own axes [m]
  /// Rotation of box, ellipsoid and torus about x, y, z through the centre, in this order [rad].
  Eigen::Vector3d rotation{0, 0, 0};
  double round = 0;     ///< radius of the edges of box and cylinder [m]
  double blend = 5e-3;  ///< radius of the fillet with other solids at a right angle [m]
  double relief = 0;    ///< height of the waves on the surface [m]
  int flutes = 0;       ///< number of waves round the axis
  double pitch = 0;     ///< length of a wave along the axis; 0: none [m]
};

void describe(OptionTable& table, BlobOptions& options);

/// The rotation by these angles about the axes x, y and z, in this order [rad].
Eigen::Matrix3d rotation_about_axes(const Eigen::Vector3d& angles);

/// The smooth union of solids, less other solids, as a function of the point: below 0 inside.
///
/// With the distance d_i of each added solid and k_i proportional to its blend, the surface of the union is where the
/// sum over i of exp(-d_i / k_i) is 1: the same in any order, exactly the solid's own surface far from the others, and
/// a fillet where two meet. Subtracted solids are blended in the same way, one after another by name.
class Blobs {
 public:
  /// @throws Error in one line that names the object's key, if no solid is added or the data of one are invalid.
  explicit Blobs(const std::map<std::string, BlobOptions>& options);

  /// Value of the function; near the surface about the distance from it [m].
  double operator()(const Eigen::Vector3d& point) const;

  /// The first subtracted solid by name that reaches none of some points of the surface; empty if there is none.
  std::string idle_cut(const std::vector<Eigen::Vector3d>& surface_points) const;

  /// A box that holds the whole surface.
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  struct Solid {
    std::string name;
    BlobOptions options;
    Eigen::Matrix3d to_own;  ///< turns a vector from the centre to the solid's own axes
    double length;           ///< from the centre to the other end [m]
    double k;                ///< width of the blend in the exponential [m]

    double distance(const Eigen::Vector3d& point) const;
    double distance_without_relief(const Eigen::Vector3d& own) const;
    double reach() const;
  };

  std::vector<Solid> added_;
  std::vector<Solid> subtracted_;
  Eigen::AlignedBox3d bounds_;
};

/// The surface of the blobs in well-shaped triangles, normals outward, with `vertices` points. Texture coordinates are
/// those of the bounding box seen along +y: x to the right, z up. Not collective.
/// @throws Error in one line that names the key: no objects, nothing left, too few vertices for the shape.
SurfaceMesh blobs_mesh(const std::map<std::string, BlobOptions>& blobs, int vertices);

}  // namespace pellicle::meshing
