#include "contact/body_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel/collective.h"

namespace pellicle::contact {

namespace {

/// Largest displacement of a local particle [m].
double farthest_way(const Field& from, const Field& to) {
  const Field::ConstValues a = from.values();
  const Field::ConstValues b = to.values();
  return a.cols() > 0 ? std::sqrt((b - a).colwise().squaredNorm().maxCoeff()) : 0;
}

}  // namespace

PointWeights weights_of(const Surface& surface, std::size_t triangle, const Eigen::Vector3d& weights) {
  PointWeights result{corners_of(surface, surface.element_of_triangle(triangle)),
                      {weights[0], weights[1], weights[2], 0}};
  if (surface.has_quads()) {
    result.weights.fill(weights[2] / 4);
    result.weights[triangle % 4] += weights[0];
    result.weights[(triangle + 1) % 4] += weights[1];
  }
  return result;
}

bool BodySweep::can_move(const PointWeights& point) const {
  constexpr double least_free = 0.1;
  double free = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    free += is_held(point.particles[k]) ? 0 : point.weights[k];
  }
  return free >= least_free;
}

void BodySweep::add_change(std::size_t body, const PointWeights& point, const std::vector<double>& mass,
                           const Eigen::Vector3d& by, double weight, WantedChanges& changes) const {
  if (!can_move(point)) {
    return;
  }
  std::array<double, 4> shares{};  // displacements of the particles, in proportion
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    if (const PetscInt particle = point.particles[k]; !is_held(particle)) {
      shares[k] = point.weights[k] / mass[particle];
      sum += shares[k] * point.weights[k];
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const double fraction = shares[k] / sum;
    if (fraction > 0 && point.particles[k] < surface_.particles.owned) {
      WantedChange& change = changes[{body, point.particles[k]}];
      change.weight += weight;
      change.sum += weight * fraction * by;
      change.largest = std::max(change.largest, (fraction * by).norm());
    }
  }
}

BodySweep::BodySweep(const Surface& surface, std::vector<Body> bodies, double thickness)
    : surface_(surface),
      thickness_(thickness),
      bodies_(std::move(bodies)),
      constrained_(surface.particles.local(), false),
      start_(bodies_.empty() ? Field() : Field(surface.particles, 3)),
      moved_(bodies_.size()) {}

void BodySweep::set_surface(const std::vector<bool>& constrained, const std::vector<bool>* active) {
  constrained_ = constrained;
  active_ = active != nullptr ? *active : std::vector<bool>();
}

void BodySweep::begin_step(const Field& start, double time_end, double h) {
  start_.values() = start.values();
  longest_side_ = 0;
  for (std::size_t t = 0; t < surface_.triangles.size() && !bodies_.empty(); ++t) {
    longest_side_ = std::max(longest_side_, longest_side(places_of_triangle(surface_, start_.data(), t)));
  }
  set_time(time_end, h);
}

void BodySweep::set_time(double time_end, double h) {
  h_ = h;
  time_ = time_end - h;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Moved& moved = moved_[b];
    moved.before = bodies_[b].at(time_end - h);
    moved.after = bodies_[b].at(time_end);
    const Pose& pose = moved.before.pose;
    moved.is_at_rest = pose.place == moved.after.pose.place && pose.turn == moved.after.pose.turn;
    moved.start_gap.resize(surface_.particles.local());
    moved.least_start_gap = std::numeric_limits<double>::infinity();
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
      moved.start_gap[i] = gap_at(b, moved.before, start_.vector(i)).distance;
      moved.least_start_gap = std::min(moved.least_start_gap, moved.start_gap[i]);
    }
  }
}

std::string BodySweep::fault(const std::vector<BodyLoad>& loads) const {
  const double most = tolerance * thickness_;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (loads[b].gap < -most) {
      return fmt::format("bodies.{} is entered by {:.2e} m, expected at most {:.2e} m, a tenth of contact.thickness",
                         bodies_[b].name, -loads[b].gap, most);
    }
  }
  return "";
}

/// Whether an element has one of these particles as a corner.
bool BodySweep::has_any(std::size_t element, const std::vector<bool>& particles) const {
  const std::array<PetscInt, 4> corners = corners_of(surface_, element);
  return std::any_of(corners.begin(), corners.end(), [&particles](PetscInt i) { return particles[i]; });
}

/// Farthest that a local particle has moved relative to the body since the start [m].
double BodySweep::farthest_moved(std::size_t body, const Field& x) const {
  if (moved_[body].is_at_rest) {
    return farthest_way(start_, x);
  }
  double farthest = 0;
  for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
    farthest = std::max(farthest, (x.vector(i) - carried_place(body, i)).norm());
  }
  return farthest;
}

/// Lower bound of the gap between an element and a body, by the gap of its first corner [m].
double BodySweep::least_gap(std::size_t body, const Solid& solid, std::size_t element, const Field& x) const {
  const auto [first, a, b, c] = corners_of(surface_, element);
  return least_distance(solid, {x.vector(a), x.vector(b), x.vector(c)}, x.vector(first),
                        gap_at(body, solid, x.vector(first)));
}

/// The deepest point of a triangle, if the triangle is active, not constrained, and nearer to a body than `below`.
std::optional<DeepestPoint> BodySweep::deepest_near(std::size_t body, const Solid& solid, std::size_t triangle,
                                                    const Triangle& at, double below) const {
  if (!active_.empty() && !active_[triangle]) {
    return std::nullopt;
  }
  const double margin = bodies_[body].margin;
  std::optional<DeepestPoint> found = deepest_point(solid, at, below + margin, gap_error * thickness_);
  if (found && found->gap.distance - margin < below) {
    const auto particles = corners_of(surface_, surface_.element_of_triangle(triangle));
    if (!std::all_of(particles.begin(), particles.end(), [this](PetscInt i) { return is_held(i); })) {
      return found;
    }
  }
  return std::nullopt;
}

/// For each local particle the fraction of its way up to which no surface triangle, and none of the particles, passes
/// through a body; for particles of other ranks this rank knows a part only. Not collective.
/// @param is_carried whether `from` are the places at the step's start, moved with the body
/// @param at_surface whether the way ends at the body's surface; otherwise at its middle
/// @returns empty if all particles may go all the way
std::vector<double> BodySweep::safe_shares(std::size_t body, const Field& from, const Field& to, bool is_carried,
                                           bool at_surface) const {
  const double depth = depth_of(bodies_[body].shape);
  if (!std::isfinite(depth)) {
    return {};
  }
  const double middle = std::max(depth / 2, 0.1 * thickness_);
  const double farthest = reach_of(is_carried ? 0 : farthest_moved(body, from)) + farthest_way(from, to) - middle;
  if (moved_[body].least_start_gap >= farthest) {
    return {};
  }
  std::vector<double> shares(surface_.particles.local(), 1);
  constexpr double surface_gap = 0.7;  // at which what comes from outside is stopped, of the thickness
  const double rounding = 0.05 * std::min(thickness_, middle);
  const double margin = bodies_[body].margin;
  // Gaps at `from` are no less than this.
  const auto least_gap = [&](PetscInt i) {
    const double there = start_gap(body, i);
    return is_carried ? there : there - (from.vector(i) - carried_place(body, i)).norm();
  };
  // The fraction of the way on which the gap, which `gap` gives for a fraction, stays above a bound.
  const auto trace = [&](double length, const auto& gap) {
    constexpr int most = 200;
    const double begin = gap(0.0);
    double bound = at_surface ? surface_gap * thickness_ : -middle;
    if (begin - bound <= 2 * rounding) {  // It may move along the surface and outward, but not creep deeper.
      constexpr double ahead = 0.01;
      if (!at_surface && gap(ahead) < begin) {
        return 0.0;
      }
      bound = begin - 2 * rounding;
    }
    double fraction = 0;
    double spare = begin - bound;
    for (int n = 0; n < most && spare > rounding; ++n) {
      if (spare >= (1 - fraction) * length) {
        return 1.0;
      }
      fraction += spare / length;
      spare = gap(fraction) - bound;
    }
    return fraction;
  };
  const auto between = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double fraction) {
    return Eigen::Vector3d((1 - fraction) * a + fraction * b);
  };
  const Solid& solid = after(body);
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    const Eigen::Vector3d a = from.vector(i);
    const Eigen::Vector3d b = to.vector(i);
    const double length = (b - a).norm();
    if (length > least_gap(i) + middle) {
      shares[i] = trace(
          length, [&](double fraction) { return signed_distance(solid, between(a, b, fraction)).distance - margin; });
    }
  }
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    if (start_gap(body, surface_.triangles[t][0]) >= farthest || (!active_.empty() && !active_[t])) {
      continue;
    }
    const Triangle a = places_of_triangle(surface_, from.data(), t);
    const Triangle b = places_of_triangle(surface_, to.data(), t);
    const double length = std::max({(b[0] - a[0]).norm(), (b[1] - a[1]).norm(), (b[2] - a[2]).norm()});
    if (length <= least_gap(surface_.triangles[t][0]) - longest_side(a) + middle ||
        (!at_surface && !deepest_point(solid, a, length - middle + margin, rounding))) {
      continue;
    }
    const double fraction = trace(length, [&](double displacement) {
      const Triangle at{between(a[0], b[0], displacement), between(a[1], b[1], displacement),
                        between(a[2], b[2], displacement)};
      const auto deepest = deepest_point(solid, at, std::numeric_limits<double>::infinity(), rounding);
      return deepest->gap.distance - margin;
    });
    for (const PetscInt i : corners_of(surface_, surface_.element_of_triangle(t))) {
      shares[i] = std::min(shares[i], fraction);
    }
  }
  return shares;
}

/// @param from places at which the way begins; null: those at the step's start, moved with the near bodies
bool BodySweep::shorten(const Field* from, Field& to, bool at_surface, StepLimit how) const {
  constexpr int most = 20;  // A triangle whose corners stop one after the other may have to stop again.
  const PetscInt owned = surface_.particles.owned;
  Field carried = from == nullptr ? Field(surface_.particles, 3) : Field();
  for (int round = 0; round < most; ++round) {
    bool again = false;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (from == nullptr) {
        for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
          carried.vector(i) = carried_place(b, i);
        }
      }
      const Field& begin = from == nullptr ? carried : *from;
      std::vector<double> shares = safe_shares(b, begin, to, from == nullptr, at_surface);
      if (how == StepLimit::all_alike || round + 1 == most) {
        double least = 1;
        for (PetscInt i = 0; i < owned && !shares.empty(); ++i) {
          least = std::min(least, shares[i]);
        }
        least = min_over_ranks(surface_.comm(), least);
        if (least < 1) {
          shares.assign(owned, least);
        }
      }
      bool changes = false;
      for (PetscInt i = 0; i < owned && !shares.empty(); ++i) {
        if (shares[i] < 1 && !is_held(i)) {
          changes = true;
          to.vector(i) = (1 - shares[i]) * begin.vector(i) + shares[i] * to.vector(i);
        }
      }
      if (on_any_rank(surface_.comm(), changes)) {
        again = true;
        to.update_ghosts();
      }
    }
    if (!again) {
      return round > 0;
    }
  }
  return true;
}

}  // namespace pellicle::contact
