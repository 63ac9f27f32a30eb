#include "contact/surface_contact.h"

#include <iterator>

#include "parallel/collective.h"

namespace pellicle::contact {

SurfaceContact::SurfaceContact(const std::vector<ContactSurface::Part>& parts, const ContactOptions& options,
                               bool is_free)
    : surface_(parts),
      options_(options),
      is_free_(is_free),
      mesh_(surface_),
      constrained_(surface_.particles().local()),
      start_(surface_.particles(), 3),
      origin_(surface_.particles(), 3),
      low_(surface_.particles(), 3),
      high_(surface_.particles(), 3),
      trial_(surface_.particles(), 3),
      load_(surface_.particles().owned) {}

void SurfaceContact::set_surface(const std::vector<bool>& constrained, const std::vector<bool>* active,
                                 std::size_t part) {
  for (std::size_t i = 0; i < constrained.size(); ++i) {
    constrained_[joined().local(part, static_cast<PetscInt>(i))] = constrained[i];
  }
  if (active != nullptr) {
    surface_.set_active(part, *active);
  }
}

void SurfaceContact::Stencil::add(PetscInt particle, double weight) {
  const std::size_t place = find(particle);
  if (place == count) {
    particles[count] = particle;
    weights[count++] = 0;
  }
  weights[place] += weight;
}

SurfaceContact::Stencil SurfaceContact::stencil(const ContactPair& pair, const std::array<double, 4>& weights) const {
  Stencil stencil;
  for (std::size_t k = 0; k < 4; ++k) {
    if (weights[k] != 0) {
      const ContactMesh::Particles particles = mesh_.particles(pair.points[k]);
      for (const PetscInt i : particles) {
        stencil.add(i, weights[k] * particles.weight());
      }
    }
  }
  return stencil;
}

/// Whether this rank adds a pair to sums over all ranks: it owns the particle of the pair with the lowest number.
bool SurfaceContact::counts(const ContactPair& pair) const {
  const Layout& reach = mesh_.reach();
  PetscInt lowest = reach.global;
  for (const PetscInt point : pair.points) {
    for (const PetscInt i : mesh_.particles(point)) {
      lowest = std::min(lowest, reach.to_global(i));
    }
  }
  return lowest >= reach.first && lowest < reach.first + reach.owned;
}

/// Begins a step of length h [s] in which particles are to move from `begin`, where nothing has been passed through
/// since the start, to given places. Collective.
void SurfaceContact::prepare(const Field& start, const Field& begin, const Field& to, double h) {
  slip_.e = h * options_.slip_speed;
  searches_ = 0;
  any_touched_ = false;
  room_used_ = 0;
  near_.clear();
  start_.values() = start.values();
  rubbing_.clear();
  places_of_rubbing_.clear();
  search(begin, to);
  note_rubbing(begin);
}

void SurfaceContact::start_from(const Field& start, Field& x, double h) {
  const PetscInt owned = surface_.particles().owned;
  Field begin(surface_.particles(), 3);
  begin.values() = start.values();
  if (is_free_) {  // by the mean displacement
    Eigen::Vector3d sum = (x.values() - start.values()).leftCols(owned).rowwise().sum();
    sum_over_ranks(surface_.comm(), sum);
    sum /= static_cast<double>(surface_.particles().global);
    begin.values().colwise() += sum;
  }
  prepare(start, begin, x, h);
  const Eigen::Matrix3Xd whole = (x.values() - begin.values()).leftCols(owned);
  Eigen::Matrix3Xd step = whole;
  limit(begin, StepLimit::each_vertex, step);
  for (PetscInt i = 0; i < owned; ++i) {
    if (step.col(i) != whole.col(i)) {
      x.vector(i) = begin.vector(i) + step.col(i);
    }
  }
  x.update_ghosts();
}

/// Searches for pairs at x, for particles that are to move to given places. Collective.
void SurfaceContact::search(const Field& x, const Field& to) {
  const bool is_first = ++searches_ == 1;
  if (!is_first) {
    room_used_ = std::max(room_used_, room_used(x));
  }
  constexpr double more_of_thickness = 0.06;  // by which a particle may leave its way before pairs are sought again
  std::vector<bool> is_new(surface_.particles().local());
  for (PetscInt i = 0; i < surface_.particles().local(); ++i) {
    const Eigen::Array3d displacement = to.vector(i) - x.vector(i);
    const double more = more_of_thickness * surface_.thickness(i);
    Eigen::Array3d low = displacement.min(0.0) - more;
    Eigen::Array3d high = displacement.max(0.0) + more;
    const Eigen::Array3d moved = x.vector(i) - origin_.vector(i);
    const Eigen::Array3d old_low = low_.vector(i).array() - moved;
    const Eigen::Array3d old_high = high_.vector(i).array() - moved;
    if (!is_first && (displacement >= old_low).all() && (displacement <= old_high).all()) {
      low = low.max(old_low);  // Pairs are known up to there.
      high = high.min(old_high);
    } else {
      is_new[i] = true;
    }
    low_.vector(i) = low;
    high_.vector(i) = high;
  }
  origin_.values() = x.values();
  std::vector<PetscInt> further;
  for (const Rubbing& rubbing : rubbing_) {
    std::copy_n(rubbing.global.particles.begin(), rubbing.global.count, std::back_inserter(further));
  }
  if (!mesh_.gather({x, low_, high_, is_new}, start_, further)) {
    near_.clear();
    for (Rubbing& rubbing : rubbing_) {
      std::transform(rubbing.global.particles.begin(), rubbing.global.particles.begin() + rubbing.global.count,
                     rubbing.stencil.particles.begin(), [this](PetscInt global) { return mesh_.find(global); });
    }
  }
  mesh_.write_points(x, places_);
  any_touched_ = renew_contact_pairs(mesh_, places_, near_) || any_touched_;
  if (is_first && ranks_of(surface_.comm()) > 1) {
    load_.assign(surface_.particles().owned, 0);
    for (const ContactPair& pair : near_) {
      for (const PetscInt point : {pair.points.front(), pair.points.back()}) {
        if (const PetscInt particle = *mesh_.particles(point).begin(); particle < surface_.particles().owned) {
          load_[particle] += 0.5;
        }
      }
    }
  }
  reference_ = places_;
  may_press_ = std::partition(near_.begin(), near_.end(),
                              [](const ContactPair& pair) { return pair.may_press && pair.barrier.stiffness > 0; }) -
               near_.begin();
  any_held_ = false;
  is_pressing_known_ = false;
  curved_.clear();  // They were in another reach.
}

/// Whether a particle of this rank would be at a place for which pairs are not known.
bool SurfaceContact::leaves_room(const Field& x) const {
  for (PetscInt i = 0; i < surface_.particles().owned; ++i) {
    const Eigen::Array3d moved = x.vector(i) - origin_.vector(i);
    if (mesh_.has(i) && ((moved < low_.vector(i).array()).any() || (moved > high_.vector(i).array()).any())) {
      return true;
    }
  }
  return false;
}

/// The pairs that press when the particles are at x. Sets `places_`. Collective.
const std::vector<SurfaceContact::Contact>& SurfaceContact::pressing(const Field& x) const {
  mesh_.write_points(x, places_);
  if (is_pressing_known_ && places_ == pressing_at_) {
    return pressing_;
  }
  pressing_.clear();
  for (auto next = near_.begin(); next != near_.begin() + may_press_; ++next) {
    const ContactPair& pair = *next;
    if (pair.separation(places_) >= pair.barrier.thickness) {
      continue;
    }
    const NearestPoints nearest = pair.nearest(places_);
    const double gap = nearest.apart.norm();
    if (gap < pair.barrier.thickness) {
      pressing_.push_back({&pair, stencil(pair, nearest.weights), gap, nearest.apart / (gap > 0 ? gap : 1)});
    }
  }
  pressing_at_ = places_;
  is_pressing_known_ = true;
  return pressing_;
}

void SurfaceContact::note_rubbing(const Field& x) {
  if (options_.friction == 0) {
    return;
  }
  for (const Contact& contact : pressing(x)) {
    if (contact.gap == 0) {
      continue;
    }
    Stencil global = contact.stencil;
    for (std::size_t k = 0; k < global.count; ++k) {
      global.particles[k] = mesh_.reach().to_global(global.particles[k]);
    }
    add_places(contact.stencil, places_of_rubbing_);
    rubbing_.push_back({contact.stencil, global, contact.normal, contact.gap * contact.normal,
                        -options_.friction * contact.pair->barrier.slope(contact.gap), counts(*contact.pair)});
  }
}

bool SurfaceContact::anything_touched() const { return on_any_rank(surface_.comm(), any_touched_); }

void SurfaceContact::update_pattern(const Field& x) {
  curved_ = pressing(x);
  places_of_curved_.clear();
  for (const Contact& contact : curved_) {
    add_places(contact.stencil, places_of_curved_);
  }
  for (Rubbing& rubbing : rubbing_) {
    rubbing.tangent.move_to(slip_, slip_of(rubbing));
  }
  if (on_any_rank(surface_.comm(), pattern_.size() > told_)) {
    told_ = pattern_.size();
    ++version_;
  }
}

bool SurfaceContact::limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) {
  const PetscInt owned = surface_.particles().owned;
  trial_.values().leftCols(owned) = x.values().leftCols(owned) + step;
  trial_.update_ghosts();
  if (on_any_rank(surface_.comm(), leaves_room(trial_))) {
    search(x, trial_);
  } else if (any_held_) {
    room_used_ = std::max(room_used_, room_used(x));
    for (ContactPair& pair : near_) {  // Measured again they have all of their clearance.
      pair.measure(places_);
    }
    reference_ = places_;
    any_held_ = false;
  }
  Eigen::Matrix3Xd from;
  Eigen::Matrix3Xd to;
  mesh_.write_points(x, from);
  mesh_.write_points(trial_, to);
  from -= reference_;
  to -= reference_;
  std::vector<double> furthest(from.cols());  // that each point can come from its reference
  for (PetscInt point = 0; point < from.cols(); ++point) {
    double& displacement = furthest[point];
    displacement = from.col(point).norm();
    const ContactMesh::Particles particles = mesh_.particles(point);
    for (const PetscInt i : particles) {
      displacement += particles.weight() * (to.col(i) - from.col(i)).norm();
    }
  }
  std::vector<double> shares(owned, 1);
  double fraction = 1;
  for (const ContactPair& pair : near_) {
    const double whole_room = std::min(room_share * pair.distance, pair.distance - least_gap * pair.barrier.thickness);
    const auto [a, b, c, d] = pair.points;
    if (furthest[a] + furthest[b] + std::max(furthest[c], furthest[d]) <= whole_room) {
      continue;  // whichever of them are on the same side
    }
    const Eigen::Array4d levels = pair.inwards(from);  // of the points: how much nearer they come to the other feature
    Eigen::Array4d wanted = Eigen::Array4d::Zero();
    for (int k = 0; k < 4; ++k) {
      const ContactMesh::Particles particles = mesh_.particles(pair.points[k]);
      for (const PetscInt i : particles) {  // Any of them may be constrained back by others.
        wanted[k] += particles.weight() * std::max(pair.inwards(k).dot(to.col(i) - from.col(i)), 0.0);
      }
    }
    const Eigen::Array2d level = pair.largest(levels);  // of the features
    const Eigen::Array2d wants = pair.largest(levels + wanted) - level;
    const double clearance = std::max(whole_room - level[0] - level[1], 0.0);
    if (wants[0] + wants[1] <= clearance) {
      continue;
    }
    fraction = std::min(fraction, clearance / (wants[0] + wants[1]));
    for (int k = 0; k < 4; ++k) {
      const bool is_second = pair.is_second(k);
      const double most = level[is_second] + std::max(clearance / 2, clearance - wants[!is_second]);
      if (levels[k] + wanted[k] <= most) {
        continue;
      }
      const double of_point = (most - levels[k]) / wanted[k];
      for (const PetscInt i : mesh_.particles(pair.points[k])) {
        if (i < owned && pair.inwards(k).dot(to.col(i) - from.col(i)) > 0) {
          double& least = shares[i];
          least = std::min(least, of_point);
        }
      }
    }
  }
  fraction = min_over_ranks(surface_.comm(), fraction);
  if (fraction == 1) {
    return false;
  }
  any_held_ = true;
  if (how == StepLimit::all_alike) {
    step *= fraction;
  } else {
    shorten(shares, step);
  }
  return true;
}

/// Shortens the steps of drawn particles, and those of lattice points by the mean of their cells' corners. Collective.
/// @param fractions of the owned particles' ways
void SurfaceContact::shorten(const std::vector<double>& shares, Eigen::Ref<Eigen::Matrix3Xd> step) {
  Field& back = trial_;
  for (PetscInt i = 0; i < surface_.particles().owned; ++i) {
    back.vector(i) = (shares[i] - 1) * step.col(i);
  }
  back.update_ghosts();
  for (PetscInt e = 0; e < surface_.elements().owned; ++e) {
    const ContactSurface::Element& element = surface_.element(e);
    if (element.lattice >= 0 && !constrained_[element.lattice]) {
      for (const PetscInt corner : element.corners) {
        back.vector(element.lattice) += back.vector(corner) / 4;
      }
    }
  }
  step += back.values().leftCols(step.cols());
}

double SurfaceContact::value(const Field& x) const {
  double sum = 0;
  for (const Contact& contact : pressing(x)) {
    sum += counts(*contact.pair) ? contact.pair->barrier.value(contact.gap) : 0;
  }
  return sum + friction_energy();
}

/// Energy of friction on this rank, with the particles at `places_` [J].
double SurfaceContact::friction_energy() const {
  double sum = 0;
  for (const Rubbing& rubbing : rubbing_) {
    if (rubbing.counts) {
      sum += rubbing.force * slip_.value(slip_of(rubbing).norm());
    }
  }
  return sum;
}

void SurfaceContact::Stencil::spread(const Eigen::Vector3d& force, Eigen::Matrix3Xd& sum) const {
  for (std::size_t k = 0; k < count; ++k) {
    if (particles[k] < sum.cols()) {
      sum.col(particles[k]) += weights[k] * force;
    }
  }
}

double SurfaceContact::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const double pressing = add_pressing(x, gradient);
  add_friction(gradient);
  return pressing + friction_energy();
}

/// Adds the derivative of the barriers' energy. Sets `places_`. @returns that energy, on this rank [J]. Collective.
double SurfaceContact::add_pressing(const Field& x, Eigen::Matrix3Xd& gradient) const {
  double sum = 0;
  for (const Contact& contact : pressing(x)) {
    const Barrier& barrier = contact.pair->barrier;
    sum += counts(*contact.pair) ? barrier.value(contact.gap) : 0;
    contact.stencil.spread(barrier.slope(contact.gap) * contact.normal, gradient);
  }
  return sum;
}

/// Adds the derivative of the energy of friction, with the particles at `places_`.
void SurfaceContact::add_friction(Eigen::Matrix3Xd& gradient) const {
  for (const Rubbing& rubbing : rubbing_) {
    const Eigen::Vector3d slip = slip_of(rubbing);
    rubbing.stencil.spread(rubbing.force * slip_.slope_over(slip.norm()) * slip, gradient);
  }
}

std::vector<ContactWork> SurfaceContact::work(const Field& x) const {
  Eigen::Matrix3Xd pressing = Eigen::Matrix3Xd::Zero(3, surface_.particles().owned);
  Eigen::Matrix3Xd friction = pressing;
  add_pressing(x, pressing);
  add_friction(friction);
  std::vector<ContactWork> works(joined().parts());
  for (std::size_t p = 0; p < works.size(); ++p) {
    const PetscInt first = joined().first_owned(p);
    for (PetscInt i = first; i < first + joined().owned(p); ++i) {
      const Eigen::Vector3d displacement = x.vector(i) - start_.vector(i);
      works[p].pressing -= displacement.dot(pressing.col(i));
      works[p].friction -= displacement.dot(friction.col(i));
    }
  }
  static_assert(sizeof(ContactWork) == 2 * sizeof(double));
  MPI_Allreduce(MPI_IN_PLACE, works.data(), 2 * static_cast<int>(works.size()), MPI_DOUBLE, MPI_SUM, surface_.comm());
  return works;
}

/// The largest fraction of its clearance that a pair has used, on this rank. Sets `places_`. Collective.
double SurfaceContact::room_used(const Field& x) const {
  mesh_.write_points(x, places_);
  double largest = 0;
  if (near_.empty()) {  // Before the first step there are no places to measure from either.
    return largest;
  }
  const Eigen::Matrix3Xd moved = places_ - reference_;
  for (const ContactPair& pair : near_) {
    largest = std::max(largest, pair.largest(pair.inwards(moved)).sum() / (room_share * pair.distance));
  }
  return largest;
}

/// Slip of a contact with friction since the step's start, with the particles at `places_` [m].
Eigen::Vector3d SurfaceContact::slip_of(const Rubbing& rubbing) const {
  const Stencil& stencil = rubbing.stencil;
  Eigen::Vector3d moved = -rubbing.start;
  for (std::size_t k = 0; k < stencil.count; ++k) {
    moved += stencil.weights[k] * places_.col(stencil.particles[k]);
  }
  return along_surface(moved, rubbing.normal);
}

/// Adds the numbers in the pattern of every two particles of a stencil: of the first with itself, of the second with
/// the first, with itself, and so on. Pairs that are missing are added to the pattern with their opposites.
void SurfaceContact::add_places(const Stencil& stencil, std::vector<std::size_t>& places) {
  const auto global = [&](std::size_t k) { return mesh_.reach().to_global(stencil.particles[k]); };
  for (std::size_t k = 0; k < stencil.count; ++k) {
    for (std::size_t l = 0; l <= k; ++l) {
      const bool is_first = global(k) <= global(l);
      const auto [first, second] = is_first ? std::pair(k, l) : std::pair(l, k);
      const auto key = static_cast<std::uint64_t>(global(first)) * mesh_.reach().global + global(second);
      const auto [known, is_missing] = number_.emplace(key, pattern_.size());
      if (is_missing) {
        pattern_.push_back({stencil.particles[first], global(second)});
        pattern_.push_back({stencil.particles[second], global(first)});
      }
      places.push_back(is_first ? known->second : known->second + 1);
    }
  }
}

void SurfaceContact::update_hessian(const Field& x, double psd_blend) {
  kept_curvature_ = 1 - psd_blend;
  if (kept_curvature_ > 0) {
    mesh_.write_points(x, curved_at_);
  }
}

void SurfaceContact::add_hessian(const HessianBlocks& blocks) const {
  LowerBlocks lower;
  const auto add = [&](const Stencil& stencil, const std::size_t* place) {
    const Eigen::Matrix3d* block = lower.data();
    for (std::size_t k = 0; k < stencil.count; ++k) {
      for (std::size_t l = 0; l < k; ++l, ++place, ++block) {
        blocks.add(*place, *block);
        blocks.add(*place ^ 1, block->transpose());
      }
      blocks.add(*place++, *block++);
    }
    return place;
  };
  const auto spread = [&lower](const Stencil& stencil, const Eigen::Matrix3d& stiffness) {
    for (std::size_t k = 0, n = 0; k < stencil.count; ++k) {
      for (std::size_t l = 0; l <= k; ++l, ++n) {
        lower[n] = stencil.weights[k] * stencil.weights[l] * stiffness;
      }
    }
  };
  const std::size_t* of_rubbing = places_of_rubbing_.data();
  for (const Rubbing& rubbing : rubbing_) {
    spread(rubbing.stencil, rubbing.force * rubbing.tangent.hessian(slip_, rubbing.normal));
    of_rubbing = add(rubbing.stencil, of_rubbing);
  }
  const std::size_t* of_curved = places_of_curved_.data();
  for (const Contact& contact : curved_) {
    const auto& [pair, stencil, gap, normal] = contact;
    spread(stencil, pair->barrier.curvature(gap) * normal * normal.transpose());
    if (kept_curvature_ > 0 && gap > 0) {
      add_curvature(contact, lower);
    }
    of_curved = add(stencil, of_curved);
  }
}

/// Adds the term of the curvature of a gap to the second derivative.
void SurfaceContact::add_curvature(const Contact& contact, LowerBlocks& lower) const {
  const ContactPair& pair = *contact.pair;
  const Stencil& stencil = contact.stencil;
  const Eigen::Matrix<double, 12, 12> stiffness =
      kept_curvature_ * pair.barrier.slope(contact.gap) * pair.gap_curvature(curved_at_);
  std::array<std::array<std::size_t, 4>, 4> numbers{};  // in the stencil, of the points' particles
  std::array<std::size_t, 4> count{};
  for (std::size_t k = 0; k < 4; ++k) {
    for (const PetscInt particle : mesh_.particles(pair.points[k])) {
      if (const std::size_t i = stencil.find(particle); i < stencil.count) {
        numbers[k][count[k]++] = i;  // Otherwise the point is not among the nearest.
      }
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t l = 0; l < 4; ++l) {
      const double weight = mesh_.particles(pair.points[k]).weight() * mesh_.particles(pair.points[l]).weight();
      const Eigen::Matrix3d of_points =
          weight * stiffness.block<3, 3>(3 * static_cast<Eigen::Index>(k), 3 * static_cast<Eigen::Index>(l));
      for (std::size_t m = 0; m < count[k]; ++m) {
        for (std::size_t n = 0; n < count[l]; ++n) {
          if (const std::size_t i = numbers[k][m], j = numbers[l][n]; i >= j) {
            lower[i * (i + 1) / 2 + j] += of_points;
          }
        }
      }
    }
  }
}

std::vector<double> SurfaceContact::load(std::size_t part) const {
  const auto first = load_.begin() + joined().first_owned(part);
  return {first, first + joined().owned(part)};
}

void SurfaceContact::push_apart(Field& x) {
  constexpr int most_sweeps = 100;
  constexpr int most_tries = 8;
  constexpr double enough = 0.9;  // of the thickness
  const PetscInt owned = surface_.particles().owned;
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    prepare(x, x, x, 1);
    if (figures(x).smallest_gap >= enough * thickness()) {
      return;
    }
    Field mobility(mesh_.reach(), 1);  // 0 of what is constrained, otherwise 1
    for (PetscInt i = 0; i < owned; ++i) {
      mobility.data()[i] = constrained_[i] ? 0 : 1;
    }
    mobility.update_ghosts();
    Eigen::Matrix4Xd pushes = Eigen::Matrix4Xd::Zero(4, owned);  // sums, and how many
    for (const Contact& contact : pressing(x)) {
      const auto& [pair, whole, gap, normal] = contact;
      double compliance = 1 / pair->barrier.stiffness;
      for (std::size_t k = 0; k < whole.count; ++k) {
        compliance += whole.weights[k] * whole.weights[k] * mobility.data()[whole.particles[k]];
      }
      const double push = (pair->barrier.thickness - gap) / compliance;
      for (std::size_t k = 0; k < whole.count; ++k) {
        if (const PetscInt i = whole.particles[k]; i < owned) {
          pushes.col(i).head<3>() += push * whole.weights[k] * mobility.data()[i] * normal;
          pushes(3, i) += 1;
        }
      }
    }
    Eigen::Matrix3Xd target = x.values().leftCols(owned);
    for (PetscInt i = 0; i < owned; ++i) {
      target.col(i) += pushes.col(i).head<3>() / std::max(pushes(3, i), 1.0);
    }
    bool is_short = true;
    for (int n = 0; is_short && n < most_tries; ++n) {
      Eigen::Matrix3Xd step = target - x.values().leftCols(owned);
      is_short = limit(x, StepLimit::each_vertex, step);
      x.values().leftCols(owned) += step;
      x.update_ghosts();
    }
  }
}

ContactFigures SurfaceContact::figures(const Field& x) const {
  ContactFigures figures{0, thickness()};
  for (const Contact& contact : pressing(x)) {
    if (counts(*contact.pair)) {
      ++figures.contacts;
      figures.smallest_gap = std::min(figures.smallest_gap, contact.gap);
      figures.energy += contact.pair->barrier.value(contact.gap);
    }
  }
  figures.energy = sum_over_ranks(surface_.comm(), figures.energy);
  figures.contacts = sum_over_ranks(surface_.comm(), figures.contacts);
  figures.smallest_gap = min_over_ranks(surface_.comm(), figures.smallest_gap);
  figures.searches = searches_;
  figures.room_used = std::min(std::max(room_used_, room_used(x)), 1.0);
  figures.room_used = max_over_ranks(surface_.comm(), figures.room_used);
  return figures;
}

}  // namespace pellicle::contact
