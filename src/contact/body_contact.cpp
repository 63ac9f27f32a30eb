#include "contact/body_contact.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <utility>

#include "contact/contact_surface.h"
#include "geometry/deepest_point.h"
#include "parallel/collective.h"
#include "surface/drawn_places.h"

namespace pellicle {
inline namespace contact {

namespace {

// Shares of the thickness.
constexpr double deepest_error = 0.02;  ///< error of the gap of an element
constexpr double too_deep = 0.05;       ///< depth at which a point becomes stiffer
constexpr double sampled_from = 0.1;    ///< a body is sampled if it bulges by more than this over a side
constexpr double deeper = 0.02;    ///< by which a point is deeper than samples and particles, so that it presses, too
constexpr double start_gap = 0.7;  ///< gap at which Newton's method begins
constexpr int most_rounds = 12;    ///< times that Newton's method goes on in a step

constexpr double stiffer_by = 4;

/// Particles and weights of a point of a drawn triangle.
struct PointWeights {
  std::array<PetscInt, 4> particles{};
  std::array<double, 4> weights{};
};

PointWeights weights_of(const Surface& surface, std::size_t triangle, const Eigen::Vector3d& weights) {
  const std::array<PetscInt, 3>& corners = surface.triangles[triangle];
  if (!surface.has_quads()) {
    return {{corners[0], corners[1], corners[2], corners[2]}, {weights[0], weights[1], weights[2], 0}};
  }
  PointWeights result{surface.cells[triangle / 4], {}};
  result.weights.fill(weights[2] / 4);
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t corner = 0; corner < 2; ++corner) {
      result.weights[k] += result.particles[k] == corners[corner] ? weights[static_cast<Eigen::Index>(corner)] : 0;
    }
  }
  return result;
}

/// Whether the point is that of a particle.
bool is_particle(const std::array<double, 4>& weights) {
  return *std::max_element(weights.begin(), weights.end()) > 1 - 1e-6;
}

Eigen::Vector3d slip_along(const Eigen::Vector3d& normal, const Eigen::Vector3d& displacement) {
  return displacement - normal * normal.dot(displacement);
}

double longest_side(const std::array<Eigen::Vector3d, 3>& corners) {
  return std::max(
      {(corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm(), (corners[0] - corners[2]).norm()});
}

/// The second derivative of the distance from a round body (3 x 3), by central differences to 1e-6 of itself; 0 for a
/// body with edges, where there is none [1/m].
Eigen::Matrix3d gap_curvature(const Solid& solid, const Eigen::Vector3d& x) {
  Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();
  const double depth = depth_of(solid.shape);
  if (std::holds_alternative<Box>(solid.shape) || depth == 0 || !std::isfinite(depth)) {
    return curvature;
  }
  const double step = 1e-3 * depth;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Vector3d aside = step * Eigen::Vector3d::Unit(k);
    curvature.col(k) =
        (signed_distance(solid, x + aside).normal - signed_distance(solid, x - aside).normal) / (2 * step);
  }
  return (curvature + curvature.transpose()) / 2;
}

}  // namespace

double contact_thickness(const Surface& surface, const ContactOptions& options) {
  constexpr double share = 0.1;
  return options.thickness ? *options.thickness : share * mean_side(surface);
}

BodyContact::BodyContact(const Surface& surface, const std::map<std::string, BodyOptions>& bodies,
                         const ContactOptions& options, double usual_stiffness)
    : surface_(surface),
      slip_speed_(options.slip_speed),
      thickness_(contact_thickness(surface, options)),
      stiffness_(options.stiffness.value_or(usual_stiffness)),
      bodies_(make_bodies(surface.comm(), bodies)),
      element_area_(static_cast<std::size_t>(surface.elements.local()), 0),
      start_(surface.particles, 3),
      held_(static_cast<std::size_t>(surface.particles.local()), false),
      moved_(bodies_.size()),
      hessian_(static_cast<std::size_t>(surface.particles.owned), Eigen::Matrix3d::Zero()) {
  Field area(surface.particles, 1);
  const auto per_element = static_cast<std::size_t>(surface.triangles_per_element);
  const std::array<double, 3> shares = surface.point_shares();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const std::size_t element = t / per_element;
    const auto corners = DrawnPlaces(surface, surface.rest.data(), element)(surface.triangles[t]);
    const double of_triangle = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 2;
    element_area_[element] += of_triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      area.data()[surface.triangles[t][k]] += shares[k] * of_triangle;
    }
  }
  const double side = mean_side(surface);
  for (const Body& body : bodies_) {
    const double sagitta = side * side / (8 * depth_of(body.shape));
    is_sampled_.push_back(sagitta > sampled_from * thickness_);
    std::vector<double>& of_particles = nearer_.emplace_back();
    for (PetscInt i = 0; i < surface.particles.local(); ++i) {
      of_particles.push_back(nearer(nearer_.size() - 1, surface.rest.col(i)));
    }
  }
  area.update_ghosts();  // A ghost misses some of its triangles.
  area_.assign(area.data(), area.data() + surface.particles.local());
}

/// Gap between the body with its margin and a point.
double BodyContact::gap_at(std::size_t body, const Solid& solid, const Eigen::Vector3d& x,
                           Eigen::Vector3d& normal) const {
  const SignedDistance gap = signed_distance(solid, x);
  normal = gap.normal;
  return gap.distance - bodies_[body].margin;
}

/// Where a particle would be if it had moved with the body since the start.
Eigen::Vector3d BodyContact::carried_place(std::size_t body, PetscInt particle) const {
  return carried(moved_[body].before.pose, moved_[body].after.pose, start_.vector(particle));
}

Eigen::Vector3d BodyContact::place(const ElementPoint& point, const Field& x) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    sum += point.weights[k] * x.vector(point.particles[k]);
  }
  return sum;
}

Eigen::Vector3d BodyContact::rest_place(const ElementPoint& point) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    sum += point.weights[k] * surface_.rest.col(point.particles[k]);
  }
  return sum;
}

Eigen::Vector3d BodyContact::carried_place(const ElementPoint& point) const {
  return carried(moved_[point.body].before.pose, moved_[point.body].after.pose, place(point, start_));
}

void BodyContact::set_surface(const std::vector<bool>& held, const std::vector<bool>* living) {
  held_ = held;
  living_ = living != nullptr ? *living : std::vector<bool>();
}

void BodyContact::begin_step(const Field& start, double time_end, double h) {
  start_.values() = start.values();
  rounds_ = 0;
  for (Moved& moved : moved_) {
    moved.stiffer.assign(static_cast<std::size_t>(surface_.particles.owned), 1);
  }
  const bool had_points = !points_.empty();
  set_time(time_end, h);
  points_ = find_points(start_, true);
  for (ElementPoint& point : points_) {
    if (const double friction = bodies_[point.body].friction; friction > 0) {
      Eigen::Vector3d normal;
      const double gap = gap_at(point.body, moved_[point.body].before, place(point, start_), normal);
      point.friction.force = -friction * Barrier{point.stiffness, thickness_, onset}.slope(gap + point.nearer);
      point.friction.normal = normal;
    }
  }
  version_ += on_any_rank(surface_.comm(), had_points || !points_.empty()) ? 1 : 0;
}

void BodyContact::set_time(double time_end, double h) {
  h_ = h;
  time_ = time_end - h;
  slip_.e = h * slip_speed_;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    Moved& moved = moved_[b];
    moved.before = body.at(time_end - h);
    moved.after = body.at(time_end);
    moved.start_gap.resize(static_cast<std::size_t>(surface_.particles.local()));
    moved.friction.assign(static_cast<std::size_t>(surface_.particles.owned), {});
    for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
      const auto particle = static_cast<std::size_t>(i);
      Eigen::Vector3d normal;
      const double gap = gap_at(b, moved.before, start_.vector(i), normal);
      moved.start_gap[particle] = gap;
      if (i < surface_.particles.owned && gap < thickness_ && body.friction > 0) {
        const Barrier barrier{stiffness_ * area_[particle], thickness_, onset};
        moved.friction[particle].force = -body.friction * barrier.slope(gap + nearer_[b][particle]);
        moved.friction[particle].normal = normal;
      }
    }
  }
}

/// How much nearer than the thickness a place was at first, undeformed: it presses from that gap on [m].
double BodyContact::nearer(std::size_t body, const Eigen::Vector3d& rest) const {
  Eigen::Vector3d normal;
  return std::clamp(thickness_ - gap_at(body, bodies_[body].at(0), rest, normal), 0.0, thickness_);
}

/// Whether a particle that has come to x may be as near as the thickness, judged by where it started.
bool BodyContact::may_touch(const Moved& moved, PetscInt particle, const Eigen::Vector3d& x) const {
  const double spare = moved.start_gap[static_cast<std::size_t>(particle)] - thickness_;
  return spare <= 0 ||
         (x - carried(moved.before.pose, moved.after.pose, start_.vector(particle))).squaredNorm() >= spare * spare;
}

/// Pressure and friction on a point at x; the body would have carried it from its start to `start`.
PointPotential BodyContact::press(std::size_t body, double stiffness, double nearer, const Friction& friction,
                                  const Eigen::Vector3d& start, const Eigen::Vector3d& x) const {
  PointPotential sum;
  Eigen::Vector3d normal;
  const double gap = gap_at(body, moved_[body].after, x, normal) + nearer;
  const Barrier barrier{stiffness, thickness_, onset};
  if (gap < thickness_) {
    sum.value = barrier.value(gap);
    sum.gradient = barrier.slope(gap) * normal;
    sum.hessian = barrier.curvature(gap) * (normal * normal.transpose());
    if (gap_curvature_share_ > 0) {
      sum.hessian += gap_curvature_share_ * barrier.slope(gap) * gap_curvature(moved_[body].after, x);
    }
  }
  if (friction.force > 0) {
    add_friction(friction, x - start, sum);
  }
  return sum;
}

PointPotential BodyContact::press(const ElementPoint& point, const Field& x) const {
  return press(point.body, point.stiffness, point.nearer, point.friction, carried_place(point), place(point, x));
}

void BodyContact::add_friction(const Friction& friction, const Eigen::Vector3d& displacement,
                               PointPotential& sum) const {
  const Eigen::Vector3d slip = slip_along(friction.normal, displacement);
  const double y = slip.norm();
  sum.value += friction.force * slip_.value(y);
  sum.gradient += friction.force * slip_.slope_over(y) * slip;
  sum.hessian += friction.force * friction.tangent.hessian(slip_, friction.normal);
}

/// Calls `take` with particle, body and potential of each owned particle that a body may act on.
template <class Take>
void BodyContact::for_each_vertex(const Field& x, const Take& take) const {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Moved& moved = moved_[b];
    const PetscInt count = moved.start_gap.empty() ? 0 : surface_.particles.owned;  // no step has begun
    for (PetscInt i = 0; i < count; ++i) {
      const auto particle = static_cast<std::size_t>(i);
      const Friction& friction = moved.friction[particle];
      if (held_[particle] || (friction.force == 0 && !may_touch(moved, i, x.vector(i)))) {
        continue;
      }
      const double stiffness = stiffness_ * area_[particle] * moved.stiffer[particle];
      take(i, b, press(b, stiffness, nearer_[b][particle], friction, carried_place(b, i), x.vector(i)));
    }
  }
}

double BodyContact::value(const Field& x) const {
  double sum = 0;
  for_each_vertex(x, [&sum](PetscInt, std::size_t, const PointPotential& potential) { sum += potential.value; });
  for (const ElementPoint& point : points_) {
    if (counts(point.element)) {
      sum += press(point, x).value;
    }
  }
  return sum;
}

void BodyContact::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  for_each_vertex(x, [&gradient](PetscInt i, std::size_t, const PointPotential& potential) {
    gradient.col(i) += potential.gradient;
  });
  for (const ElementPoint& point : points_) {
    const Eigen::Vector3d of_point = press(point, x).gradient;
    for (std::size_t k = 0; k < 4; ++k) {
      if (point.particles[k] < surface_.particles.owned) {
        gradient.col(point.particles[k]) += point.weights[k] * of_point;
      }
    }
  }
}

std::vector<VertexPair> BodyContact::pattern() const {
  std::vector<VertexPair> pairs;
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    pairs.push_back({i, surface_.particles.to_global(i)});
  }
  for (const ElementPoint& point : points_) {
    for (const PetscInt row : point.particles) {
      for (const PetscInt column : point.particles) {
        pairs.push_back({row, surface_.particles.to_global(column)});
      }
    }
  }
  return pairs;
}

void BodyContact::update_hessian(const Field& x, Curvature curvature) {
  gap_curvature_share_ = curvature == Curvature::exact ? 1 - positive_share_ : 0;
  std::fill(hessian_.begin(), hessian_.end(), Eigen::Matrix3d::Zero());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    for (std::size_t i = 0; i < moved_[b].friction.size(); ++i) {
      const auto particle = static_cast<PetscInt>(i);
      if (moved_[b].friction[i].force > 0) {
        Friction& friction = moved_[b].friction[i];
        friction.tangent.move_to(slip_, slip_along(friction.normal, x.vector(particle) - carried_place(b, particle)));
      }
    }
  }
  for (ElementPoint& point : points_) {
    point.friction.tangent.move_to(slip_, slip_along(point.friction.normal, place(point, x) - carried_place(point)));
  }
  for_each_vertex(x, [this](PetscInt i, std::size_t, const PointPotential& potential) {
    hessian_[static_cast<std::size_t>(i)] += potential.hessian;
  });
  for (ElementPoint& point : points_) {
    point.hessian = press(point, x).hessian;
  }
}

void BodyContact::add_hessian(const HessianBlocks& blocks) const {
  std::size_t pair = 0;
  for (const Eigen::Matrix3d& block : hessian_) {
    blocks.add(pair++, block);
  }
  for (const ElementPoint& point : points_) {
    for (const double row : point.weights) {
      for (const double column : point.weights) {
        blocks.add(pair++, row * column * point.hessian);
      }
    }
  }
}

/// Calls `take` with each body, each drawn triangle of the local elements that is nearer to it than `below`, the
/// triangle's corners and its deepest point.
/// @param at_start takes the bodies where they were then, and not where they end
template <class Take>
void BodyContact::visit_near_triangles(const Field& x, bool at_start, double below, const Take& take) const {
  const auto per_element = static_cast<std::size_t>(surface_.triangles_per_element);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (std::holds_alternative<HalfSpace>(bodies_[b].shape)) {
      continue;  // a corner is the deepest point
    }
    const Moved& moved = moved_[b];
    const Solid& solid = at_start ? moved.before : moved.after;
    const double reach = below + bodies_[b].margin;
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
      const std::array<PetscInt, 3>& corners = surface_.triangles[t];
      if (!living_.empty() && !living_[t]) {
        continue;
      }
      const std::array<Eigen::Vector3d, 3> at = DrawnPlaces(surface_, x.data(), t / per_element)(corners);
      const double moved_by = at_start ? 0 : (at[0] - carried_place(b, corners[0])).norm();
      if (moved.start_gap[static_cast<std::size_t>(corners[0])] - moved_by - longest_side(at) > below) {
        continue;
      }
      const auto found = deepest_point(solid, at, reach, deepest_error * thickness_);
      const auto is_held = [this](PetscInt i) { return held_[static_cast<std::size_t>(i)]; };
      const std::array<PetscInt, 4> particles = weights_of(surface_, t, Eigen::Vector3d::Zero()).particles;
      if (found && found->gap.distance - bodies_[b].margin < below &&
          !std::all_of(particles.begin(), particles.end(), is_held)) {
        take(b, t, at, *found);
      }
    }
  }
}

/// The samples of an element, besides its particles: the middles of its sides, and the middle of a quad.
std::vector<std::array<double, 4>> BodyContact::samples() const {
  if (!surface_.has_quads()) {
    return {{0.5, 0.5, 0, 0}, {0, 0.5, 0.5, 0}, {0.5, 0, 0.5, 0}};
  }
  return {{0.5, 0.5, 0, 0}, {0, 0.5, 0.5, 0}, {0, 0, 0.5, 0.5}, {0.5, 0, 0, 0.5}, {0.25, 0.25, 0.25, 0.25}};
}

/// Points of the elements that may come to press: samples of those that are near, and the places where the faces and
/// sides of triangles are deepest, if these are nearer than the thickness and nearer than samples and particles. Sides
/// are included because a triangle that is pressed in one point only would tilt round it.
std::vector<BodyContact::ElementPoint> BodyContact::find_points(const Field& x, bool at_start) const {
  constexpr double near = 2;
  const std::vector<std::array<double, 4>> all_samples = samples();
  std::vector<ElementPoint> points;
  std::pair<std::size_t, PetscInt> last{bodies_.size(), 0};
  double lowest = 0;
  visit_near_triangles(x, at_start, near * thickness_,
                       [&](std::size_t b, std::size_t t, const auto& at, const auto& face) {
                         ElementPoint point = point_of(b, t);
                         if (last != std::pair(b, point.element)) {
                           last = {b, point.element};
                           const Solid& solid = at_start ? moved_[b].before : moved_[b].after;
                           const auto gap = [&](const Eigen::Vector3d& place) {
                             return signed_distance(solid, place).distance - bodies_[b].margin;
                           };
                           lowest = thickness_;
                           for (const PetscInt i : point.particles) {
                             lowest = std::min(lowest, gap(x.vector(i)));
                           }
                           for (std::size_t k = 0; is_sampled_[b] && k < all_samples.size(); ++k) {
                             ElementPoint sample = point;
                             sample.weights = all_samples[k];
                             sample.stiffness = stiffness_ * element_area_[static_cast<std::size_t>(point.element)] /
                                                static_cast<double>(all_samples.size());
                             sample.nearer = nearer(b, rest_place(sample));
                             lowest = std::min(lowest, gap(place(sample, x)));
                             points.push_back(sample);
                           }
                         }
                         add_deepest(at_start, lowest - deeper * thickness_, t, at, face, point, points);
                       });
  return points;
}

/// As above, for all triangles that are deeper in a body than a point may be.
std::vector<BodyContact::ElementPoint> BodyContact::find_deep_points(const Field& x) const {
  std::vector<ElementPoint> points;
  const double limit = -too_deep * thickness_;
  visit_near_triangles(x, false, limit, [&](std::size_t b, std::size_t t, const auto& at, const auto& face) {
    add_deepest(false, limit, t, at, face, point_of(b, t), points);
  });
  return points;
}

BodyContact::ElementPoint BodyContact::point_of(std::size_t body, std::size_t triangle) const {
  ElementPoint point;
  point.body = body;
  point.element = static_cast<PetscInt>(triangle / static_cast<std::size_t>(surface_.triangles_per_element));
  point.stiffness = stiffness_ * element_area_[static_cast<std::size_t>(point.element)] /
                    static_cast<double>(surface_.triangles_per_element);
  point.particles = weights_of(surface_, triangle, Eigen::Vector3d::Zero()).particles;
  return point;
}

/// Adds where a triangle's face and its sides are deepest, if they are nearer than `below`.
void BodyContact::add_deepest(bool at_start, double below, std::size_t triangle,
                              const std::array<Eigen::Vector3d, 3>& at, const DeepestPoint& face, ElementPoint point,
                              std::vector<ElementPoint>& points) const {
  const double margin = bodies_[point.body].margin;
  if (face.gap.distance - margin >= below) {
    return;
  }
  const Solid& solid = at_start ? moved_[point.body].before : moved_[point.body].after;
  const auto add = [&](const DeepestPoint& found) {
    point.weights = weights_of(surface_, triangle, found.weights).weights;
    if (found.gap.distance - margin < below && !is_particle(point.weights)) {
      point.nearer = nearer(point.body, rest_place(point));
      points.push_back(point);
    }
  };
  if (face.weights.minCoeff() > 0) {
    add(face);
  }
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index next = (k + 1) % 3;
    const Eigen::Vector3d& end = at[static_cast<std::size_t>(next)];
    auto side =
        deepest_point(solid, {at[static_cast<std::size_t>(k)], end, end}, below + margin, deepest_error * thickness_);
    if (side) {
      const double share = side->weights[0];
      side->weights = share * Eigen::Vector3d::Unit(k) + (1 - share) * Eigen::Vector3d::Unit(next);
      add(*side);
    }
  }
}

/// Collective. @returns whether there are any, on any rank
bool BodyContact::add_points(const std::vector<ElementPoint>& found) {
  points_.insert(points_.end(), found.begin(), found.end());
  const bool has_new = on_any_rank(surface_.comm(), !found.empty());
  version_ += has_new ? 1 : 0;
  return has_new;
}

/// For each local particle the share of its way up to which no drawn triangle, and none of the particles, passes
/// through a body; for particles of other ranks this rank knows a part only. Not collective.
/// @param from_start from where the body has carried what was near it, and up to its surface; otherwise up to its
/// middle
std::vector<double> BodyContact::safe_shares(std::size_t body, const Field& from, const Field& to,
                                             bool from_start) const {
  std::vector<double> shares(static_cast<std::size_t>(surface_.particles.local()), 1);
  const Moved& moved = moved_[body];
  const double depth = depth_of(bodies_[body].shape);
  if (!std::isfinite(depth)) {
    return shares;
  }
  const double middle = std::max(depth / 2, 0.1 * thickness_);
  const double rounding = 0.05 * std::min(thickness_, middle);
  const double margin = bodies_[body].margin;
  // Gaps at `from` are no less than this.
  const auto least_gap = [&](PetscInt i) {
    const double there = moved.start_gap[static_cast<std::size_t>(i)];
    return from_start ? there : there - (from.vector(i) - carried_place(body, i)).norm();
  };
  // The share of the way on which the gap, which `gap` gives for a share, stays above a bound.
  const auto trace = [&](double length, const auto& gap) {
    constexpr int most = 200;
    const double begin = gap(0.0);
    double bound = from_start ? start_gap * thickness_ : -middle;
    if (begin - bound <= 2 * rounding) {  // It may move along the surface and outward, but not creep deeper.
      constexpr double ahead = 0.01;
      if (!from_start && gap(ahead) < begin) {
        return 0.0;
      }
      bound = begin - 2 * rounding;
    }
    double share = 0;
    double spare = begin - bound;
    for (int n = 0; n < most && spare > rounding; ++n) {
      share += spare / length;
      if (share >= 1) {
        return 1.0;
      }
      spare = gap(share) - bound;
    }
    return share;
  };
  const auto between = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double share) {
    return Eigen::Vector3d((1 - share) * a + share * b);
  };
  const Solid& solid = moved.after;
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    const Eigen::Vector3d a = from.vector(i);
    const Eigen::Vector3d b = to.vector(i);
    const double length = (b - a).norm();
    if (length > least_gap(i) + middle) {
      shares[static_cast<std::size_t>(i)] =
          trace(length, [&](double share) { return signed_distance(solid, between(a, b, share)).distance - margin; });
    }
  }
  const auto per_element = static_cast<std::size_t>(surface_.triangles_per_element);
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    if (!living_.empty() && !living_[t]) {
      continue;
    }
    const std::size_t element = t / per_element;
    const std::array<PetscInt, 3>& corners = surface_.triangles[t];
    const std::array<Eigen::Vector3d, 3> a = DrawnPlaces(surface_, from.data(), element)(corners);
    const std::array<Eigen::Vector3d, 3> b = DrawnPlaces(surface_, to.data(), element)(corners);
    const double length = std::max({(b[0] - a[0]).norm(), (b[1] - a[1]).norm(), (b[2] - a[2]).norm()});
    if (length <= least_gap(corners[0]) - longest_side(a) + middle) {
      continue;
    }
    const double share = trace(length, [&](double way) {
      const std::array<Eigen::Vector3d, 3> at{between(a[0], b[0], way), between(a[1], b[1], way),
                                              between(a[2], b[2], way)};
      const auto deepest = deepest_point(solid, at, std::numeric_limits<double>::infinity(), rounding);
      return deepest->gap.distance - margin;
    });
    if (share < 1) {
      const auto shorten = [&](PetscInt i) {
        double& old = shares[static_cast<std::size_t>(i)];
        old = std::min(old, share);
      };
      if (surface_.has_quads()) {
        std::for_each(surface_.cells[element].begin(), surface_.cells[element].end(), shorten);
      } else {
        std::for_each(corners.begin(), corners.end(), shorten);
      }
    }
  }
  return shares;
}

/// Draws `to` back towards `from` until all ways are safe. Collective. @returns whether anything was drawn back, on any
/// rank
bool BodyContact::shorten(const Field& from, Field& to, bool from_start, StepLimit how) const {
  constexpr int most = 20;  // A triangle whose corners stop one after the other may have to stop again.
  bool is_shortened = false;
  const PetscInt owned = surface_.particles.owned;
  for (int round = 0; round < most; ++round) {
    bool again = false;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      // The ways are relative to the body: from where it has carried each particle.
      Field begin(surface_.particles, 3);
      for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
        begin.vector(i) = from_start ? carried_place(b, i) : Eigen::Vector3d(from.vector(i));
      }
      std::vector<double> shares = safe_shares(b, begin, to, from_start);
      if (how == StepLimit::all_alike || round + 1 == most) {
        double least = *std::min_element(shares.begin(), shares.begin() + owned);
        least = owned > 0 ? least : 1;
        MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPI_DOUBLE, MPI_MIN, surface_.comm());
        std::fill(shares.begin(), shares.end(), least);
      }
      bool changes = false;
      for (PetscInt i = 0; i < owned; ++i) {
        const double share = shares[static_cast<std::size_t>(i)];
        if (share < 1 && !held_[static_cast<std::size_t>(i)]) {
          changes = true;
          to.vector(i) = (1 - share) * begin.vector(i) + share * to.vector(i);
        }
      }
      if (on_any_rank(surface_.comm(), changes)) {
        again = true;
        to.update_ghosts();
      }
    }
    if (!again) {
      break;
    }
    is_shortened = true;
  }
  return is_shortened;
}

void BodyContact::start_from(const Field& /*start*/, Field& x, double /*h*/) {
  if (bodies_.empty()) {
    return;
  }
  shorten(start_, x, true, StepLimit::each_vertex);
  std::set<std::pair<std::size_t, PetscInt>> known;
  for (const ElementPoint& point : points_) {
    known.emplace(point.body, point.element);
  }
  std::vector<ElementPoint> found = find_points(x, false);
  const auto is_known = [&known](const ElementPoint& point) { return known.count({point.body, point.element}) > 0; };
  found.erase(std::remove_if(found.begin(), found.end(), is_known), found.end());
  add_points(found);
}

bool BodyContact::renew(const Field& x) {
  if (bodies_.empty() || ++rounds_ > most_rounds) {
    return false;
  }
  bool changes = false;
  const double limit = -too_deep * thickness_;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Moved& moved = moved_[b];
    for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
      const auto particle = static_cast<std::size_t>(i);
      if (held_[particle] || !may_touch(moved, i, x.vector(i))) {
        continue;
      }
      Eigen::Vector3d normal;
      const double gap = gap_at(b, moved.after, x.vector(i), normal);
      if (gap < limit) {
        moved.stiffer[particle] *= stiffer_by;
        changes = true;
      }
    }
  }
  for (ElementPoint& point : points_) {
    Eigen::Vector3d normal;
    const double gap = gap_at(point.body, moved_[point.body].after, place(point, x), normal);
    if (gap < limit) {
      point.stiffness *= stiffer_by;
      changes = true;
    }
  }
  const bool has_new = add_points(find_deep_points(x));
  return on_any_rank(surface_.comm(), changes) || has_new;
}

bool BodyContact::limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) {
  Field to(surface_.particles, 3);
  to.values() = x.values();
  to.values().leftCols(step.cols()) += step;
  to.update_ghosts();
  if (!shorten(x, to, false, how)) {
    return false;
  }
  step = to.values().leftCols(step.cols()) - x.values().leftCols(step.cols());
  return true;
}

std::string BodyContact::fault(const Field& x) const {
  const std::vector<BodyLoad> all = loads(x);
  for (std::size_t b = 0; b < all.size(); ++b) {
    if (all[b].gap < -tolerance * thickness_) {
      char text[200];
      std::snprintf(text, sizeof text, " is entered by %.2e m, expected at most %.2e m, a tenth of contact.thickness",
                    -all[b].gap, tolerance * thickness_);
      return "body " + bodies_[b].name + text;
    }
  }
  return "";
}

std::string BodyContact::start_fault() const {
  return h_ > 0 ? particles_inside(bodies_, time_, surface_.particles, start_, held_, tolerance * thickness_) : "";
}

std::vector<BodyLoad> BodyContact::loads(const Field& x) const {
  std::vector<double> forces(3 * bodies_.size(), 0);
  std::vector<double> gaps(bodies_.size(), thickness_);
  const auto add = [&forces](std::size_t body, const Eigen::Vector3d& force) {
    Eigen::Map<Eigen::Vector3d>(forces.data() + 3 * body) += force;
  };
  for_each_vertex(x, [&](PetscInt i, std::size_t body, const PointPotential& potential) {
    add(body, potential.gradient);
    Eigen::Vector3d normal;
    gaps[body] = std::min(gaps[body], gap_at(body, moved_[body].after, x.vector(i), normal));
  });
  for (const ElementPoint& point : points_) {
    if (counts(point.element)) {
      add(point.body, press(point, x).gradient);
    }
  }
  visit_near_triangles(x, false, thickness_, [&](std::size_t b, std::size_t, const auto&, const DeepestPoint& deepest) {
    gaps[b] = std::min(gaps[b], deepest.gap.distance - bodies_[b].margin);
  });
  const auto count = static_cast<int>(bodies_.size());
  MPI_Allreduce(MPI_IN_PLACE, forces.data(), 3 * count, MPI_DOUBLE, MPI_SUM, surface_.comm());
  MPI_Allreduce(MPI_IN_PLACE, gaps.data(), count, MPI_DOUBLE, MPI_MIN, surface_.comm());
  std::vector<BodyLoad> result;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    result.push_back({Eigen::Map<const Eigen::Vector3d>(forces.data() + 3 * b), gaps[b]});
  }
  return result;
}

void BodyContact::rebound(const Field& x, const Field& before, const std::vector<double>& mass, Field& velocity,
                          std::vector<BodyLoad>& loads) const {
  if (!rebounds()) {
    return;
  }
  std::vector<double> forces(3 * bodies_.size(), 0);
  for_each_vertex(x, [&](PetscInt i, std::size_t b, const PointPotential&) {
    const Moved& moved = moved_[b];
    const double m = mass[static_cast<std::size_t>(i)];
    Eigen::Vector3d normal;
    const double gap = gap_at(b, moved.after, x.vector(i), normal);
    if (bodies_[b].restitution == 0 || gap >= thickness_ || moved.start_gap[static_cast<std::size_t>(i)] < thickness_) {
      return;
    }
    const Eigen::Vector3d place = x.vector(i);
    const Eigen::Vector3d of_body = (place - carried(moved.after.pose, moved.before.pose, place)) / h_;
    const double arrival = -normal.dot(before.vector(i) - of_body);
    const double missing = bodies_[b].restitution * arrival - normal.dot(velocity.vector(i) - of_body);
    if (arrival > 0 && missing > 0) {
      velocity.vector(i) += missing * normal;
      Eigen::Map<Eigen::Vector3d>(forces.data() + 3 * b) -= m / h_ * missing * normal;
    }
  });
  velocity.update_ghosts();
  MPI_Allreduce(MPI_IN_PLACE, forces.data(), static_cast<int>(forces.size()), MPI_DOUBLE, MPI_SUM, surface_.comm());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    loads[b].force += Eigen::Map<const Eigen::Vector3d>(forces.data() + 3 * b);
  }
}

PetscInt BodyContact::contacts(const Field& x) const {
  std::vector<bool> touches(static_cast<std::size_t>(surface_.particles.owned), false);
  for_each_vertex(x, [&](PetscInt i, std::size_t body, const PointPotential&) {
    Eigen::Vector3d normal;
    if (gap_at(body, moved_[body].after, x.vector(i), normal) < thickness_) {
      touches[static_cast<std::size_t>(i)] = true;
    }
  });
  return static_cast<PetscInt>(std::count(touches.begin(), touches.end(), true));
}

}  // namespace contact
}  // namespace pellicle
