#include "contact/body_correction.h"

#include "contact/contact_laws.h"
#include "parallel/collective.h"

namespace pellicle::contact {

namespace {

/// A particle this near to a surface touches it: far above rounding, far below any sheet's thickness [m].
constexpr double touching = 1e-9;

/// A slip along a surface, shortened by friction by at most `limit`.
Eigen::Vector3d slip_after_friction(const Eigen::Vector3d& slip, double limit) {
  const double length = slip.norm();
  return length > limit ? Eigen::Vector3d(slip * (1 - limit / length)) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

/// Normal speed, relative to the body, at which a point leaves a body after it arrived at a relative velocity [m/s].
double rebound_speed(const Body& body, const Eigen::Vector3d& normal, const Eigen::Vector3d& arrival) {
  return std::max(0.0, -body.restitution * normal.dot(arrival));
}

std::vector<Body> without_margins(std::vector<Body> bodies) {
  for (Body& body : bodies) {
    body.margin = 0;
  }
  return bodies;
}

}  // namespace

BodyCorrection::BodyCorrection(const Surface& surface, const std::map<std::string, BodyOptions>& bodies,
                               double thickness)
    : surface_(surface),
      bodies_(make_bodies(surface.comm(), bodies)),
      sweep_(surface, without_margins(bodies_), thickness),
      force_(bodies_.size(), Eigen::Vector3d::Zero()),
      last_(bodies_.empty() ? Field() : Field(surface.particles, 3)),
      is_touched_(surface.particles.owned, false) {}

void BodyCorrection::begin_step(const ContactStep& step, const std::vector<bool>* active) {
  std::fill(force_.begin(), force_.end(), Eigen::Vector3d::Zero());
  std::fill(is_touched_.begin(), is_touched_.end(), false);
  is_moved_ = false;
  if (!empty()) {
    sweep_.set_surface(step.pinned, active);
    sweep_.begin_step(step.start, step.time_end, step.h);
  }
}

void BodyCorrection::correct_positions(Field& positions, const ContactStep& step) {
  if (empty()) {
    return;
  }
  std::fill(is_touched_.begin(), is_touched_.end(), false);
  sweep_.stop_at_middle(is_moved_ ? &last_ : nullptr, positions, StepLimit::each_vertex);
  push_particles(positions, step);
  is_moved_ = true;
  last_.values() = positions.values();
}

bool BodyCorrection::correct_triangles(Field& positions, const ContactStep& step) {
  constexpr int most_rounds = 50;
  bool has_any = false;
  std::vector<bool> has_moved;
  for (int round = 0; !empty() && round < most_rounds; ++round) {
    const Field::Values values = positions.values();
    const Eigen::Matrix3Xd before = values;
    if (!push_triangles(positions, step, round == 0 ? nullptr : &has_moved)) {
      break;
    }
    has_any = true;
    push_particles(positions, step);
    has_moved.assign(surface_.particles.local(), false);
    for (Eigen::Index i = 0; i < before.cols(); ++i) {
      has_moved[i] = before.col(i) != values.col(i);
    }
  }
  return has_any;
}

/// Place of a point after a body has pushed it out to a margin, friction included.
/// @param gap at the point @param start place of the point at the step's start
Eigen::Vector3d BodyCorrection::corrected(std::size_t body, const SignedDistance& gap, double margin,
                                          const Eigen::Vector3d& start, const Eigen::Vector3d& x) const {
  const double friction = bodies_[body].friction;
  const double push = margin - gap.distance;
  Eigen::Vector3d result = x + push * gap.normal;
  if (friction > 0) {
    const Eigen::Vector3d slip = along_surface(result - sweep_.carried_place(body, start), gap.normal);
    result += slip_after_friction(slip, friction * push) - slip;
    // The tangent plane of a curved surface leaves it.
    const SignedDistance left = signed_distance(sweep_.after(body), result);
    result += (margin - left.distance) * left.normal;
  }
  return result;
}

void BodyCorrection::add_force(std::size_t body, PetscInt particle, const Eigen::Vector3d& moved_by,
                               const ContactStep& step) {
  is_touched_[particle] = true;
  force_[body] -= step.mass[particle] / (step.h * step.h) * moved_by;
}

/// Moves local particles out of bodies; every rank moves a ghost like its owner.
void BodyCorrection::push_particles(Field& positions, const ContactStep& step) {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Solid& solid = sweep_.after(b);
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
      auto x = positions.vector(i);
      const SignedDistance gap = signed_distance(solid, x);
      if (gap.distance >= bodies_[b].margin || step.pinned[i]) {
        continue;
      }
      const Eigen::Vector3d before = x;
      x = corrected(b, gap, bodies_[b].margin, step.start.vector(i), before);
      if (i < surface_.particles.owned) {
        add_force(b, i, x - before, step);
      }
    }
  }
}

/// A sweep of correct_triangles: moves a particle in the mean direction by the most that a triangle needs. Collective.
/// @param with only triangles with one of these particles are examined; null: all
/// @returns whether any triangle was too deep, on any rank
bool BodyCorrection::push_triangles(Field& positions, const ContactStep& step, const std::vector<bool>* with) {
  const double limit = BodySweep::tolerance / 2 * sweep_.thickness();
  WantedChanges moves;
  sweep_.visit_near_triangles(
      positions, false, -limit,
      [&](std::size_t b, std::size_t t, const auto&, const DeepestPoint& deepest) {
        const PointWeights point = weights_of(surface_, t, deepest.weights);
        const Eigen::Vector3d x = at_point(point, positions);
        const Eigen::Vector3d by = corrected(b, deepest.gap, 0, at_point(point, step.start), x) - x;
        sweep_.add_change(b, point, step.mass, by, 1, moves);
      },
      with);
  for (const auto& [who, move] : moves) {
    const auto& [body, particle] = who;
    const Eigen::Vector3d by = move.largest * move.sum.normalized();
    positions.vector(particle) += by;
    add_force(body, particle, by, step);
  }
  if (!on_any_rank(surface_.comm(), !moves.empty())) {
    return false;
  }
  positions.update_ghosts();
  return true;
}

void BodyCorrection::correct_velocities(Field& velocities, const Field& positions, const ContactStep& step) {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    const Solid& solid = sweep_.after(b);
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
      const SignedDistance gap = signed_distance(solid, positions.vector(i));
      if (gap.distance > body.margin + touching || step.pinned[i]) {
        continue;
      }
      // The mean over the step, as in eq. 13: a particle that sticks to the body has exactly this velocity.
      const Eigen::Vector3d body_velocity = sweep_.velocity_at(b, positions.vector(i));
      const Eigen::Vector3d relative = velocities.vector(i) - body_velocity;
      double rebound = 0;
      if (body.restitution > 0 && step.start_velocity != nullptr && sweep_.start_gap(b, i) > body.margin + touching) {
        rebound = rebound_speed(body, gap.normal, step.start_velocity->vector(i) - body_velocity);
      }
      const double approach = rebound - relative.dot(gap.normal);
      if (approach <= 0) {
        continue;
      }
      const Eigen::Vector3d corrected =
          body_velocity + rebound * gap.normal +
          slip_after_friction(along_surface(relative, gap.normal), body.friction * approach);
      if (i < surface_.particles.owned) {
        force_[b] -= step.mass[i] / step.h * (corrected - velocities.vector(i));
      }
      velocities.vector(i) = corrected;
    }
  }
  stop_triangles(velocities, positions, step);
}

/// Corrects the velocities of the corners of triangles whose deepest points touch a body. Collective.
void BodyCorrection::stop_triangles(Field& velocities, const Field& positions, const ContactStep& step) {
  WantedChanges changes;
  triangle_gap_.assign(bodies_.size(), sweep_.thickness());
  sweep_.visit_near_triangles(
      positions, false, sweep_.thickness(),
      [&](std::size_t b, std::size_t t, const auto&, const DeepestPoint& deepest) {
        const Body& body = bodies_[b];
        const PointWeights point = weights_of(surface_, t, deepest.weights);
        if (!sweep_.can_move(point)) {
          return;
        }
        triangle_gap_[b] = std::min(triangle_gap_[b], deepest.gap.distance);
        if (deepest.gap.distance > touching) {
          return;
        }
        const Eigen::Vector3d& normal = deepest.gap.normal;
        const Eigen::Vector3d body_velocity = sweep_.velocity_at(b, at_point(point, positions));
        const Eigen::Vector3d relative = at_point(point, velocities) - body_velocity;
        double rebound = 0;
        if (body.restitution > 0 && step.start_velocity != nullptr &&
            signed_distance(sweep_.before(b), at_point(point, step.start)).distance > touching) {
          rebound = rebound_speed(body, normal, at_point(point, *step.start_velocity) - body_velocity);
        }
        const double approach = rebound - relative.dot(normal);
        if (approach > 0) {
          const Eigen::Vector3d slip = slip_after_friction(along_surface(relative, normal), body.friction * approach);
          sweep_.add_change(b, point, step.mass, rebound * normal + slip - relative, approach, changes);
        }
      });
  for (const auto& [who, change] : changes) {
    const auto& [body, particle] = who;
    const Eigen::Vector3d by = change.mean();
    velocities.vector(particle) += by;
    force_[body] -= step.mass[particle] / step.h * by;
  }
  if (on_any_rank(surface_.comm(), !changes.empty())) {
    velocities.update_ghosts();
  }
}

std::vector<BodyLoad> BodyCorrection::loads(const Field& positions, const ContactStep& step) const {
  std::vector<BodyLoad> loads;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    BodyLoad load{force_[b], triangle_gap_[b]};
    for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
      if (!step.pinned[i]) {
        const SignedDistance gap = signed_distance(sweep_.after(b), positions.vector(i));
        load.gap = std::min(load.gap, gap.distance - bodies_[b].margin);
      }
    }
    sum_over_ranks(surface_.particles.comm, load.force);
    load.gap = min_over_ranks(surface_.particles.comm, load.gap);
    loads.push_back(load);
  }
  return loads;
}

}  // namespace pellicle::contact
