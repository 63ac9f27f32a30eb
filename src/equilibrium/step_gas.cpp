#include "equilibrium/step_gas.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/principal_axes.h"
#include "parallel/collective.h"

namespace pellicle::equilibrium {

namespace {

/// Share of dV/dx dV/dx^T dp/dV in a tangent: the paper's 1/27 is a third of the exact 1/9 (eq. 16).
double rank_one_share(GasTangent gas_tangent) { return gas_tangent == GasTangent::paper ? 1.0 / 3 : 1.0; }

/// Gauss's rule: places in (0, 1) and weights.
struct GaussPoint {
  double place;
  double weight;
};
constexpr std::array<GaussPoint, 3> three_points{
    {{0.1127016653792583, 5.0 / 18}, {0.5, 8.0 / 18}, {0.8872983346207417, 5.0 / 18}}};
constexpr std::array<GaussPoint, 4> four_points{{{0.06943184420297371, 0.17392742256872692},
                                                 {0.33000947820757187, 0.32607257743127307},
                                                 {0.6699905217924281, 0.32607257743127307},
                                                 {0.9305681557970262, 0.17392742256872692}}};

}  // namespace

LowRank projected(LowRank low_rank, const Projectors& projectors) {
  // The entries are blocks of three, of the vertices.
  Eigen::Map<Eigen::Matrix3Xd> blocks(low_rank.sparse.valuePtr(), 3, low_rank.sparse.nonZeros() / 3);
  for (Eigen::Index block = 0; block < blocks.cols(); ++block) {
    const auto vertex = static_cast<std::size_t>(low_rank.sparse.innerIndexPtr()[3 * block] / 3);
    blocks.col(block) = (projectors[vertex] * blocks.col(block)).eval();
  }
  return low_rank;
}

StepGas::StepGas(const std::vector<Part>& parts) : flow_({parts.begin(), parts.end()}) {
  for (const Part& part : parts) {
    Own& own = parts_.emplace_back();
    static_cast<Part&>(own) = part;
    for (int chamber = 0; chamber < part.chambers->count(); ++chamber) {
      if (part.chambers->prescribes_volume(chamber)) {
        own.prescribed.push_back(chamber);
      }
    }
    own.multiplier.setZero(static_cast<Eigen::Index>(own.prescribed.size()));
    own.between = Field(part.chambers->surface().particles, 3);
  }
  walls_.resize(parts.size());
  responses_.resize(parts.size());
}

void StepGas::begin_step(double time) {
  flow_.begin_step();
  ended_.clear();
  of_tangent_.clear();
  set_time(time);
}

/// The gas of all parts at their present positions. Collective.
void StepGas::evaluate() {
  if (is_evaluated_) {
    return;
  }
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    if (!parts_[part].is_pushed) {
      walls_[part] = parts_[part].chambers->volumes(*parts_[part].position);
    }
  }
  walls_ = flow_.moved_walls(std::move(walls_), responses_, time_);
  step_ = flow_.network_step(walls_, time_);
  end_ = flow_.solve(step_);
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    Own& own = parts_[part];
    own.states = flow_.end_states(part, walls_, time_, end_);
    for (std::size_t c = 0; c < own.prescribed.size(); ++c) {
      own.states[own.prescribed[c]].pressure = own.multiplier[static_cast<Eigen::Index>(c)];
    }
  }
  is_evaluated_ = true;
}

void StepGas::set_multiplier(std::size_t part, const Eigen::VectorXd& pressure) {
  if (parts_[part].multiplier != pressure) {
    parts_[part].multiplier = pressure;
    move();
  }
}

void StepGas::balance(std::size_t part, StepPart& step) {
  const Own& own = parts_[part];
  const auto count = static_cast<Eigen::Index>(own.prescribed.size());
  if (count == 0) {
    return;
  }
  const Eigen::Matrix3Xd gradient = step.gradient();
  const LowRank all = projected({own.chambers->volume_gradients(*own.position), Eigen::VectorXd(own.chambers->count())},
                                step.projectors());
  const Eigen::MatrixXd columns = all.columns(own.prescribed);
  Eigen::MatrixXd system(count, count + 1);
  system << columns.transpose() * columns, columns.transpose() * gradient.reshaped();
  sum_over_ranks(own.chambers->surface().comm(), system);
  const Eigen::VectorXd change = system.leftCols(count).completeOrthogonalDecomposition().solve(system.col(count));
  set_multiplier(part, own.multiplier + change);
}

Eigen::VectorXd StepGas::pressure_scales(std::size_t part) const {
  const Own& own = parts_[part];
  Eigen::VectorXd scales(own.multiplier.size());
  std::transform(own.prescribed.begin(), own.prescribed.end(), scales.begin(),
                 [&own](int chamber) { return own.force_scale / own.chambers->initial_volume(chamber); });
  return scales;
}

Eigen::VectorXd StepGas::volume_residual(std::size_t part) {
  const Own& own = parts_[part];
  Eigen::VectorXd excess(own.multiplier.size());
  if (excess.size() > 0) {
    evaluate();
  }
  std::transform(own.prescribed.begin(), own.prescribed.end(), excess.begin(),
                 [&](int chamber) { return walls_[part][chamber] - own.chambers->prescribed_volume(chamber, time_); });
  return excess;
}

Eigen::Matrix3Xd StepGas::gradient(std::size_t part) {
  evaluate();
  Own& own = parts_[part];
  const Eigen::SparseMatrix<double> gradients = own.chambers->volume_gradients(*own.position);
  Eigen::VectorXd pressure(own.chambers->count());
  double absolute = 0;  // squares of the forces of the absolute pressures
  for (int chamber = 0; chamber < own.chambers->count(); ++chamber) {
    const GasState& state = own.states[chamber];
    pressure[chamber] = state.pressure;
    if (gradients.rows() > 0) {  // Eigen does not sum a sparse column without rows.
      absolute += std::pow(state.absolute_pressure, 2) * gradients.col(chamber).squaredNorm();
    }
  }
  // Amounts of gas are found to this fraction, and pressures are differences of absolute ones.
  constexpr double fraction = 2e-14;
  absolute = sum_over_ranks(own.chambers->surface().comm(), absolute);
  own.rounding = fraction * std::sqrt(absolute);
  return (gradients * -pressure).reshaped(3, gradients.rows() / 3);
}

LowRank StepGas::begin_tangent(std::size_t part, double left) {
  evaluate();
  Own& own = parts_[part];
  of_tangent_.resize(parts_.size());
  of_tangent_[part] = walls_[part];
  own.of_tangent = own.position->values();
  has_work_ = false;
  LowRank result(own.chambers->volume_gradients(*own.position), Eigen::VectorXd(own.chambers->count()));
  for (int chamber = 0; chamber < own.chambers->count(); ++chamber) {
    double stiffness = 0;
    if (own.chambers->prescribes_volume(chamber)) {
      const double volume = std::abs(own.states[chamber].volume);
      const double pressure = std::abs(own.states[chamber].pressure);
      stiffness = 10 * (pressure + own.force_scale / std::pow(volume, 2.0 / 3)) / volume;
    } else if (!own.chambers->is_joined(chamber)) {
      stiffness = -rank_one_share(own.tangent) * own.states[chamber].pressure_slope;
    }
    result.coefficients[chamber] = std::max(stiffness, left * stiffness);
  }
  if (parts_.size() == 1) {
    join(result, {0}, left);
  }
  return result;
}

void StepGas::join(LowRank& all, const std::vector<Eigen::Index>& first, double left) {
  evaluate();
  std::vector<Eigen::Index> columns;
  std::vector<Eigen::Index> walls;  // the same, of those of all parts
  std::vector<double> compliances;  // of those of all parts; 0: not of what is pushed
  Eigen::VectorXd fraction(all.count());
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    for (const int chamber : parts_[part].chambers->joined()) {
      if (!parts_[part].is_pushed) {
        columns.push_back(first[part] + chamber);
        walls.push_back(static_cast<Eigen::Index>(compliances.size()));
        fraction[columns.back()] = rank_one_share(parts_[part].tangent);
      }
      const Eigen::VectorXd& compliance = responses_[part].compliance;
      compliances.push_back(compliance.size() == 0 ? 0 : compliance[chamber]);
    }
  }
  if (columns.empty()) {
    return;
  }
  Eigen::MatrixXd slopes = flow_.slopes(step_, end_);
  if (columns.size() < compliances.size()) {  // What is pushed gives way: dp = S (dW + C dp).
    const Eigen::Map<const Eigen::VectorXd> compliance(compliances.data(), slopes.rows());
    const Eigen::MatrixXd gives_way =
        Eigen::MatrixXd::Identity(slopes.rows(), slopes.cols()) - slopes * compliance.asDiagonal();
    slopes = gives_way.partialPivLu().solve(slopes)(walls, walls).eval();
  }
  const PrincipalAxes principal = principal_axes(-(slopes + slopes.transpose()) / 2);
  all.mixing(columns, columns) = principal.axes;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const double stiffness = fraction[columns[k]] * principal.values[static_cast<Eigen::Index>(k)];
    all.coefficients[columns[k]] = std::max(stiffness, left * stiffness);
  }
}

std::vector<double> StepGas::load_pressure(std::size_t part) {
  evaluate();
  const Own& own = parts_[part];
  std::vector<double> pressure;
  if (own.tangent == GasTangent::exact && own.chambers->count() > 0) {
    for (std::size_t t = 0; t < own.chambers->surface().triangles.size(); ++t) {
      const int chamber = own.chambers->of_triangle(static_cast<PetscInt>(t));
      pressure.push_back(chamber >= 0 ? own.states[chamber].pressure : 0);
    }
  }
  return pressure;
}

/// Volume that walls of some chambers, without the caps of holes, sweep straight from x^n to `end`; 0 of other chambers
/// [m^3]. By Simpson's rule, which is exact, since dW/dx is a square of the positions. Collective.
Eigen::VectorXd StepGas::swept_by_rest(Own& own, const Field& end, bool (Chambers::*is_one)(int) const) {
  Eigen::VectorXd swept = Eigen::VectorXd::Zero(own.chambers->count());
  bool has_one = false;
  for (int chamber = 0; chamber < own.chambers->count(); ++chamber) {
    if (!(own.chambers->*is_one)(chamber)) {
      continue;
    }
    has_one = true;
    const Eigen::Matrix3Xd moved = end.values() - own.start->values();
    const auto gradient = [&](double fraction) {
      own.between.values() = own.start->values() + fraction * moved;
      return own.chambers->volume_gradient(chamber, own.between);
    };
    const Eigen::Matrix3Xd mean = (gradient(0) + 4 * gradient(0.5) + gradient(1)) / 6;
    swept[chamber] = mean.cwiseProduct(moved.leftCols(mean.cols())).sum();
  }
  if (has_one) {
    sum_over_ranks(own.chambers->surface().comm(), swept);
  }
  return swept;
}

/// The volume that the caps of holes of each chamber sweep when all points move straight from x^n to `end` [m^3].
/// Collective. @param walls W at `end`
Eigen::VectorXd StepGas::swept_by_caps(Own& own, const Field& end, const Eigen::VectorXd& walls) {
  Eigen::VectorXd caps = Eigen::VectorXd::Zero(own.chambers->count());
  if (own.chambers->rims().empty()) {
    return caps;
  }
  const Eigen::VectorXd changes = walls - own.chambers->volumes(*own.start);
  const Eigen::VectorXd rest = swept_by_rest(own, end, &Chambers::vents);
  for (int chamber = 0; chamber < own.chambers->count(); ++chamber) {
    caps[chamber] = own.chambers->vents(chamber) ? changes[chamber] - rest[chamber] : 0;
  }
  return caps;
}

/// Work of joined gas of all parts since the last tangent: along a straight line of all W, or for walls with holes, on
/// whose caps no pressure acts, of all positions. Collective.
void StepGas::find_work() {
  if (std::exchange(has_work_, true)) {
    return;
  }
  evaluate();
  for (Own& own : parts_) {
    own.work = 0;
  }
  const bool has_tangent =  // of all parts in the balance
      std::equal(parts_.begin(), parts_.end(), of_tangent_.begin(), of_tangent_.end(),
                 [](const Own& own, const Eigen::VectorXd& walls) { return own.is_pushed || walls.size() > 0; });
  if (!has_tangent ||
      std::all_of(parts_.begin(), parts_.end(), [](const Own& own) { return own.chambers->joined().empty(); })) {
    return;
  }
  if (std::all_of(parts_.begin(), parts_.end(), [](const Own& own) { return own.chambers->rims().empty(); })) {
    integrate(four_points, true);
    return;
  }
  integrate(three_points, false);
  for (Own& own : parts_) {
    own.work = sum_over_ranks(own.chambers->surface().comm(), own.work);
  }
}

/// Adds the work, over positions that of this rank, by a rule of Gauss. Collective.
template <class Points>
void StepGas::integrate(const Points& points, bool over_volumes) {
  for (const auto& [place, weight] : points) {
    FlowingGas::Walls walls = walls_;
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      Own& own = parts_[part];
      if (own.is_pushed) {
        continue;
      }
      if (over_volumes) {
        walls[part] = of_tangent_[part] + place * (walls_[part] - of_tangent_[part]);
      } else {
        own.between.values() = own.of_tangent + place * (own.position->values() - own.of_tangent);
        walls[part] = own.chambers->volumes(own.between);
      }
    }
    walls = flow_.moved_walls(std::move(walls), responses_, time_);
    const GasNetwork::End end = flow_.solve(flow_.network_step(walls, time_));
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      Own& own = parts_[part];
      if (own.is_pushed) {
        continue;
      }
      Eigen::VectorXd rates = walls_[part] - of_tangent_[part];
      if (!over_volumes) {
        const Eigen::SparseMatrix<double> gradients = own.chambers->volume_gradients(own.between);
        const Eigen::Matrix3Xd moved = own.position->values() - own.of_tangent;
        rates = gradients.transpose() * moved.leftCols(gradients.rows() / 3).reshaped();
      }
      const std::vector<GasState> states = flow_.end_states(part, walls, time_, end);
      for (const int chamber : own.chambers->joined()) {
        own.work += weight * states[chamber].pressure * rates[chamber];
      }
    }
  }
}

double StepGas::value(std::size_t part) {
  evaluate();
  Own& own = parts_[part];
  const Eigen::VectorXd swept = swept_by_rest(own, *own.position, &Chambers::has_hole);
  double sum = 0;
  for (int chamber = 0; chamber < own.chambers->count(); ++chamber) {
    sum -= swept[chamber] * own.states[chamber].pressure;
    if (!own.chambers->prescribes_volume(chamber) && !own.chambers->has_hole(chamber) &&
        !own.chambers->is_joined(chamber)) {
      sum += own.states[chamber].potential;
    }
  }
  find_work();
  return sum - own.work;
}

GasExchange StepGas::end_step(std::size_t part, const Field& end, double time, double h) {
  if (ended_.empty()) {  // Of all at once: from then on the objects' exchanges are those of the next step.
    FlowingGas::Walls walls;
    FlowingGas::Walls caps;
    for (std::size_t other = 0; other < parts_.size(); ++other) {
      Own& own = parts_[other];
      Field there(own.chambers->surface().particles, 3);
      there.values() = other == part ? end.values() : own.position->values();
      if (other != part && own.write_end) {
        own.write_end(there);
      }
      walls.push_back(own.chambers->volumes(there));
      caps.push_back(swept_by_caps(own, there, walls.back()));
    }
    GasNetwork::Step step = flow_.network_step(walls, time);
    step.h = h;  // The gas steps know how long it is until forces are in balance.
    const GasNetwork::End all = flow_.solve(step);
    for (std::size_t other = 0; other < parts_.size(); ++other) {
      ended_.push_back(flow_.end_step(other, walls, caps, step, all));
    }
  }
  return ended_[part];
}

}  // namespace pellicle::equilibrium
