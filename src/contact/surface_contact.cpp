#include "contact/surface_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "parallel/collective.h"

namespace pellicle {
inline namespace contact {

namespace {

/// Share of a distance that each side may take away before it is measured again.
constexpr double bound_share = 0.45;
/// Of the thickness: how far a particle may want to go that is not expected to move.
constexpr double least_reach = 0.25;
/// Likewise, how far one may want to go at most, be it expected or not: beyond it pairs are sought once more on the
/// way.
constexpr double largest_reach = 4;
/// How much further than expected.
constexpr double more_reach = 1.5;

/// Share of the way from one displacement to another, beyond a bound, that is within it.
double share_within(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double bound) {
  const Eigen::Vector3d way = to - from;
  const double a = way.squaredNorm();
  const double b = from.dot(way);
  const double c = std::min(from.squaredNorm() - bound * bound, 0.0);
  return a > 0 ? std::clamp((std::sqrt(b * b - a * c) - b) / a, 0.0, 1.0) : 0;
}

}  // namespace

SurfaceContact::SurfaceContact(const std::vector<ContactSurface::Part>& parts, const ContactOptions& options,
                               bool is_free)
    : surface_(parts),
      options_(options),
      is_free_(is_free),
      thickness_(surface_.largest_thickness()),
      mesh_(surface_),
      start_(surface_.particles(), 3),
      trial_(surface_.particles(), 3) {}

void SurfaceContact::Stencil::add(PetscInt particle, double weight) {
  for (int k = 0; k < count; ++k) {
    if (particles[static_cast<std::size_t>(k)] == particle) {
      weights[static_cast<std::size_t>(k)] += weight;
      return;
    }
  }
  particles[static_cast<std::size_t>(count)] = particle;
  weights[static_cast<std::size_t>(count)] = weight;
  ++count;
}

SurfaceContact::Stencil SurfaceContact::stencil(const ContactPair& pair, const std::array<double, 4>& weights) const {
  Stencil stencil;
  for (std::size_t k = 0; k < 4; ++k) {
    const ContactMesh::Particles particles = mesh_.particles(pair.points[k]);
    for (const PetscInt i : particles) {
      stencil.add(i, weights[k] * particles.weight());
    }
  }
  return stencil;
}

/// Of a sum over all ranks each pair is a part of one: that of the particle with the lowest number.
bool SurfaceContact::counts(const Stencil& stencil) const {
  PetscInt lowest = stencil.particles[0];
  for (int k = 1; k < stencil.count; ++k) {
    const PetscInt i = stencil.particles[static_cast<std::size_t>(k)];
    lowest = mesh_.reach().to_global(i) < mesh_.reach().to_global(lowest) ? i : lowest;
  }
  return lowest < mesh_.reach().owned;
}

/// What all particles have in common. Collective.
Eigen::Vector3d SurfaceContact::mean_step(const Field& start, const Field& x) const {
  const PetscInt owned = surface_.particles().owned;
  Eigen::Vector3d sum = (x.values() - start.values()).leftCols(owned).rowwise().sum();
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, surface_.comm());
  return sum / static_cast<double>(surface_.particles().global);
}

void SurfaceContact::prepare(const Field& start, const Field& x, double h, Field& begin) {
  h_ = h;
  slip_.e = h * options_.slip_speed;
  searches_ = 0;
  start_.values() = start.values();
  const Layout& particles = surface_.particles();
  const Eigen::Vector3d together = is_free_ ? mean_step(start, x) : Eigen::Vector3d::Zero();
  reach_.resize(static_cast<std::size_t>(particles.local()));
  for (PetscInt i = 0; i < particles.local(); ++i) {
    const double travel = (x.vector(i) - start.vector(i) - together).norm();
    reach_[static_cast<std::size_t>(i)] =
        std::clamp(more_reach * travel, least_reach * thickness_, largest_reach * thickness_);
  }
  rubbing_.clear();
  search(start);
  note_rubbing(start);
  find_rubbing_stencils();
  reference_.colwise() += together;
  begin.values() = start.values().colwise() + together;
}

void SurfaceContact::start_from(const Field& start, Field& x, double h) {
  prepare(start, x, h, trial_);
  const PetscInt owned = surface_.particles().owned;
  Eigen::Matrix3Xd step = (x.values() - trial_.values()).leftCols(owned);
  x.values() = trial_.values();
  limit(x, StepLimit::all_alike, step);
  x.values().leftCols(owned) += step;
  x.update_ghosts();
}

/// Pairs and bounds from here on. Collective.
void SurfaceContact::search(const Field& x) {
  ++searches_;
  std::vector<double> margins = reach_;
  for (double& margin : margins) {
    margin += thickness_ / 2;
  }
  update_ghosts(surface_.particles(), margins);
  std::vector<PetscInt> further;
  for (const Rubbing& rubbing : rubbing_) {
    for (const auto& [particle, weight] : rubbing.particles) {
      further.push_back(particle);
    }
  }
  mesh_.gather(x, start_, margins, further);
  mesh_.write_points(x, places_);
  ContactPairs found = find_contact_pairs(mesh_, places_, options_.surface_stiffness());
  const auto owned = static_cast<std::size_t>(surface_.particles().owned);
  bound_.assign(reach_.begin(), reach_.begin() + static_cast<std::ptrdiff_t>(owned));
  for (PetscInt point = 0; point < mesh_.points(); ++point) {
    for (const PetscInt i : mesh_.particles(point)) {
      if (i < surface_.particles().owned) {
        double& bound = bound_[static_cast<std::size_t>(i)];
        bound = std::min(bound, bound_share * found.nearest[static_cast<std::size_t>(point)]);
      }
    }
  }
  find_rubbing_stencils();
  reference_ = places_;
  near_ = std::move(found.pairs);
  pairs_.clear();
  std::copy_if(near_.begin(), near_.end(), std::back_inserter(pairs_),
               [this](const ContactPair& pair) { return can_touch(pair); });
  wanted_.assign(owned, 0);
  any_held_ = false;
  blocks_.clear();  // They were in another reach.
  curved_.reset();
}

/// Whether a pair comes to press where its ends may go.
bool SurfaceContact::can_touch(const ContactPair& pair) const {
  const auto reach = [&](std::size_t first, std::size_t last) {
    double largest = 0;
    for (std::size_t k = first; k < last; ++k) {
      largest = std::max(largest, mesh_.margin(pair.points[k]) - thickness_ / 2);
    }
    return largest;
  };
  const auto split = static_cast<std::size_t>(pair.first_feature());
  const double nearer = std::min(reach(0, split) + reach(split, 4), 2 * bound_share * pair.distance);
  return pair.barrier.stiffness > 0 && pair.distance - nearer < pair.barrier.thickness;
}

/// Calls `take` with each pair that presses when the particles are at x, the stencil of the way between its nearest
/// points, its gap, and the normal, towards the first feature, which is 0 where there is no gap. Leaves the places of
/// the points in `places_`. Collective.
template <class Take>
void SurfaceContact::visit_pressing(const Field& x, const Take& take) const {
  mesh_.write_points(x, places_);
  for (const ContactPair& pair : pairs_) {
    const NearestPoints nearest = pair.nearest(places_);
    const double gap = nearest.apart.norm();
    if (gap < pair.barrier.thickness) {
      take(pair, stencil(pair, nearest.weights), gap, Eigen::Vector3d(nearest.apart / (gap > 0 ? gap : 1)));
    }
  }
}

void SurfaceContact::note_rubbing(const Field& x) {
  if (options_.friction == 0) {
    return;
  }
  visit_pressing(x, [this](const ContactPair& pair, const Stencil& whole, double gap, const Eigen::Vector3d& normal) {
    if (gap == 0) {
      return;
    }
    Rubbing rubbing;
    for (int k = 0; k < whole.count; ++k) {
      rubbing.particles.emplace_back(mesh_.reach().to_global(whole.particles[static_cast<std::size_t>(k)]),
                                     whole.weights[static_cast<std::size_t>(k)]);
    }
    rubbing.normal = normal;
    rubbing.start = gap * normal;
    rubbing.force = -options_.friction * pair.barrier.slope(gap);
    rubbing.counts = counts(whole);
    rubbing_.push_back(std::move(rubbing));
  });
}

/// Pairs from where bounds have held particles back. Collective.
void SurfaceContact::search_further(const Field& x) {
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    const double reach = std::min(more_reach * wanted_[i], largest_reach * thickness_);
    reach_[i] = std::max(reach_[i], reach);
  }
  search(x);
}

void SurfaceContact::move_on(const Field& x) {
  if (any_held_) {
    search_further(x);
  }
  find_blocks(x);
  extend_pattern();
}

/// Share of the way that two features may go, when their ends go `from` one displacement `to` another; 1 or less.
double SurfaceContact::relative_share(const ContactPair& pair, const Eigen::Matrix3Xd& from,
                                      const Eigen::Matrix3Xd& to) const {
  const double room = 2 * bound_share * pair.distance;
  double share = 1;
  const auto split = static_cast<std::size_t>(pair.first_feature());
  for (std::size_t k = 0; k < split; ++k) {
    for (std::size_t l = split; l < 4; ++l) {
      const Eigen::Vector3d end = to.col(pair.points[k]) - to.col(pair.points[l]);
      if (end.squaredNorm() > room * room) {
        share = std::min(share, share_within(from.col(pair.points[k]) - from.col(pair.points[l]), end, room));
      }
    }
  }
  return share;
}

bool SurfaceContact::limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) const {
  const PetscInt owned = surface_.particles().owned;
  Eigen::Matrix3Xd from;
  Eigen::Matrix3Xd to;
  mesh_.write_points(x, from);
  from -= reference_;
  bool is_shortened = false;
  double share = 1;
  for (PetscInt i = 0; i < owned; ++i) {
    const auto particle = static_cast<std::size_t>(i);
    const Eigen::Vector3d end = from.col(i) + step.col(i);
    if (end.norm() > reach_[particle]) {
      is_shortened = true;
      wanted_[particle] = end.norm();
      if (how == StepLimit::each_vertex) {
        step.col(i) = end * (reach_[particle] / end.norm()) - from.col(i);
      } else {
        share = std::min(share, share_within(from.col(i), end, reach_[particle]));
      }
    }
  }
  const auto find_ends = [&] {
    trial_.values().leftCols(owned) = x.values().leftCols(owned) + step;
    if (!mesh_.reaches_further()) {
      trial_.update_ghosts();
    }
    mesh_.write_points(trial_, to);
    to -= reference_;
  };
  find_ends();
  if (how == StepLimit::all_alike) {
    for (const ContactPair& pair : near_) {
      share = std::min(share, relative_share(pair, from, to));
    }
    MPI_Allreduce(MPI_IN_PLACE, &share, 1, MPI_DOUBLE, MPI_MIN, surface_.comm());
    step *= share;
    is_shortened = share < 1;
  } else {
    std::vector<bool> is_bound(static_cast<std::size_t>(owned), false);
    for (bool goes_on = true; goes_on;) {
      goes_on = false;
      for (const ContactPair& pair : near_) {
        if (relative_share(pair, to, to) == 1) {  // Else it is 0: the way begins too far.
          continue;
        }
        for (const PetscInt point : pair.points) {
          for (const PetscInt i : mesh_.particles(point)) {
            if (i >= owned || is_bound[static_cast<std::size_t>(i)]) {
              continue;
            }
            const double bound = bound_[static_cast<std::size_t>(i)];
            is_bound[static_cast<std::size_t>(i)] = true;
            if (const double length = to.col(i).norm(); length > bound) {
              step.col(i) = to.col(i) * (bound / length) - from.col(i);
              goes_on = true;
            }
          }
        }
      }
      goes_on = on_any_rank(surface_.comm(), goes_on);
      is_shortened = is_shortened || goes_on;
      if (goes_on) {
        find_ends();
      }
    }
    is_shortened = on_any_rank(surface_.comm(), is_shortened);
  }
  any_held_ = any_held_ || is_shortened;
  return is_shortened;
}

double SurfaceContact::value(const Field& x) const {
  double sum = 0;
  visit_pressing(x, [&](const ContactPair& pair, const Stencil& stencil, double gap, const Eigen::Vector3d&) {
    sum += counts(stencil) ? pair.barrier.value(gap) : 0;
  });
  for (std::size_t r = 0; r < rubbing_.size(); ++r) {
    if (rubbing_[r].counts) {
      sum += rubbing_[r].force * slip_.value(slip_of(r).norm());
    }
  }
  return sum;
}

void SurfaceContact::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const auto add = [&](const Stencil& stencil, const Eigen::Vector3d& force) {
    for (int k = 0; k < stencil.count; ++k) {
      if (const PetscInt i = stencil.particles[static_cast<std::size_t>(k)]; i < gradient.cols()) {
        gradient.col(i) += stencil.weights[static_cast<std::size_t>(k)] * force;
      }
    }
  };
  visit_pressing(x, [&](const ContactPair& pair, const Stencil& stencil, double gap, const Eigen::Vector3d& normal) {
    add(stencil, pair.barrier.slope(gap) * normal);
  });
  for (std::size_t r = 0; r < rubbing_.size(); ++r) {
    const Eigen::Vector3d slip = slip_of(r);
    add(rubbing_stencils_[r], rubbing_[r].force * slip_.slope_over(slip.norm()) * slip);
  }
}

/// How far what rubs has slipped since the step's start, with the particles where `places_` has them [m].
Eigen::Vector3d SurfaceContact::slip_of(std::size_t number) const {
  const Stencil& stencil = rubbing_stencils_[number];
  const Rubbing& rubbing = rubbing_[number];
  Eigen::Vector3d moved = -rubbing.start;
  for (int k = 0; k < stencil.count; ++k) {
    moved += stencil.weights[static_cast<std::size_t>(k)] * places_.col(stencil.particles[static_cast<std::size_t>(k)]);
  }
  return moved - rubbing.normal * rubbing.normal.dot(moved);
}

void SurfaceContact::find_rubbing_stencils() {
  rubbing_stencils_.clear();
  for (const Rubbing& rubbing : rubbing_) {
    Stencil& stencil = rubbing_stencils_.emplace_back();
    for (const auto& [particle, weight] : rubbing.particles) {
      stencil.add(mesh_.find(particle), weight);
    }
  }
}

/// Collective.
void SurfaceContact::find_blocks(const Field& x) {
  blocks_.clear();
  curved_.reset();
  visit_pressing(x, [&](const ContactPair& pair, const Stencil& stencil, double gap, const Eigen::Vector3d& normal) {
    blocks_.push_back({stencil, pair.barrier.curvature(gap) * normal * normal.transpose()});
  });
  for (std::size_t r = 0; r < rubbing_.size(); ++r) {
    Rubbing& rubbing = rubbing_[r];
    rubbing.tangent.move_to(slip_, slip_of(r));
    blocks_.push_back({rubbing_stencils_[r], rubbing.force * rubbing.tangent.hessian(slip_, rubbing.normal)});
  }
}

void SurfaceContact::update_hessian(const Field& x, Curvature curvature) {
  kept_curvature_ = curvature == Curvature::positive ? 0 : 1 - positive_share_;
  if (kept_curvature_ > 0 && !curved_) {
    find_curved(x);
  }
}

/// What the exact second derivative has beyond the blocks. Collective.
void SurfaceContact::find_curved(const Field& x) {
  curved_.emplace();
  visit_pressing(x, [&](const ContactPair& pair, const Stencil&, double gap, const Eigen::Vector3d&) {
    if (gap > 0) {
      curved_->push_back({pair.points, pair.barrier.slope(gap) * pair.gap_curvature(places_)});
    }
  });
}

/// Calls `take` with the owned particle, the global number of the other and the product of their weights.
template <class Take>
void SurfaceContact::visit_couplings(const Stencil& stencil, const Take& take) const {
  for (std::size_t k = 0; k < static_cast<std::size_t>(stencil.count); ++k) {
    const PetscInt row = stencil.particles[k];
    for (std::size_t l = 0; l < static_cast<std::size_t>(stencil.count) && row < surface_.particles().owned; ++l) {
      take(row, mesh_.reach().to_global(stencil.particles[l]), stencil.weights[k] * stencil.weights[l]);
    }
  }
}

/// By what the present blocks couple. What has touched before stays in the pattern, which costs less than a new one.
/// Collective.
void SurfaceContact::extend_pattern() {
  columns_.resize(static_cast<std::size_t>(surface_.particles().owned));
  bool is_longer = false;
  for (const Block& block : blocks_) {
    visit_couplings(block.stencil, [&](PetscInt row, PetscInt column, double) {
      std::vector<PetscInt>& columns = columns_[static_cast<std::size_t>(row)];
      const auto place = std::lower_bound(columns.begin(), columns.end(), column);
      if (place == columns.end() || *place != column) {
        columns.insert(place, column);
        is_longer = true;
      }
    });
  }
  if (on_any_rank(surface_.comm(), is_longer)) {
    ++version_;
    offsets_.assign(1, 0);
    for (const std::vector<PetscInt>& columns : columns_) {
      offsets_.push_back(offsets_.back() + static_cast<PetscInt>(columns.size()));
    }
  }
}

std::vector<VertexPair> SurfaceContact::pattern() const {
  std::vector<VertexPair> pairs;
  for (std::size_t row = 0; row < columns_.size(); ++row) {
    for (const PetscInt column : columns_[row]) {
      pairs.push_back({static_cast<PetscInt>(row), column});
    }
  }
  return pairs;
}

/// In the pattern.
std::size_t SurfaceContact::place_of(PetscInt row, PetscInt column) const {
  const std::vector<PetscInt>& columns = columns_[static_cast<std::size_t>(row)];
  const auto place = std::lower_bound(columns.begin(), columns.end(), column);
  return static_cast<std::size_t>(offsets_[static_cast<std::size_t>(row)] + (place - columns.begin()));
}

void SurfaceContact::add_hessian(const HessianBlocks& blocks) const {
  for (const Block& block : blocks_) {
    visit_couplings(block.stencil, [&](PetscInt row, PetscInt column, double weight) {
      blocks.add(place_of(row, column), weight * block.stiffness);
    });
  }
  for (std::size_t c = 0; kept_curvature_ > 0 && c < curved_->size(); ++c) {
    const Curved& curved = (*curved_)[c];
    for (int k = 0; k < 4; ++k) {
      const ContactMesh::Particles rows = mesh_.particles(curved.points[static_cast<std::size_t>(k)]);
      for (int l = 0; l < 4; ++l) {
        const ContactMesh::Particles others = mesh_.particles(curved.points[static_cast<std::size_t>(l)]);
        const Eigen::Matrix3d block =
            kept_curvature_ * rows.weight() * others.weight() * curved.stiffness.block<3, 3>(3 * k, 3 * l);
        for (const PetscInt row : rows) {
          for (const PetscInt other : others) {
            if (row < surface_.particles().owned) {
              blocks.add(place_of(row, mesh_.reach().to_global(other)), block);
            }
          }
        }
      }
    }
  }
}

void SurfaceContact::forget() {
  columns_.clear();
  blocks_.clear();
  ++version_;
}

void SurfaceContact::correct(Field& before, Field& x, const std::vector<double>& mass, const std::vector<bool>& held) {
  const PetscInt owned = surface_.particles().owned;
  const auto go = [&] {  // from `before` to x, or as far as there is room
    const Eigen::Matrix3Xd target = x.values().leftCols(owned);
    constexpr int most = 8;
    for (int n = 0; n < most; ++n) {
      Eigen::Matrix3Xd step = target - before.values().leftCols(owned);
      const bool is_short = limit(before, StepLimit::each_vertex, step);
      before.values().leftCols(owned) += step;
      before.update_ghosts();
      if (!is_short) {
        break;
      }
      search_further(before);
    }
    x.values() = before.values();
  };
  go();
  Field mobility(mesh_.reach(), 1);  // 1/m, 0 of what is held
  for (PetscInt i = 0; i < owned; ++i) {
    const auto particle = static_cast<std::size_t>(i);
    mobility.data()[i] = held[particle] || mass[particle] == 0 ? 0 : 1 / mass[particle];
  }
  mobility.update_ghosts();
  Eigen::Matrix4Xd pushes = Eigen::Matrix4Xd::Zero(4, owned);  // sums, and how many
  visit_pressing(x, [&](const ContactPair& pair, const Stencil& whole, double gap, const Eigen::Vector3d& normal) {
    double compliance = 1 / (pair.barrier.curvature(0) * h_ * h_);
    for (std::size_t k = 0; k < static_cast<std::size_t>(whole.count); ++k) {
      compliance += whole.weights[k] * whole.weights[k] * mobility.data()[whole.particles[k]];
    }
    const double push = (pair.barrier.thickness - gap) / compliance;
    for (std::size_t k = 0; k < static_cast<std::size_t>(whole.count); ++k) {
      if (const PetscInt i = whole.particles[k]; i < owned && whole.weights[k] != 0) {
        pushes.col(i).head<3>() += push * whole.weights[k] * mobility.data()[i] * normal;
        pushes(3, i) += 1;
      }
    }
  });
  for (PetscInt i = 0; i < owned; ++i) {
    x.vector(i) += pushes.col(i).head<3>() / std::max(pushes(3, i), 1.0);
  }
  go();
}

ContactFigures SurfaceContact::figures(const Field& x) const {
  ContactFigures figures;
  double smallest = thickness_;
  visit_pressing(x, [&](const ContactPair& pair, const Stencil& stencil, double gap, const Eigen::Vector3d&) {
    if (counts(stencil)) {
      ++figures.contacts;
      smallest = std::min(smallest, gap);
      figures.energy += pair.barrier.value(gap);
    }
  });
  MPI_Allreduce(MPI_IN_PLACE, &figures.energy, 1, MPI_DOUBLE, MPI_SUM, surface_.comm());
  MPI_Allreduce(MPI_IN_PLACE, &figures.contacts, 1, MPIU_INT, MPI_SUM, surface_.comm());
  MPI_Allreduce(&smallest, &figures.smallest_gap, 1, MPI_DOUBLE, MPI_MIN, surface_.comm());
  figures.searches = searches_;
  return figures;
}

}  // namespace contact
}  // namespace pellicle
