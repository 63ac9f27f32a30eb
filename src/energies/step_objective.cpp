#include "energies/step_objective.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::energies {

namespace {

/// Least force scale of a residual, as a fraction of the part's force scale: a balloon at rest has no forces.
constexpr double negligible_force = 1e-6;

std::vector<Layout> vertices_of(const std::vector<StepPart*>& parts) {
  std::vector<Layout> layouts;
  std::transform(parts.begin(), parts.end(), std::back_inserter(layouts),
                 [](const StepPart* part) { return part->vertices(); });
  return layouts;
}

}  // namespace

PartPotential::PartPotential(Potential& potential, const JoinedLayout& joined, std::size_t part, const Layout& vertices)
    : potential_(potential), joined_(joined), part_(part), vertices_(vertices), place_(vertices, 3) {}

void PartPotential::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  own_.setZero(3, vertices_.owned);
  potential_.add_gradient(taken(x), own_);
  gradient.middleCols(joined_.first_owned(part_), vertices_.owned) += own_;
}

std::vector<VertexPair> PartPotential::pattern() const {
  std::vector<VertexPair> pairs = potential_.pattern();
  for (VertexPair& pair : pairs) {
    pair = {joined_.local(part_, pair.row), joined_.global(part_, pair.column)};
  }
  return pairs;
}

bool PartPotential::limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) {
  auto own = step.middleCols(joined_.first_owned(part_), vertices_.owned);
  if (how != StepLimit::all_alike) {
    return potential_.limit(taken(x), how, own);
  }
  const double before = sum_over_ranks(vertices_.comm, own.squaredNorm());
  const bool limits = potential_.limit(taken(x), how, own);
  const double after = sum_over_ranks(vertices_.comm, own.squaredNorm());
  if (after < before) {  // The steps of the other parts are shortened by the same fraction.
    const Eigen::Matrix3Xd shortened = own;
    step *= std::sqrt(after / before);
    own = shortened;
  }
  return limits;
}

void PartPotential::add_product(const double* w, double* result) const {
  const PetscInt local = vertices_.local();
  own_.resize(3, local);
  more_.setZero(3, local);
  for (PetscInt i = 0; i < local; ++i) {
    own_.col(i) = Eigen::Map<const Eigen::Vector3d>(w + 3 * joined_.local(part_, i));
  }
  potential_.add_product(own_.data(), more_.data());
  for (PetscInt i = 0; i < local; ++i) {
    Eigen::Map<Eigen::Vector3d>(result + 3 * joined_.local(part_, i)) += more_.col(i);
  }
}

StepObjective::StepObjective(const std::vector<StepPart*>& parts, Potential* between, const Choice<TangentMatrix>& type,
                             const std::string& prefix)
    : parts_(parts), joined_(vertices_of(parts)), between_(between), position_(joined_.layout(), 3) {
  if (between_ != nullptr) {
    start_ = Field(joined_.layout(), 3);
  }
  Projectors projectors(joined_.layout().local());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const StepPart& part = *parts_[p];
    for (const PetscInt i : part.projectors().bound()) {
      projectors.bind(joined_.local(p, i), part.projectors()[i]);
    }
    for (Potential* potential : part.potentials()) {
      if (parts_.size() == 1) {  // With one part its numbers are those of the whole.
        potentials_.push_back(potential);
      } else {
        potentials_.push_back(&adapted_.emplace_back(*potential, joined_, p, part.vertices()));
      }
    }
    if (parts_.size() > 1) {
      places_.push_back({Field(part.vertices(), 3), Field(part.vertices(), 3)});
    }
  }
  if (between_ != nullptr) {
    potentials_.push_back(between_);
  }
  tangent_ = std::make_unique<Tangent>(joined_.layout(), potentials_, std::move(projectors), type, prefix);
}

std::vector<std::array<PetscInt, 3>> StepObjective::triangles() const {
  std::vector<std::array<PetscInt, 3>> all;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    for (const auto& [a, b, c] : parts_[p]->triangles()) {
      all.push_back({joined_.local(p, a), joined_.local(p, b), joined_.local(p, c)});
    }
  }
  return all;
}

/// The parts' own unknowns, one part after the other.
Eigen::VectorXd StepObjective::of_parts(Eigen::VectorXd (StepPart::*of)() const) const {
  std::vector<double> all;
  for (const StepPart* part : parts_) {
    const Eigen::VectorXd values = (part->*of)();
    all.insert(all.end(), values.begin(), values.end());
  }
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

const Field& StepObjective::place(std::size_t part, const Field& x, std::size_t which) const {
  if (parts_.size() == 1) {
    return x;
  }
  joined_.take(part, x, places_[part][which]);
  return places_[part][which];
}

bool StepObjective::begin_step(double h) {
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (between_ != nullptr) {
      joined_.put(p, parts_[p]->start(), start_);
    }
    joined_.put(p, parts_[p]->position(), position_);
  }
  if (between_ != nullptr) {
    between_->start_from(start_, position_, h);
  }
  bool all_led = true;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (between_ != nullptr) {
      parts_[p]->move_to(place(p, position_), parts_[p]->own_unknowns());
    }
    all_led = !parts_[p]->leaves_held_behind() && all_led;
  }
  return all_led;
}

void StepObjective::move_to(Vec unknowns) {
  const Eigen::Index size = of_parts(&StepPart::own_unknowns).size();
  Eigen::VectorXd own(size);
  const ConstVecValues values(unknowns);
  std::copy_n(values.data(), 3 * vertices().owned, position_.data());
  if (rank_of(comm()) == 0) {
    own = values.tail(size);
  }
  if (size > 0) {
    MPI_Bcast(own.data(), static_cast<int>(size), MPI_DOUBLE, 0, comm());
  }
  position_.update_ghosts();
  Eigen::Index first = 0;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Eigen::Index count = parts_[p]->own_unknowns().size();
    parts_[p]->move_to(place(p, position_), own.segment(first, count));
    first += count;
  }
  if (const StepPart* part = path()) {  // The time of its loads has moved what is pinned.
    position_.values() = part->position().values();
  }
}

void StepObjective::write_to(Vec unknowns) const {
  const Eigen::VectorXd own = of_parts(&StepPart::own_unknowns);
  VecValues values(unknowns);
  std::copy_n(position_.data(), 3 * vertices().owned, values.data());
  if (rank_of(comm()) == 0) {
    values.tail(own.size()) = own;
  }
}

double StepObjective::value() {
  double sum = between_ != nullptr ? sum_over_ranks(comm(), between_->value(position_)) : 0;
  for (StepPart* part : parts_) {
    sum += part->value();
  }
  return sum;
}

void StepObjective::compute_residual(Vec residual) {
  VecValues values(residual);
  Eigen::Map<Eigen::Matrix3Xd> sum(values.data(), 3, vertices().owned);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    sum.middleCols(joined_.first_owned(p), parts_[p]->vertices().owned) = parts_[p]->gradient();
  }
  if (between_ != nullptr) {
    of_between_.setZero(3, vertices().owned);
    between_->add_gradient(position_, of_between_);
    tangent_->projectors().apply(of_between_);
    sum += of_between_;
  }
  squared_residuals_.clear();
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    squared_residuals_.push_back(sum.middleCols(joined_.first_owned(p), parts_[p]->vertices().owned).squaredNorm());
  }
  const Eigen::VectorXd own = of_parts(&StepPart::own_rows);
  if (rank_of(comm()) == 0) {
    values.tail(own.size()) = own;
  }
}

double StepObjective::residual_scale(double rtol) const {
  squares_ = squared_residuals_;
  for (const StepPart* part : parts_) {
    squares_.insert(squares_.end(), part->squared_forces().begin(), part->squared_forces().end());
  }
  sum_over_ranks(comm(), squares_);
  double all = 0;
  double worst = 0;
  double largest = 0;
  auto forces = squares_.begin() + static_cast<std::ptrdiff_t>(parts_.size());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const auto behind = forces + static_cast<std::ptrdiff_t>(parts_[p]->squared_forces().size());
    const double scale =
        std::max(std::sqrt(*std::max_element(forces, behind)), negligible_force * parts_[p]->force_scale());
    const double allowed = scale * parts_[p]->tolerance() / rtol;
    forces = behind;
    largest = std::max(largest, allowed);
    all += squares_[p];
    worst = std::max(worst, std::sqrt(squares_[p]) / allowed);
  }
  return worst > 0 ? std::sqrt(all) / worst : largest;
}

std::vector<int> StepObjective::prescribed() const {
  std::vector<int> all;
  int first = 0;
  for (const StepPart* part : parts_) {
    for (const int column : part->prescribed()) {
      all.push_back(first + column);
    }
    first += part->columns();
  }
  return all;
}

double StepObjective::inverted(const Field& from, const Field& to) const {
  double sum = 0;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    sum += parts_[p]->inverted(place(p, from), place(p, to, 1));
  }
  return sum;
}

void StepObjective::limit(Vec residual, Vec descent) const {
  const PetscInt owned = vertices().owned;
  VecValues values(descent);
  Eigen::Map<Eigen::Matrix3Xd> down(values.data(), 3, owned);
  tangent_->projectors().apply(down);
  if (std::none_of(potentials_.begin(), potentials_.end(),
                   [](const Potential* potential) { return potential->limits(); })) {
    return;
  }
  const ConstVecValues forces(residual);
  const Eigen::Ref<const Eigen::Matrix3Xd> gradient = Eigen::Map<const Eigen::Matrix3Xd>(forces.data(), 3, owned);
  Eigen::Ref<Eigen::Matrix3Xd> step(down);
  step = -step;
  const Eigen::Matrix3Xd whole = step;
  const auto shorten = [&](StepLimit how) {
    bool is_shortened = false;
    for (Potential* potential : potentials_) {
      is_shortened = potential->limit(position_, how, step) || is_shortened;
    }
    return is_shortened;
  };
  if (shorten(StepLimit::each_vertex) && !(sum_over_ranks(comm(), step.cwiseProduct(gradient).sum()) < 0)) {
    step = whole;
    shorten(StepLimit::all_alike);
  }
  step = -step;
}

bool StepObjective::refresh() {
  bool goes_on = false;
  for (Potential* potential : potentials_) {
    goes_on = potential->refresh(position_) || goes_on;
  }
  if (goes_on) {
    std::for_each(parts_.begin(), parts_.end(), [](StepPart* part) { part->forget(); });
  }
  return goes_on;
}

int StepObjective::columns() const {
  return std::accumulate(parts_.begin(), parts_.end(), 0,
                         [](int sum, const StepPart* part) { return sum + part->columns(); });
}

void StepObjective::update_tangent(LowRankSystem& system, double psd_blend) {
  for (StepPart* part : parts_) {
    part->begin_tangent(psd_blend);
  }
  tangent_->update(position_, psd_blend);
  if (system.count() > 0) {
    system.update(dense_tangent(1 - psd_blend));
  }
}

/// Low-rank part of the second derivative. @param left fraction of the indefinite terms that is kept, 0 to 1
LowRank StepObjective::dense_tangent(double left) {
  LowRank all(Eigen::SparseMatrix<double>(3 * vertices().owned, columns()), Eigen::VectorXd(columns()));
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Eigen::Index> first_columns;
  Eigen::Index first = 0;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    first_columns.push_back(first);
    if (parts_[p]->columns() == 0) {
      continue;
    }
    LowRank part = parts_[p]->dense_tangent();
    if (parts_.size() == 1) {
      all = std::move(part);
      break;
    }
    for (Eigen::Index column = 0; column < part.count(); ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator entry(part.sparse, column); entry; ++entry) {
        entries.emplace_back(3 * joined_.first_owned(p) + entry.row(), first + column, entry.value());
      }
    }
    all.mixing.block(first, first, part.count(), part.count()) = part.mixing;
    all.coefficients.segment(first, part.count()) = part.coefficients;
    first += part.count();
  }
  if (parts_.size() > 1) {
    all.sparse.setFromTriplets(entries.begin(), entries.end());
  }
  if (joint_) {
    joint_(all, first_columns, left);
  }
  return all;
}

bool StepObjective::blends() const {
  return std::all_of(parts_.begin(), parts_.end(), [](const StepPart* part) { return part->blends(); });
}

double StepObjective::residual_norm() const {
  const double own = std::accumulate(squared_residuals_.begin(), squared_residuals_.end(), 0.0);
  return std::sqrt(sum_over_ranks(comm(), own));
}

bool StepObjective::any(bool (StepPart::*is)() const) const {
  return std::any_of(parts_.begin(), parts_.end(), [is](const StepPart* part) { return (part->*is)(); });
}

double StepObjective::largest(double (StepPart::*of)() const) const {
  double largest = 0;
  for (const StepPart* part : parts_) {
    largest = std::max(largest, (part->*of)());
  }
  return largest;
}

}  // namespace pellicle::energies
