#include "contact/body_contact.h"

#include <cmath>
#include <set>
#include <utility>

#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

// Shares of the thickness.
constexpr double too_deep = 0.05;     ///< depth from which on the stiffness of a point is raised
constexpr double sampled_from = 0.1;  ///< a body is sampled if it bulges by more than this over a side
constexpr double deeper = 0.02;  ///< by this a deepest point must be deeper than samples and particles to press, too
constexpr int most_rounds = 12;  ///< at most so often Newton's method goes on in a step

constexpr double stiffer_by = 4;

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

BodyContact::BodyContact(const Surface& surface, const std::map<std::string, BodyOptions>& bodies,
                         const ContactOptions& options, double usual_stiffness)
    : surface_(surface),
      slip_speed_(options.slip_speed),
      sweep_(surface, make_bodies(surface.comm(), bodies), contact_thickness(surface, options)),
      stiffness_(options.stiffness.value_or(usual_stiffness)),
      area_(surface.particles.local(), 0),  // A ghost misses some of its triangles.
      element_area_(surface.elements.local(), 0),
      pressed_(sweep_.bodies().size()),
      hessian_(surface.particles.owned, Eigen::Matrix3d::Zero()) {
  const std::array<double, 3> shares = surface.point_shares();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto corners = places_of_triangle(surface, surface.rest.data(), t);
    const double of_triangle = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 2;
    element_area_[surface.element_of_triangle(t)] += of_triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      area_[surface.triangles[t][k]] += shares[k] * of_triangle;
    }
  }
  const double side = mean_side(surface);
  for (const Body& body : this->bodies()) {
    // The sagitta of a side, side^2 / (8 depth), is more than this fraction of the thickness.
    is_sampled_.push_back(side * side > sampled_from * thickness() * 8 * depth_of(body.shape));
    std::vector<double>& of_particles = nearer_.emplace_back();
    for (PetscInt i = 0; i < surface.particles.owned; ++i) {
      of_particles.push_back(nearer(nearer_.size() - 1, surface.rest.col(i)));
    }
  }
}

Eigen::Vector3d BodyContact::carried_place(const ElementPoint& point) const {
  return sweep_.carried_place(point.body, at_point(point, sweep_.start()));
}

void BodyContact::begin_step(const Field& start, double time_end, double h) {
  rounds_ = 0;
  const bool had_points = !points_.empty();
  sweep_.begin_step(start, time_end, h);
  for (std::size_t b = 0; b < pressed_.size(); ++b) {
    pressed_[b].clear();
    for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
      pressed_[b].push_back({stiffness_ * area_[i], nearer_[b][i], {}});
    }
  }
  find_friction();
  points_ = find_points(start, true);
  for (ElementPoint& point : points_) {
    if (bodies()[point.body].friction > 0) {
      point.friction = friction_of(point.body, point.stiffness, point.nearer, at_point(point, start));
    }
  }
  version_ += on_any_rank(surface_.comm(), had_points || !points_.empty()) ? 1 : 0;
}

void BodyContact::set_time(double time_end, double h) {
  sweep_.set_time(time_end, h);
  find_friction();
}

/// Sets the friction of the owned particles by the normal forces at the start of the step.
void BodyContact::find_friction() {
  slip_.e = sweep_.h() * slip_speed_;
  for (std::size_t b = 0; b < pressed_.size(); ++b) {
    for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
      const bool rubs = bodies()[b].friction > 0 && sweep_.start_gap(b, i) < thickness();
      pressed_[b][i].friction =
          rubs ? friction_of(b, stiffness_ * area_[i], nearer_[b][i], sweep_.start().vector(i)) : Friction();
    }
  }
}

/// Friction by the normal force at the start of the step. @param start place of the point then
BodyContact::Friction BodyContact::friction_of(std::size_t body, double stiffness, double nearer,
                                               const Eigen::Vector3d& start) const {
  const SignedDistance gap = sweep_.gap_at(body, sweep_.before(body), start);
  const Barrier barrier{stiffness, thickness(), onset};
  return {-bodies()[body].friction * barrier.slope(gap.distance + nearer), gap.normal};
}

/// Thickness minus the gap of an undeformed place, at least 0: a point there presses from that smaller gap on [m].
double BodyContact::nearer(std::size_t body, const Eigen::Vector3d& rest) const {
  return std::clamp(thickness() - sweep_.gap_at(body, bodies()[body].at(0), rest).distance, 0.0, thickness());
}

/// Whether a particle at x may be nearer to a body than the thickness, by its gap at the step's start.
bool BodyContact::may_touch(std::size_t body, PetscInt particle, const Eigen::Vector3d& x) const {
  const double spare = sweep_.start_gap(body, particle) - thickness();
  return spare <= 0 || (x - sweep_.carried_place(body, particle)).squaredNorm() >= spare * spare;
}

/// Potential of pressure and friction of a point at x. @param start place at the step's start, moved with the body
PointPotential BodyContact::press(std::size_t body, const Pressed& pressed, const Eigen::Vector3d& start,
                                  const Eigen::Vector3d& x) const {
  PointPotential sum;
  const auto& [distance, normal] = sweep_.gap_at(body, sweep_.after(body), x);
  const double gap = distance + pressed.nearer;
  const Barrier barrier{pressed.stiffness, thickness(), onset};
  if (gap < thickness()) {
    sum.value = barrier.value(gap);
    sum.gradient = barrier.slope(gap) * normal;
    sum.hessian = barrier.curvature(gap) * (normal * normal.transpose());
    if (gap_curvature_share_ > 0) {
      sum.hessian += gap_curvature_share_ * barrier.slope(gap) * gap_curvature(sweep_.after(body), x);
    }
  }
  const Friction& friction = pressed.friction;
  if (friction.force > 0) {
    const Eigen::Vector3d slip = along_surface(x - start, friction.normal);
    const double y = slip.norm();
    sum.value += friction.force * slip_.value(y);
    sum.gradient += friction.force * slip_.slope_over(y) * slip;
    sum.hessian += friction.force * friction.tangent.hessian(slip_, friction.normal);
  }
  return sum;
}

PointPotential BodyContact::press(const ElementPoint& point, const Field& x) const {
  return press(point.body, point, carried_place(point), at_point(point, x));
}

/// Calls `take` with particle, body and potential of each owned particle that a body may act on.
template <class Take>
void BodyContact::for_each_vertex(const Field& x, const Take& take) const {
  for (std::size_t b = 0; b < bodies().size(); ++b) {
    for (PetscInt i = 0; i < static_cast<PetscInt>(pressed_[b].size()); ++i) {
      const Pressed& pressed = pressed_[b][i];
      if (!sweep_.is_held(i) && (pressed.friction.force != 0 || may_touch(b, i, x.vector(i)))) {
        take(i, b, press(b, pressed, sweep_.carried_place(b, i), x.vector(i)));
      }
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
  std::vector<VertexPair> pairs = diagonal_pairs(surface_.particles);
  for (const ElementPoint& point : points_) {
    for (const PetscInt row : point.particles) {
      for (const PetscInt column : point.particles) {
        pairs.push_back({row, surface_.particles.to_global(column)});
      }
    }
  }
  return pairs;
}

void BodyContact::update_hessian(const Field& x, double psd_blend) {
  gap_curvature_share_ = 1 - psd_blend;
  std::fill(hessian_.begin(), hessian_.end(), Eigen::Matrix3d::Zero());
  for (std::size_t b = 0; b < bodies().size(); ++b) {
    for (PetscInt i = 0; i < static_cast<PetscInt>(pressed_[b].size()); ++i) {
      if (Friction& friction = pressed_[b][i].friction; friction.force > 0) {
        friction.tangent.move_to(slip_, along_surface(x.vector(i) - sweep_.carried_place(b, i), friction.normal));
      }
    }
  }
  for (ElementPoint& point : points_) {
    point.friction.tangent.move_to(slip_,
                                   along_surface(at_point(point, x) - carried_place(point), point.friction.normal));
  }
  for_each_vertex(
      x, [this](PetscInt i, std::size_t, const PointPotential& potential) { hessian_[i] += potential.hessian; });
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

/// Points of the elements that may come to press: samples of those that are near, and the places where the faces and
/// sides of triangles are deepest, if these are nearer than the thickness and nearer than samples and particles. Sides
/// are included because a triangle that is pressed in one point only would tilt round it.
std::vector<BodyContact::ElementPoint> BodyContact::find_points(const Field& x, bool at_start) const {
  constexpr double near = 2;
  // The middles of an element's sides, and the middle of a quad.
  std::vector<std::array<double, 4>> samples{{0.5, 0.5, 0, 0}, {0, 0.5, 0.5, 0}, {0.5, 0, 0.5, 0}};
  if (surface_.has_quads()) {
    samples = {{0.5, 0.5, 0, 0}, {0, 0.5, 0.5, 0}, {0, 0, 0.5, 0.5}, {0.5, 0, 0, 0.5}, {0.25, 0.25, 0.25, 0.25}};
  }
  std::vector<ElementPoint> points;
  std::pair<std::size_t, PetscInt> last{bodies().size(), 0};
  double lowest = 0;
  sweep_.visit_near_triangles(
      x, at_start, near * thickness(), [&](std::size_t b, std::size_t t, const auto& at, const auto& face) {
        ElementPoint point = point_of(b, t);
        if (last != std::pair(b, point.element)) {
          last = {b, point.element};
          const auto gap = [&](const Eigen::Vector3d& place) {
            return sweep_.gap_at(b, sweep_.solid(b, at_start), place).distance;
          };
          lowest = thickness();
          for (const PetscInt i : point.particles) {
            lowest = std::min(lowest, gap(x.vector(i)));
          }
          for (std::size_t k = 0; is_sampled_[b] && k < samples.size(); ++k) {
            ElementPoint sample = point;
            sample.weights = samples[k];
            sample.stiffness = stiffness_ * element_area_[point.element] / static_cast<double>(samples.size());
            sample.nearer = nearer(b, at_point(sample, surface_.rest));
            lowest = std::min(lowest, gap(at_point(sample, x)));
            points.push_back(sample);
          }
        }
        add_deepest(at_start, lowest - deeper * thickness(), t, at, face, point, points);
      });
  return points;
}

BodyContact::ElementPoint BodyContact::point_of(std::size_t body, std::size_t triangle) const {
  ElementPoint point;
  point.body = body;
  point.element = static_cast<PetscInt>(surface_.element_of_triangle(triangle));
  point.stiffness = stiffness_ * element_area_[point.element] / static_cast<double>(surface_.triangles_per_element);
  point.particles = corners_of(surface_, point.element);
  return point;
}

/// Adds where a triangle's face and its sides are deepest, if they are nearer than `below`.
void BodyContact::add_deepest(bool at_start, double below, std::size_t triangle,
                              const std::array<Eigen::Vector3d, 3>& at, const DeepestPoint& face, ElementPoint point,
                              std::vector<ElementPoint>& points) const {
  const double margin = bodies()[point.body].margin;
  if (face.gap.distance - margin >= below) {
    return;
  }
  const Solid& solid = sweep_.solid(point.body, at_start);
  const auto add = [&](const DeepestPoint& found) {
    point.weights = weights_of(surface_, triangle, found.weights).weights;
    const bool is_particle = *std::max_element(point.weights.begin(), point.weights.end()) > 1 - 1e-6;
    if (found.gap.distance - margin < below && !is_particle) {
      point.nearer = nearer(point.body, at_point(point, surface_.rest));
      points.push_back(point);
    }
  };
  if (face.weights.minCoeff() > 0) {
    add(face);
  }
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::Index next = (k + 1) % 3;
    const Eigen::Vector3d& end = at[next];
    auto side = deepest_point(solid, {at[k], end, end}, below + margin, BodySweep::gap_error * thickness());
    if (side) {
      const double fraction = side->weights[0];
      side->weights = fraction * Eigen::Vector3d::Unit(k) + (1 - fraction) * Eigen::Vector3d::Unit(next);
      add(*side);
    }
  }
}

/// Adds points to those that press. Collective. @returns whether any rank had any
bool BodyContact::add_points(const std::vector<ElementPoint>& found) {
  points_.insert(points_.end(), found.begin(), found.end());
  const bool has_new = on_any_rank(surface_.comm(), !found.empty());
  version_ += has_new ? 1 : 0;
  return has_new;
}

void BodyContact::start_from(const Field& /*start*/, Field& x, double /*h*/) {
  sweep_.stop_at_surface(x);
  std::set<std::pair<std::size_t, PetscInt>> known;
  for (const ElementPoint& point : points_) {
    known.emplace(point.body, point.element);
  }
  std::vector<ElementPoint> found = find_points(x, false);
  const auto is_known = [&known](const ElementPoint& point) { return known.count({point.body, point.element}) > 0; };
  found.erase(std::remove_if(found.begin(), found.end(), is_known), found.end());
  add_points(found);
}

bool BodyContact::refresh(const Field& x) {
  if (++rounds_ > most_rounds) {
    return false;
  }
  bool changes = false;
  const double limit = -too_deep * thickness();
  const auto stiffen = [&](std::size_t body, const Eigen::Vector3d& place, Pressed& pressed) {
    if (sweep_.gap_at(body, sweep_.after(body), place).distance < limit) {
      pressed.stiffness *= stiffer_by;
      changes = true;
    }
  };
  for (std::size_t b = 0; b < bodies().size(); ++b) {
    for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
      if (!sweep_.is_held(i) && may_touch(b, i, x.vector(i))) {
        stiffen(b, x.vector(i), pressed_[b][i]);
      }
    }
  }
  for (ElementPoint& point : points_) {
    stiffen(point.body, at_point(point, x), point);
  }
  std::vector<ElementPoint> deep;
  sweep_.visit_near_triangles(x, false, limit, [&](std::size_t b, std::size_t t, const auto& at, const auto& face) {
    add_deepest(false, limit, t, at, face, point_of(b, t), deep);
  });
  const bool has_new = add_points(deep);
  return on_any_rank(surface_.comm(), changes) || has_new;
}

bool BodyContact::limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) {
  Field to(surface_.particles, 3);
  to.values() = x.values();
  to.values().leftCols(step.cols()) += step;
  to.update_ghosts();
  if (!sweep_.stop_at_middle(&x, to, how)) {
    return false;
  }
  step = to.values().leftCols(step.cols()) - x.values().leftCols(step.cols());
  return true;
}

std::vector<BodyLoad> BodyContact::loads(const Field& x) const {
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, bodies().size());
  std::vector<double> gaps(bodies().size(), thickness());
  for_each_vertex(x, [&](PetscInt i, std::size_t body, const PointPotential& potential) {
    forces.col(body) += potential.gradient;
    gaps[body] = std::min(gaps[body], sweep_.gap_at(body, sweep_.after(body), x.vector(i)).distance);
  });
  for (const ElementPoint& point : points_) {
    if (counts(point.element)) {
      forces.col(point.body) += press(point, x).gradient;
    }
  }
  sweep_.visit_near_triangles(x, false, thickness(),
                              [&](std::size_t b, std::size_t, const auto&, const DeepestPoint& deepest) {
                                gaps[b] = std::min(gaps[b], deepest.gap.distance - bodies()[b].margin);
                              });
  sum_over_ranks(surface_.comm(), forces);
  min_over_ranks(surface_.comm(), gaps);
  std::vector<BodyLoad> result;
  for (std::size_t b = 0; b < bodies().size(); ++b) {
    result.push_back({forces.col(b), gaps[b]});
  }
  return result;
}

void BodyContact::rebound(const Field& x, const Field& before, const std::vector<double>& mass, Field& velocity,
                          std::vector<BodyLoad>& loads) const {
  if (!rebounds()) {
    return;
  }
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, bodies().size());
  const auto change = [&](std::size_t b, PetscInt i, const Eigen::Vector3d& by) {
    velocity.vector(i) += by;
    forces.col(b) -= mass[i] / sweep_.h() * by;
  };
  // By how much what has come to a place should leave a body faster than it does.
  const auto missing = [&](std::size_t b, double start_gap, const Eigen::Vector3d& place,
                           const Eigen::Vector3d& arrives, const Eigen::Vector3d& leaves) -> Eigen::Vector3d {
    const double restitution = bodies()[b].restitution;
    if (restitution == 0 || start_gap < thickness()) {
      return Eigen::Vector3d::Zero();
    }
    const auto& [gap, normal] = sweep_.gap_at(b, sweep_.after(b), place);
    if (gap >= thickness()) {
      return Eigen::Vector3d::Zero();
    }
    const Eigen::Vector3d of_body = sweep_.velocity_at(b, place);
    const double arrival = -normal.dot(arrives - of_body);
    const double speed = arrival > 0 ? restitution * arrival - normal.dot(leaves - of_body) : 0;
    return std::max(speed, 0.0) * normal;
  };
  for_each_vertex(x, [&](PetscInt i, std::size_t b, const PointPotential&) {
    change(b, i, missing(b, sweep_.start_gap(b, i), x.vector(i), before.vector(i), velocity.vector(i)));
  });
  velocity.update_ghosts();
  WantedChanges changes;
  for (const ElementPoint& point : points_) {
    const double start_gap =
        sweep_.gap_at(point.body, sweep_.before(point.body), at_point(point, sweep_.start())).distance;
    const Eigen::Vector3d by =
        missing(point.body, start_gap, at_point(point, x), at_point(point, before), at_point(point, velocity));
    if (by.norm() > 0) {
      sweep_.add_change(point.body, point, mass, by, by.norm(), changes);
    }
  }
  for (const auto& [who, wanted] : changes) {
    change(who.first, who.second, wanted.mean());
  }
  velocity.update_ghosts();
  sum_over_ranks(surface_.comm(), forces);
  for (std::size_t b = 0; b < bodies().size(); ++b) {
    loads[b].force += forces.col(b);
  }
}

PetscInt BodyContact::contacts(const Field& x) const {
  std::vector<bool> touches(surface_.particles.owned, false);
  for_each_vertex(x, [&](PetscInt i, std::size_t body, const PointPotential&) {
    touches[i] = touches[i] || sweep_.gap_at(body, sweep_.after(body), x.vector(i)).distance < thickness();
  });
  return static_cast<PetscInt>(std::count(touches.begin(), touches.end(), true));
}

}  // namespace pellicle::contact
