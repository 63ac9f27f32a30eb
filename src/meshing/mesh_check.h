#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "meshing/overlaps.h"
#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

/// Properties of a mesh, and repairs.
struct MeshReport {
  std::string name;
  int points = 0;
  int faces = 0;
  int triangles = 0;
  int quads = 0;
  int edges = 0;
  int components = 0;  ///< pieces joined by common edges
  int boundary_edges = 0;
  int boundary_loops = 0;
  SelfIntersections intersections;  ///< with quads split in two
  int euler_characteristic() const { return points - edges + faces; }

  double area = 0;            ///< [m^2]
  double volume = 0;          ///< enclosed by a closed mesh (enclosed_volume) [m^3]
  double smallest_angle = 0;  ///< at a corner of a face [rad]
  int sharpest_face = 0;      ///< face with the smallest angle, by its number in the file
  double shortest_edge = 0;   ///< [m]
  double longest_edge = 0;    ///< [m]
  double rounding = 0;        ///< distance of the largest coordinate to the next number, over the mean side of faces
  /// Twice the radius of the inscribed circle over that of the circumscribed one: 1 for an equilateral triangle.
  double smallest_radius_ratio = 1;
  double mean_radius_ratio = 1;  ///< over the triangles
  std::map<int, int> valence;    ///< number of points by their number of edges

  /// Slits, where faces look joined and are not, with numbers of points in the file.
  Slits slits;
  NestedPieces nested;  ///< with numbers of points in the file

  std::vector<std::string> of_file;  ///< SurfaceMesh::remarks
  int merged_points = 0;
  int removed_points = 0;  ///< unused by faces
  int removed_faces = 0;   ///< repeated or collapsed
  int flipped_faces = 0;   ///< to agree with their neighbours, or to face outward

  std::string size() const;                                     ///< size and topology
  std::string summary() const { return name + ": " + size(); }  ///< in one line
  std::string quality() const;                                  ///< one line on the shape of the faces
  /// One line on each kind of repair, and on each property with which a run may fail.
  std::vector<std::string> remarks() const;
};

/// @param name of the mesh in messages
/// @throws Error in one line that names the first point with a coordinate that is not finite, or so large (1e60) that
/// products of a few lengths overflow.
void require_coordinates(const SurfaceMesh& mesh, const std::string& name);

/// Measures MeshReport::rounding.
/// @throws Error as require_coordinates, and in one line if it is above 1e-6: so far from the origin strains are only
/// rounding, and distinct points may coincide
void measure_rounding(const SurfaceMesh& mesh, MeshReport& report);

/// Checks a mesh (measure_rounding and the faults below) and makes all unambiguous repairs: points at the same place
/// are merged; corners of a face that name the same point in succession become one, and a face that is then no polygon
/// is removed; faces that repeat another and points of no face are removed; faces are flipped so that neighbours agree,
/// in each open piece the smaller part, in each closed piece so that all face outward.
///
/// After that points and faces are numbered without gaps; point_id and face_id keep their numbers in the file.
/// Not collective.
/// @param name of the mesh in messages, such as MeshOptions::name
/// @param merge_distance points no further apart are at the same place [m]; none: no points are merged, as for two
/// layers that lie on each other
/// @throws Error, one line that counts and names (by their numbers in the file, from 0) all of these: faces that name
/// one point twice or have no area; quads with corners turned against each other (inverted or folded); edges of three
/// or more faces; points whose faces do not hang together by edges; pieces that cannot be oriented; polygons that
/// cannot be split into triangles; a point at which more than 10,000 triangles meet.
MeshReport check_and_repair(SurfaceMesh& mesh, const std::string& name, std::optional<double> merge_distance = 0);

/// Message that a burning sheet cannot be built on a mesh because faces are no quads; empty if all are.
std::string fault_of_quads(const SurfaceMesh& mesh);

}  // namespace pellicle::meshing
