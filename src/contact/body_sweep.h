#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "contact/bodies.h"
#include "geometry/deepest_point.h"
#include "solvers/vertex_potential.h"
#include "surface/drawn_places.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace contact {

/// Particles and weights of a point of a drawn triangle; 0 for particles that do not count.
struct PointWeights {
  std::array<PetscInt, 4> particles{};
  std::array<double, 4> weights{};
};

/// @param weights of the triangle's corners, sum 1
PointWeights weights_of(const Surface& surface, std::size_t triangle, const Eigen::Vector3d& weights);

/// What the particles have (3 x local), at a point.
template <class Values>
Eigen::Vector3d at_point(const PointWeights& point, const Values& values) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    sum += point.weights[k] * values.col(point.particles[k]);
  }
  return sum;
}
inline Eigen::Vector3d at_point(const PointWeights& point, const Field& x) { return at_point(point, x.values()); }

/// By how much points of triangles that touch bodies want the velocities of their corners to change: a particle changes
/// by the mean of what is wanted of it at a body, weighted with how much each point wants it, so that rounding does not
/// decide who counts.
class WantedChanges {
 public:
  /// Of the owned particles of a point. @param shares how far each moves if the point is to move by 1
  /// @param by what it wants [m/s] @param weight how much it wants it [m/s]
  void add(std::size_t body, const PointWeights& point, const std::array<double, 4>& shares, const Eigen::Vector3d& by,
           double weight, PetscInt owned);
  /// Calls `take` with body, particle and its change.
  template <class Take>
  void visit(const Take& take) const {
    for (const auto& [who, change] : changes_) {
      take(who.first, who.second, Eigen::Vector3d(change.sum / change.weight));
    }
  }
  bool empty() const { return changes_.empty(); }

 private:
  struct Change {
    double weight = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  std::map<std::pair<std::size_t, PetscInt>, Change> changes_;  ///< by body and particle
};

/// Bodies as they move in a step, what of a surface is near them, and how far it may go there.
class BodySweep {
 public:
  static constexpr double gap_error = 0.02;  ///< of the thickness: of the gap of a triangle

  /// Surface must outlive it. @param thickness gap from which on bodies press [m]
  BodySweep(const Surface& surface, std::vector<Body> bodies, double thickness);

  const std::vector<Body>& bodies() const { return bodies_; }
  double thickness() const { return thickness_; }

  /// Which part of the surface bodies act on in the steps to come; all of it at first. Not collective.
  /// @param held local particles that do not move, pinned or not there
  /// @param living drawn triangles of the local elements that are there; null: all
  void set_surface(const std::vector<bool>& held, const std::vector<bool>* living);
  /// To be called first in a step. Not collective.
  /// @param start positions at the beginning of the step [m], ghosts up to date
  /// @param time_end at its end [s] @param h its length [s]
  void begin_step(const Field& start, double time_end, double h);
  /// Moves the bodies in the step that has begun. Not collective.
  void set_time(double time_end, double h);

  const Field& start() const { return start_; }
  bool is_held(PetscInt particle) const { return held_[particle]; }
  double h() const { return h_; }                                              ///< [s]
  double time() const { return time_; }                                        ///< of the step's start [s]
  const Solid& before(std::size_t body) const { return moved_[body].before; }  ///< where it starts
  const Solid& after(std::size_t body) const { return moved_[body].after; }    ///< where it ends
  /// In words, the body that particles are deeper in than `least` where the step starts; empty: none. Collective.
  std::string start_fault(double least) const {
    return h_ > 0 ? particles_inside(bodies_, time_, surface_.particles, start_, held_, least) : "";
  }
  /// Between body, with its margin, and a local particle, both where they start [m]. Once a step has begun.
  double start_gap(std::size_t body, PetscInt particle) const { return moved_[body].start_gap[particle]; }
  /// How far each particle of a point moves if the point is to move by 1: by its weight and inversely to its mass.
  /// Nothing if free particles have so little of a part in it that they cannot move it.
  std::optional<std::array<double, 4>> shares(const PointWeights& point, const std::vector<double>& mass) const;
  /// Mean velocity over the step of what a body has carried to x [m/s].
  Eigen::Vector3d velocity_at(std::size_t body, const Eigen::Vector3d& x) const {
    return (x - carried(after(body).pose, before(body).pose, x)) / h_;
  }
  /// Gap between a body with its margin and a point.
  double gap_at(std::size_t body, const Solid& solid, const Eigen::Vector3d& x, Eigen::Vector3d& normal) const;
  /// Where a point would be if it had moved with the body since the start.
  Eigen::Vector3d carried_place(std::size_t body, const Eigen::Vector3d& start) const {
    return carried(moved_[body].before.pose, moved_[body].after.pose, start);
  }
  Eigen::Vector3d carried_place(std::size_t body, PetscInt particle) const {
    return carried_place(body, start_.vector(particle));
  }

  /// Calls `take` with each body, each drawn triangle of the local elements that is nearer to it than `below`, the
  /// triangle's corners and its deepest point; not with triangles that are held, nor for half spaces, where a corner is
  /// the deepest point. Not collective.
  /// @param at_start takes the bodies where they were then, and not where they end
  /// @param with only triangles of elements that have one of these local particles; null: all
  template <class Take>
  void visit_near_triangles(const Field& x, bool at_start, double below, const Take& take,
                            const std::vector<bool>* with = nullptr) const {
    const auto per_element = static_cast<std::size_t>(surface_.triangles_per_element);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (std::holds_alternative<HalfSpace>(bodies_[b].shape)) {
        continue;
      }
      const double farthest = below + reach_of(at_start ? 0 : farthest_moved(b, x));
      const Solid& solid = at_start ? before(b) : after(b);
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

  /// Draws `to` back towards where the bodies have carried what was near them at the start, until no drawn triangle,
  /// and none of the particles, passes beyond a gap of `start_gap` of the thickness on its way there. Collective.
  /// @returns whether anything was drawn back, on any rank
  bool stop_at_surface(Field& to) const;
  /// As above, where nothing may pass beyond the middle of a body, nor deeper where it is beyond already.
  /// @param from null: from where the bodies have carried it
  bool stop_at_middle(const Field* from, Field& to, StepLimit how) const;

 private:
  /// A body in the step.
  struct Moved {
    Solid before;
    Solid after;
    bool is_at_rest = false;
    std::vector<double> start_gap;  ///< of the local particles [m]
    double least_start_gap = 0;     ///< of these
  };

  bool has_any(std::size_t element, const std::vector<bool>& particles) const;
  double farthest_moved(std::size_t body, const Field& x) const;
  /// What an element reaches nearer to a body than its first corner has started, if nothing has moved further.
  double reach_of(double moved) const { return moved + 2 * (longest_side_ + 2 * moved); }
  double least_gap(std::size_t body, const Solid& solid, std::size_t element, const Field& x) const;
  std::optional<DeepestPoint> deepest_near(std::size_t body, const Solid& solid, std::size_t triangle,
                                           const std::array<Eigen::Vector3d, 3>& at, double below) const;
  std::vector<double> safe_shares(std::size_t body, const Field& from, const Field& to, bool is_carried,
                                  bool at_surface) const;
  bool shorten(const Field* from, Field& to, bool at_surface, StepLimit how) const;

  const Surface& surface_;
  double thickness_;  ///< [m]
  std::vector<Body> bodies_;
  std::vector<bool> held_;
  std::vector<bool> living_;  ///< empty: all drawn triangles are there
  Field start_;
  double longest_side_ = 0;  ///< of the drawn triangles at the start [m]
  double h_ = 0;             ///< [s]
  double time_ = 0;          ///< of the step's start [s]
  std::vector<Moved> moved_;
};

}  // namespace contact
}  // namespace pellicle
