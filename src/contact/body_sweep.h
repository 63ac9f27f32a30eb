#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "contact/bodies.h"
#include "energies/potential.h"
#include "geometry/deepest_point.h"
#include "surface/drawn_surface.h"
#include "surface/surface.h"

namespace pellicle::contact {

/// Corners of an element; the last one of a triangle comes twice.
inline std::array<PetscInt, 4> corners_of(const Surface& surface, std::size_t element) {
  return {surface.corner(element, 0), surface.corner(element, 1), surface.corner(element, 2),
          surface.corner(element, surface.has_quads() ? 3 : 2)};
}

/// @param weights barycentric coordinates in the triangle, sum 1
PointWeights weights_of(const Surface& surface, std::size_t triangle, const Eigen::Vector3d& weights);

/// The changes that points of triangles which touch a body need in the place or the velocity of one of their corners.
struct WantedChange {
  double weight = 0;                              ///< sum of the changes' weights
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  ///< of the changes times their weights
  double largest = 0;                             ///< length of the largest change

  /// The mean of the changes: weighted with their amounts, rounding does not decide which points count.
  Eigen::Vector3d mean() const { return sum / weight; }
};
using WantedChanges = std::map<std::pair<std::size_t, PetscInt>, WantedChange>;  ///< by body and particle

/// Moving bodies: finds a surface's surface triangles near them and keeps displacements from passing through a body.
class BodySweep {
 public:
  // Fractions of the thickness.
  static constexpr double gap_error = 0.02;  ///< of the gap of a triangle
  static constexpr double tolerance = 0.1;   ///< depth up to which a surface may enter a body

  /// The surface must outlive this object. @param thickness gap below which bodies press [m]
  BodySweep(const Surface& surface, std::vector<Body> bodies, double thickness);

  const std::vector<Body>& bodies() const { return bodies_; }
  double thickness() const { return thickness_; }

  /// Sets on which part of the surface bodies act from the next step on; all of it at first. Not collective.
  /// @param constrained local particles that do not move, because they are pinned or burnt
  /// @param active surface triangles of the local elements that are there; null: all
  void set_surface(const std::vector<bool>& constrained, const std::vector<bool>* active);
  /// Begins a step. Not collective.
  /// @param start positions at the beginning of the step [m], ghosts up to date
  /// @param time_end at the end of the step [s] @param h length of the step [s]
  void begin_step(const Field& start, double time_end, double h);
  /// Changes the time at which the present step ends, and with it the poses of the bodies. Not collective.
  void set_time(double time_end, double h);

  const Field& start() const { return start_; }
  bool is_held(PetscInt particle) const { return constrained_[particle]; }
  double h() const { return h_; }                                              ///< [s]
  const Solid& before(std::size_t body) const { return moved_[body].before; }  ///< the body at the step's start
  const Solid& after(std::size_t body) const { return moved_[body].after; }    ///< the body at the step's end
  /// Message that names the body in which particles are too deep at the step's start, or empty. Collective.
  std::string start_fault() const {
    return h_ > 0 ? particles_inside(bodies_, time_, surface_.particles, start_, constrained_, tolerance * thickness_)
                  : "";
  }
  /// Message that names the first body into which the surface reaches deeper than the tolerance; empty if there is
  /// none. @param loads on each body
  std::string fault(const std::vector<BodyLoad>& loads) const;
  /// Gap between a body with its margin and a local particle at the step's start [m].
  double start_gap(std::size_t body, PetscInt particle) const { return moved_[body].start_gap[particle]; }
  /// Whether the free particles of a point have enough weight to move it.
  bool can_move(const PointWeights& point) const;
  /// Adds the change that a point needs to those of its owned particles, in proportion to weight over mass; nothing if
  /// it cannot move. @param by change of the point @param weight of this change in the mean
  void add_change(std::size_t body, const PointWeights& point, const std::vector<double>& mass,
                  const Eigen::Vector3d& by, double weight, WantedChanges& changes) const;
  /// Mean velocity over the step of the body's material point that is at x in the end [m/s].
  Eigen::Vector3d velocity_at(std::size_t body, const Eigen::Vector3d& x) const {
    return (x - before(body).pose.to_world(after(body).pose.to_own(x))) / h_;
  }
  const Solid& solid(std::size_t body, bool at_start) const { return at_start ? before(body) : after(body); }
  /// Gap between a body with its margin and a point, with the body's normal there.
  SignedDistance gap_at(std::size_t body, const Solid& solid, const Eigen::Vector3d& x) const {
    const SignedDistance gap = signed_distance(solid, x);
    return {gap.distance - bodies_[body].margin, gap.normal};
  }
  /// Place of a point, or particle, if it had moved with the body since the step's start [m].
  Eigen::Vector3d carried_place(std::size_t body, const Eigen::Vector3d& start) const {
    return after(body).pose.to_world(before(body).pose.to_own(start));
  }
  Eigen::Vector3d carried_place(std::size_t body, PetscInt particle) const {
    return carried_place(body, start_.vector(particle));
  }

  /// Calls `take` with each body, each surface triangle of the local elements that is nearer to it than `below`, the
  /// triangle's corners and its deepest point; not with triangles that are constrained, nor for half spaces, where a
  /// corner is the deepest point. Not collective.
  /// @param at_start whether bodies are in their poses at the step's start; otherwise at its end
  /// @param with restricts the visit to triangles of elements that have one of these local particles; null: all
  template <class Take>
  void visit_near_triangles(const Field& x, bool at_start, double below, const Take& take,
                            const std::vector<bool>* with = nullptr) const {
    const std::size_t per_element = surface_.triangles_per_element;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (std::holds_alternative<HalfSpace>(bodies_[b].shape)) {
        continue;
      }
      const double farthest = below + reach_of(at_start ? 0 : farthest_moved(b, x));
      const Solid& solid = this->solid(b, at_start);
      for (std::size_t e = 0; e < surface_.triangles.size() / per_element; ++e) {
        if (start_gap(b, surface_.corner(e, 0)) > farthest || (with != nullptr && !has_any(e, *with)) ||
            least_gap(b, solid, e, x) > below) {
          continue;
        }
        const DrawnPlaces places(surface_, x.data(), e);
        for (std::size_t t = e * per_element; t < (e + 1) * per_element; ++t) {
          const auto at = places(surface_.triangles[t]);
          if (const auto found = deepest_near(b, solid, t, at, below)) {
            take(b, t, at, *found);
          }
        }
      }
    }
  }

  /// Draws the places `to` back towards those at the step's start, moved with the near bodies, until no surface
  /// triangle, and no particle, comes nearer to a body than 0.7 of the thickness on its way there. Collective.
  /// @returns whether anything was drawn back, on any rank
  bool stop_at_surface(Field& to) const { return shorten(nullptr, to, true, StepLimit::each_vertex); }
  /// Draws the places `to` back so that nothing passes the middle of a body, or goes deeper if it is beyond already.
  /// @param from places at which the way begins; null: those at the step's start, moved with the near bodies
  bool stop_at_middle(const Field* from, Field& to, StepLimit how) const { return shorten(from, to, false, how); }

 private:
  /// A body in the step.
  struct Moved {
    Solid before;
    Solid after;
    bool is_at_rest = false;
    std::vector<double> start_gap;  ///< of the local particles [m]
    double least_start_gap = 0;     ///< the least start_gap [m]
  };

  bool has_any(std::size_t element, const std::vector<bool>& particles) const;
  double farthest_moved(std::size_t body, const Field& x) const;
  /// Distance by which an element may be nearer than its first corner at the start, if particles moved by `moved` [m].
  double reach_of(double moved) const { return moved + 2 * (longest_side_ + 2 * moved); }
  double least_gap(std::size_t body, const Solid& solid, std::size_t element, const Field& x) const;
  std::optional<DeepestPoint> deepest_near(std::size_t body, const Solid& solid, std::size_t triangle,
                                           const Triangle& at, double below) const;
  std::vector<double> safe_shares(std::size_t body, const Field& from, const Field& to, bool is_carried,
                                  bool at_surface) const;
  bool shorten(const Field* from, Field& to, bool at_surface, StepLimit how) const;

  const Surface& surface_;
  double thickness_;  ///< [m]
  std::vector<Body> bodies_;
  std::vector<bool> constrained_;
  std::vector<bool> active_;  ///< empty: all surface triangles are there
  Field start_;
  double longest_side_ = 0;  ///< of the surface triangles at the start [m]
  double h_ = 0;             ///< [s]
  double time_ = 0;          ///< of the step's start [s]
  std::vector<Moved> moved_;
};

}  // namespace pellicle::contact
