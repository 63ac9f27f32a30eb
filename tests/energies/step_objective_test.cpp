#include "energies/step_objective.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "parallel/collective.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// Of two vertices of a layout, by their global numbers: k (d^2 - l^2)^2 / 4 at the distance d.
struct Spring {
  PetscInt one;
  PetscInt other;
  double stiffness;
  double length;
};

/// Springs of vertices that every rank has.
class Springs : public Potential {
 public:
  Springs(const Layout& vertices, std::vector<Spring> springs)
      : vertices_(vertices), numbers_(vertices), springs_(std::move(springs)) {}

  double value(const Field& x) const override {
    double sum = 0;
    for (const Spring& spring : springs_) {
      if (numbers_.find(spring.one) < vertices_.owned) {
        const double excess = excess_of(spring, x);
        sum += spring.stiffness * excess * excess / 4;
      }
    }
    return sum;
  }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override {
    for (const Spring& spring : springs_) {
      const Eigen::Vector3d force = spring.stiffness * excess_of(spring, x) * apart(spring, x);
      for (const auto& [end, sign] : {std::pair(spring.one, 1.0), std::pair(spring.other, -1.0)}) {
        if (numbers_.find(end) < vertices_.owned) {
          gradient.col(numbers_.find(end)) += sign * force;
        }
      }
    }
  }
  std::vector<VertexPair> pattern() const override {
    std::vector<VertexPair> pairs;
    for (const Spring& spring : springs_) {
      for (const PetscInt row : {spring.one, spring.other}) {
        for (const PetscInt column : {spring.one, spring.other}) {
          pairs.push_back({numbers_.find(row), column});
        }
      }
    }
    return pairs;
  }
  void update_hessian(const Field& x, double psd_blend) override {
    last_psd_blend = psd_blend;
    blocks_.clear();
    for (const Spring& spring : springs_) {
      const Eigen::Vector3d d = apart(spring, x);
      const Eigen::Matrix3d block =
          spring.stiffness * (excess_of(spring, x) * Eigen::Matrix3d::Identity() + 2 * d * d.transpose());
      blocks_.insert(blocks_.end(), {block, -block, -block, block});
    }
  }
  void add_hessian(const HessianBlocks& blocks) const override {
    for (std::size_t pair = 0; pair < blocks_.size(); ++pair) {
      blocks.add(pair, blocks_[pair]);
    }
  }
  void start_from(const Field& start, Field& x, double h) override {
    x.values() += push * start.values();
    last_h = h;
  }
  bool refresh(const Field& x) override {
    renewed_at = x.values();
    return has_changed;
  }
  bool limits() const override { return std::isfinite(furthest_down); }
  bool limit(const Field& /*x*/, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) override {
    double least = 1;
    for (Eigen::Index i = 0; i < step.cols(); ++i) {
      const double fraction = step(2, i) < -furthest_down ? -furthest_down / step(2, i) : 1;
      if (how == StepLimit::each_vertex) {
        step.col(i) *= fraction;
      }
      least = std::min(least, fraction);
    }
    least = min_over_ranks(vertices_.comm, least);
    if (how == StepLimit::all_alike) {
      step *= least;
    }
    return least < 1;
  }

  double push = 0;  ///< fraction of the start that is added to the place where Newton's method begins
  double last_h = 0;
  double last_psd_blend = -1;
  bool has_changed = false;
  Eigen::MatrixXd renewed_at;
  double furthest_down = std::numeric_limits<double>::infinity();  ///< of a step, along z

 private:
  Eigen::Vector3d apart(const Spring& spring, const Field& x) const {
    return x.vector(numbers_.find(spring.one)) - x.vector(numbers_.find(spring.other));
  }
  double excess_of(const Spring& spring, const Field& x) const {
    return apart(spring, x).squaredNorm() - spring.length * spring.length;
  }

  const Layout& vertices_;
  LocalNumbers numbers_;
  std::vector<Spring> springs_;
  std::vector<Eigen::Matrix3d> blocks_;
};

constexpr std::array<PetscInt, 2> count{5, 4};  ///< of the vertices of each part, over all ranks
constexpr PetscInt constrained = 3;             ///< the last vertex of the second part, which stays in a plane
const Eigen::Vector3d normal(0, 0.6, 0.8);      // of that plane
constexpr double spring_length = 0.7;
constexpr std::array<double, 2> stiffness{2, 3};
const std::vector<Spring> between{{4, 0, 1.5, 0.4}, {1, 3, 0.5, 0.9}};  // of a vertex of the first part, and the second

/// Columns of the volumes of a part, whose values are c.x.
Eigen::MatrixXd unmixed_columns(std::size_t part) {
  Eigen::MatrixXd columns(3 * count[part], part + 1);
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      columns(i, k) = std::sin(1.0 + static_cast<double>(i + 7 * k));
    }
  }
  if (part == 1) {
    columns.middleRows<3>(3 * constrained) -= normal * (normal.transpose() * columns.middleRows<3>(3 * constrained));
  }
  return columns;
}
Eigen::MatrixXd mixing_of(std::size_t part) {
  return part == 0 ? Eigen::MatrixXd(Eigen::Matrix<double, 1, 1>(1))
                   : Eigen::MatrixXd(Eigen::Rotation2Dd(0.7).toRotationMatrix());
}
Eigen::VectorXd coefficients_of(std::size_t part) {
  return part == 0 ? Eigen::VectorXd(Eigen::Matrix<double, 1, 1>(0.3)) : Eigen::VectorXd(Eigen::Vector2d(0.8, 0.1));
}
/// Of each column: wanted volume, and scale of the unknown that stands for its pressure.
constexpr double wanted = 0.25;
double scale_of(std::size_t part, Eigen::Index column) {
  return 2.0 + static_cast<double>(part) + static_cast<double>(column) / 2;
}

/// A chain of springs, with volumes that cost energy and have pressures among the unknowns. Every rank has its
/// vertices, but the second part is not owned by the first of several ranks.
struct ChainPart : StepPart {
  explicit ChainPart(std::size_t part)
      : StepPart(layout, corners, part == 0 ? 1e-6 : 1e-4),
        number(part),
        layout(layout_of(part)),
        springs(layout, chain(part)) {
    potentials_ = {&springs};
    length_scale_ = part == 0 ? 1 : 2;
    force_scale_ = part == 0 ? 30 : 50;
    first_place = Field(layout, 3);
    place = Field(layout, 3);
    directions = Projectors(static_cast<std::size_t>(layout.local()));
    if (part == 1) {
      directions.bind(static_cast<std::size_t>(LocalNumbers(layout).find(constrained)),
                      Eigen::Matrix3d::Identity() - normal * normal.transpose());
    }
    pressures = Eigen::VectorXd::Zero(columns());
    corners.push_back({local(0), local(1), local(2)});
  }

  PetscInt local(PetscInt global) const { return LocalNumbers(layout).find(global); }

  const Projectors& projectors() const override { return directions; }
  const Field& start() const override { return first_place; }
  const Field& position() const override { return place; }
  bool move_to(const Field& position, const Eigen::VectorXd& own) override {
    place = position;
    pressures = own;
    return true;
  }
  void forget() override { ++forgotten; }
  Eigen::VectorXd own_unknowns() const override { return pressures; }
  bool leaves_held_behind() override {
    ++asked;
    return leaves_behind;
  }
  double value() override {
    const Eigen::ArrayXd excess = volume_residual().array();
    return strength * (sum_over_ranks(layout.comm, springs.value(place)) +
                       (coefficients_of(number).array() * excess * excess).sum() / 2 +
                       (pressure_scales().array() * pressures.array() * excess).sum());
  }
  const Eigen::Matrix3Xd& gradient() override {
    last_gradient.setZero(3, layout.owned);
    springs.add_gradient(place, last_gradient);
    const Eigen::VectorXd weights =
        coefficients_of(number).cwiseProduct(volume_residual()) + pressure_scales().cwiseProduct(pressures);
    const Eigen::VectorXd by_volumes = owned_columns() * (mixing_of(number) * weights);
    last_gradient += by_volumes.reshaped(3, layout.owned);
    directions.apply(last_gradient);
    last_gradient *= strength;
    return last_gradient;
  }
  const std::vector<double>& squared_forces() const override { return forces; }
  Eigen::VectorXd own_rows() const override { return pressure_scales().cwiseProduct(volume_residual()); }
  bool inverts() const override { return can_invert; }
  double inverted(const Field& from, const Field& to) const override {
    return (number == 0 ? 1 : 100) * (to.values() - from.values()).row(0).sum();
  }
  int columns() const override { return static_cast<int>(number) + 1; }
  void begin_tangent(double psd_blend) override { last_share = psd_blend; }
  LowRank dense_tangent() override {
    LowRank result(owned_columns().sparseView(), coefficients_of(number));
    result.mixing = mixing_of(number);
    return result;
  }
  bool blends() const override { return can_blend; }
  std::vector<int> prescribed() const override { return {static_cast<int>(number)}; }
  Eigen::VectorXd pressure_scales() const override {
    Eigen::VectorXd scales(columns());
    for (Eigen::Index k = 0; k < scales.size(); ++k) {
      scales[k] = scale_of(number, k);
    }
    return scales;
  }
  Eigen::VectorXd multiplier() const override { return pressure_scales().cwiseProduct(pressures); }
  Eigen::VectorXd volume_residual() const override {
    Eigen::VectorXd x(3 * count[number]);
    for (PetscInt i = 0; i < count[number]; ++i) {
      x.segment<3>(3 * i) = place.vector(local(i));
    }
    return ((unmixed_columns(number) * mixing_of(number)).transpose() * x).array() - wanted;
  }
  bool suits_patches() const override { return can_patch; }
  double rounding() const override { return number == 0 ? 1e-9 : 1e-8; }

  static Layout layout_of(std::size_t part) {
    const auto rank_of = [part](PetscInt i) {
      return part == 0 || ranks() == 1 ? i * ranks() / count[part] : 1 + i * (ranks() - 1) / count[part];
    };
    std::vector<PetscInt> all(count[part]);
    std::iota(all.begin(), all.end(), 0);
    const auto is_own = [&](PetscInt i) { return rank_of(i) == this_rank(); };
    Layout layout =
        number_owned(PETSC_COMM_WORLD, static_cast<PetscInt>(std::count_if(all.begin(), all.end(), is_own)));
    std::remove_copy_if(all.rbegin(), all.rend(), std::back_inserter(layout.ghost_global), is_own);
    return layout;
  }
  static std::vector<Spring> chain(std::size_t part) {
    std::vector<Spring> springs;
    for (PetscInt i = 0; i + 1 < count[part]; ++i) {
      springs.push_back({i, i + 1, stiffness[part], spring_length});
    }
    return springs;
  }
  Eigen::MatrixXd owned_columns() const {
    return unmixed_columns(number).middleRows(3 * layout.first, 3 * layout.owned);
  }

  std::size_t number;
  Layout layout;
  Springs springs;
  std::vector<std::array<PetscInt, 3>> corners;
  Projectors directions;
  Field first_place;
  Field place;
  Eigen::VectorXd pressures;
  Eigen::Matrix3Xd last_gradient;

  // What a test sets,
  double strength = 1;  ///< by which energy and forces are multiplied
  std::vector<double> forces{1};
  bool leaves_behind = false;
  bool can_invert = false;
  bool can_blend = true;
  bool can_patch = false;
  // and what it asks for.
  int forgotten = 0;
  int asked = 0;
  double last_share = -1;
};

/// The derivative of a polynomial of degree 4 at 0.
template <class Function>
auto slope_of(const Function& function) {
  using Value = decltype(function(0.0));
  constexpr double h = 0.1;
  const Value near = function(h) - function(-h);
  const Value far = function(2 * h) - function(-2 * h);
  return Value((8 * near - far) / (12 * h));
}

/// An objective of both chains, which springs join, or of the second one alone, and what it has to be: all unknowns in
/// a row on every rank, the positions of one chain after the other, then their own unknowns.
class Joined {
 public:
  explicit Joined(std::vector<std::size_t> chosen, bool are_joined = true)
      : chosen_(std::move(chosen)), are_joined_(are_joined && chosen_.size() > 1) {
    std::vector<StepPart*> all;
    std::vector<Layout> layouts;
    for (const std::size_t part : chosen_) {
      parts.push_back(std::make_unique<ChainPart>(part));
      all.push_back(parts.back().get());
      layouts.push_back(parts.back()->vertices());
      first_.push_back(positions_);
      positions_ += 3 * count[part];
    }
    size_ = positions_;
    for (const auto& part : parts) {
      size_ += part->columns();
    }
    layout_ = std::make_unique<JoinedLayout>(layouts);
    std::vector<Spring> springs = between;
    for (Spring& spring : springs) {
      if (are_joined_) {
        spring.one = layout_->global(0, spring.one);
        spring.other = layout_->global(1, spring.other);
      }
    }
    joint = std::make_unique<Springs>(layout_->layout(), springs);
    objective = std::make_unique<StepObjective>(all, are_joined_ ? joint.get() : nullptr, TangentMatrix::aij, "test_");
    for (std::size_t p = 0; p < parts.size(); ++p) {
      for (PetscInt i = 0; i < 3 * parts[p]->vertices().owned; ++i) {
        here_.push_back(first_[p] + 3 * parts[p]->vertices().first + i);
      }
    }
    for (Eigen::Index i = positions_; i < size_ && this_rank() == 0; ++i) {
      here_.push_back(i);
    }
  }

  Eigen::Index size() const { return size_; }
  Eigen::Index positions() const { return positions_; }
  Eigen::Index first(std::size_t p) const { return first_[p]; }
  /// Places of the chains, not at rest, and pressures.
  Eigen::VectorXd some_unknowns() const {
    Eigen::VectorXd z(size_);
    for (Eigen::Index i = 0; i < size_; ++i) {
      z[i] = 0.2 * static_cast<double>(i % 5) + 0.3 * std::cos(2.0 * static_cast<double>(i));
    }
    return z;
  }
  /// A vector of the unknowns, or of the positions alone.
  VecHandle vector(const Eigen::VectorXd& values) const {
    VecHandle vec;
    const auto here = static_cast<PetscInt>(std::count_if(here_.begin(), here_.end(), is_in(values)));
    check(VecCreateMPI(PETSC_COMM_WORLD, here, PETSC_DETERMINE, vec.create()));
    double* array = nullptr;
    check(VecGetArrayWrite(vec, &array));
    for (PetscInt i = 0; i < here; ++i) {
      array[i] = values[here_[i]];
    }
    check(VecRestoreArrayWrite(vec, &array));
    return vec;
  }
  /// Largest difference of this rank's rows.
  double difference(Vec vec, const Eigen::VectorXd& expected) const {
    const double* array = nullptr;
    check(VecGetArrayRead(vec, &array));
    double largest = 0;
    for (PetscInt i = 0; i < std::count_if(here_.begin(), here_.end(), is_in(expected)); ++i) {
      largest = std::max(largest, std::abs(array[i] - expected[here_[i]]));
    }
    check(VecRestoreArrayRead(vec, &array));
    return largest;
  }
  void move_to(const Eigen::VectorXd& z) const { objective->move_to(vector(z)); }

  double energy(const Eigen::VectorXd& z) const {
    double sum = 0;
    const auto add = [&](Eigen::Index one, Eigen::Index other, double k, double length) {
      const double excess = (z.segment<3>(one) - z.segment<3>(other)).squaredNorm() - length * length;
      sum += k * excess * excess / 4;
    };
    Eigen::Index own = positions_;
    for (std::size_t p = 0; p < chosen_.size(); ++p) {
      const std::size_t part = chosen_[p];
      for (Eigen::Index i = 0; i + 1 < count[part]; ++i) {
        add(first_[p] + 3 * i, first_[p] + 3 * i + 3, stiffness[part], spring_length);
      }
      const Eigen::MatrixXd columns = unmixed_columns(part) * mixing_of(part);
      for (Eigen::Index k = 0; k < columns.cols(); ++k, ++own) {
        const double excess = columns.col(k).dot(z.segment(first_[p], 3 * count[part])) - wanted;
        sum += (coefficients_of(part)[k] * excess / 2 + scale_of(part, k) * z[own]) * excess;
      }
    }
    for (const Spring& spring : between) {
      if (are_joined_) {
        add(3 * spring.one, first_[1] + 3 * spring.other, spring.stiffness, spring.length);
      }
    }
    return sum;
  }
  Eigen::VectorXd gradient(const Eigen::VectorXd& z) const {
    Eigen::VectorXd result(size_);
    for (Eigen::Index i = 0; i < size_; ++i) {
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(size_, i);
      result[i] = slope_of([&](double h) { return energy(z + h * unit); });
    }
    return projected(result);
  }
  /// Without what is constrained.
  Eigen::VectorXd projected(Eigen::VectorXd values) const {
    auto last = values.segment<3>(first_.back() + 3 * constrained);
    last -= normal * normal.dot(last);
    return values;
  }

  std::vector<std::unique_ptr<ChainPart>> parts;
  std::unique_ptr<Springs> joint;
  std::unique_ptr<StepObjective> objective;

 private:
  static std::function<bool(Eigen::Index)> is_in(const Eigen::VectorXd& values) {
    return [size = values.size()](Eigen::Index i) { return i < size; };
  }

  std::vector<std::size_t> chosen_;
  bool are_joined_;
  Eigen::Index positions_ = 0;
  Eigen::Index size_ = 0;
  std::vector<Eigen::Index> first_;  ///< unknown of each chain
  std::vector<Eigen::Index> here_;   ///< the unknowns of this rank
  std::unique_ptr<JoinedLayout> layout_;
};

const std::vector<std::vector<std::size_t>> choices{{1}, {0, 1}};

TEST(StepObjective, IsTheSumOfItsPartsAndOfWhatIsBetweenThem) {
  for (const auto& chosen : choices) {
    const Joined joined(chosen);
    const Eigen::VectorXd z = joined.some_unknowns();
    joined.move_to(z);
    EXPECT_NEAR(joined.objective->value(), joined.energy(z), 1e-13);
    const VecHandle residual = joined.vector(Eigen::VectorXd::Zero(joined.size()));
    joined.objective->compute_residual(residual);
    const Eigen::VectorXd gradient = joined.gradient(z);
    EXPECT_LT(joined.difference(residual, gradient), 1e-11 * gradient.norm());
    EXPECT_NEAR(joined.objective->residual_norm(), gradient.head(joined.positions()).norm(), 1e-11 * gradient.norm());
    const VecHandle written = joined.vector(Eigen::VectorXd::Zero(joined.size()));
    joined.objective->write_to(written);
    EXPECT_EQ(joined.difference(written, z), 0);
  }
}

TEST(StepObjective, HasTheSecondDerivativeOfThatSum) {
  for (const auto& chosen : choices) {
    const Joined joined(chosen);
    StepObjective& objective = *joined.objective;
    const Eigen::VectorXd z = joined.some_unknowns();
    joined.move_to(z);
    objective.update_pattern();
    EXPECT_EQ(objective.columns(), joined.size() - joined.positions());
    LowRankSystem system(objective.tangent().matrix(), objective.columns(), "test_", {KSPCG, PCJACOBI, 1e-12});
    objective.update_tangent(system, 0);
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(joined.size());
    direction.head(joined.positions()) =
        joined.projected(joined.some_unknowns().reverse() + Eigen::VectorXd::Ones(joined.size()))
            .head(joined.positions());
    const Eigen::VectorXd expected = slope_of([&](double h) -> Eigen::VectorXd {
                                       return joined.gradient(z + h * direction);
                                     }).head(joined.positions());
    const VecHandle factor = joined.vector(direction.head(joined.positions()));
    const VecHandle product = joined.vector(direction.head(joined.positions()));
    system.multiply_whole(factor, product);
    EXPECT_LT(joined.difference(product, expected), 1e-10 * expected.norm());
  }
}

TEST(StepObjective, TellsHowFarTowardsThePositiveTangentItGoes) {
  const Joined joined({0, 1});
  StepObjective& objective = *joined.objective;
  joined.move_to(joined.some_unknowns());
  LowRankSystem system(objective.tangent().matrix(), objective.columns(), "test_", {KSPCG, PCJACOBI, 1e-12});
  std::vector<double> left;
  objective.set_joint([&left](LowRank& all, const std::vector<Eigen::Index>& first, double share_left) {
    EXPECT_EQ(first, (std::vector<Eigen::Index>{0, 1}));
    all.coefficients[2] *= 10;
    left.push_back(share_left);
  });
  objective.update_tangent(system, 0.25);
  EXPECT_EQ(joined.joint->last_psd_blend, 0.25);
  for (const auto& part : joined.parts) {
    EXPECT_EQ(part->last_share, 0.25);
  }
  EXPECT_DOUBLE_EQ(system.low_rank().coefficients[2], 10 * coefficients_of(1)[1]);
  objective.update_tangent(system, 1);
  EXPECT_EQ(joined.parts.back()->last_share, 1);
  EXPECT_EQ(left, (std::vector<double>{0.75, 0}));
}

TEST(StepObjective, AsksOfEachPartWhatItsOwnForcesAllow) {
  constexpr double rtol = 1e-5;
  const auto scale_with = [](const std::array<double, 2>& strength, std::vector<double> second_forces,
                             std::array<double, 2>& norms) {
    const Joined joined({0, 1}, false);
    const Eigen::VectorXd z = joined.some_unknowns();
    joined.move_to(z);
    joined.parts[0]->forces = {4.0 / ranks(), 1.0 / ranks()};
    joined.parts[1]->forces = std::move(second_forces);
    const Eigen::VectorXd gradient = joined.gradient(z);
    for (std::size_t p = 0; p < 2; ++p) {
      joined.parts[p]->strength = strength[p];
      norms[p] = strength[p] * gradient.segment(joined.first(p), 3 * count[p]).norm();
    }
    const VecHandle residual = joined.vector(gradient);
    joined.objective->compute_residual(residual);
    return joined.objective->residual_scale(rtol);
  };
  const std::vector<double> forces{9.0 / ranks(), 25.0 / ranks(), 0};
  const std::array<double, 2> allowed{2 * 1e-6 / rtol, 5 * 1e-4 / rtol};
  std::array<double, 2> norms{};
  // The first part is further from balance, then the second, then the second alone is not in balance.
  double scale = scale_with({1, 1}, forces, norms);
  EXPECT_NEAR(std::hypot(norms[0], norms[1]) / scale, norms[0] / allowed[0], 1e-10 * norms[0] / allowed[0]);
  scale = scale_with({1e-6, 1}, forces, norms);
  EXPECT_NEAR(std::hypot(norms[0], norms[1]) / scale, norms[1] / allowed[1], 1e-10 * norms[1] / allowed[1]);
  EXPECT_NEAR(scale_with({0, 1}, forces, norms), allowed[1], 1e-10 * allowed[1]);
  EXPECT_NEAR(scale_with({0, 0}, forces, norms), allowed[1], 1e-10 * allowed[1]);
  // A part without forces has a millionth of its scale.
  EXPECT_NEAR(scale_with({0, 1}, {0}, norms), 50 * 1e-6 * 1e-4 / rtol, 1e-15);
}

TEST(StepObjective, BeginsAStepWhereWhatIsBetweenThePartsPutsThem) {
  const Joined joined({0, 1});
  joined.joint->push = 0.5;
  for (const auto& part : joined.parts) {
    for (PetscInt i = 0; i < part->vertices().local(); ++i) {
      part->first_place.vector(i).setConstant(static_cast<double>(part->vertices().to_global(i)) + 2);
      part->place.vector(i).setConstant(static_cast<double>(part->columns()));
    }
  }
  EXPECT_TRUE(joined.objective->begin_step(0.125));
  EXPECT_EQ(joined.joint->last_h, 0.125);
  for (const auto& part : joined.parts) {
    for (PetscInt i = 0; i < part->vertices().local(); ++i) {
      const double place = part->columns() + 0.5 * (static_cast<double>(part->vertices().to_global(i)) + 2);
      EXPECT_EQ(part->position().vector(i), Eigen::Vector3d::Constant(place));
    }
  }
  for (std::size_t p = 0; p < 2; ++p) {
    joined.parts[p]->leaves_behind = true;
    EXPECT_FALSE(joined.objective->begin_step(0.125));
    joined.parts[p]->leaves_behind = false;
  }
  EXPECT_EQ(joined.parts[0]->asked, 3);  // Each part is asked, whatever another one has said.
  EXPECT_EQ(joined.parts[1]->asked, 3);
}

/// A descent in which two vertices of the second part, one of them the last, go far down.
Eigen::VectorXd some_descent(const Joined& joined) {
  Eigen::VectorXd descent = joined.some_unknowns().array() - 0.3;
  descent[joined.first(1) + 3 + 2] = 0.5;
  descent[joined.first(1) + 3 * constrained + 2] = 0.7;
  return descent;
}

TEST(StepObjective, ShortensTheDescentOfSingleVerticesAsAPotentialOfTheSecondPartWantsIt) {
  const Joined joined({0, 1});
  const double furthest = joined.parts[1]->springs.furthest_down = 0.2;
  joined.move_to(joined.some_unknowns());
  const VecHandle limited = joined.vector(some_descent(joined));
  Eigen::VectorXd expected = joined.projected(some_descent(joined));
  joined.objective->limit(joined.vector(expected), limited);  // Along the gradient the energy falls.
  int shortened = 0;
  for (PetscInt i = 0; i < count[1]; ++i) {
    auto down = expected.segment<3>(joined.first(1) + 3 * i);
    if (down.z() > furthest) {
      down *= furthest / down.z();
      ++shortened;
    }
  }
  EXPECT_GT(shortened, 1);
  EXPECT_LT(shortened, count[1]);
  EXPECT_LT(joined.difference(limited, expected), 1e-14);
}

TEST(StepObjective, ShortensTheDescentOfAllVerticesAlikeWhereTheEnergyWouldNotFall) {
  const Joined joined({0, 1});
  joined.joint->furthest_down = 0.1;
  joined.move_to(joined.some_unknowns());
  const VecHandle limited = joined.vector(some_descent(joined));
  Eigen::VectorXd expected = joined.projected(some_descent(joined));
  joined.objective->limit(joined.vector(-expected), limited);
  auto places = expected.head(joined.positions()).reshaped(3, joined.positions() / 3);
  places *= 0.1 / places.row(2).maxCoeff();
  EXPECT_LT(joined.difference(limited, expected), 1e-14);
}

TEST(StepObjective, RenewsAllPotentialsAndLetsAllPartsForget) {
  const Joined joined({0, 1});
  const Eigen::VectorXd z = joined.some_unknowns();
  joined.move_to(z);
  EXPECT_FALSE(joined.objective->refresh());
  EXPECT_EQ(joined.parts[0]->forgotten, 0);
  joined.parts[0]->springs.has_changed = true;
  EXPECT_TRUE(joined.objective->refresh());
  EXPECT_EQ(joined.parts[0]->forgotten, 1);
  EXPECT_EQ(joined.parts[1]->forgotten, 1);
  for (PetscInt i = 0; i < count[1]; ++i) {  // The second part's are asked at its own places.
    EXPECT_EQ(joined.parts[1]->springs.renewed_at.col(joined.parts[1]->local(i)),
              z.segment<3>(joined.first(1) + 3 * i));
  }
}

TEST(StepObjective, ListsTheFiguresOfOnePartAfterTheOther) {
  const Joined joined({0, 1});
  StepObjective& objective = *joined.objective;
  const Eigen::VectorXd z = joined.some_unknowns();
  joined.move_to(z);
  const Eigen::Vector3d scales(2, 3, 3.5);
  EXPECT_EQ(objective.pressure_scales(), scales);
  EXPECT_EQ(objective.multiplier(), scales.cwiseProduct(z.tail<3>()));
  EXPECT_LT((objective.volume_residual().cwiseProduct(scales) - joined.gradient(z).tail<3>()).norm(), 1e-11);
  EXPECT_EQ(objective.prescribed(), (std::vector<int>{0, 2}));
  EXPECT_EQ(objective.length_scale(), 2);
  EXPECT_EQ(objective.force_scale(), 50);
  EXPECT_EQ(objective.rounding(), 1e-8);
  EXPECT_EQ(objective.path(), nullptr);
  ASSERT_EQ(objective.triangles().size(), 2U);
  EXPECT_EQ(objective.vertices().global, count[0] + count[1]);
  for (std::size_t p = 0; p < 2; ++p) {
    for (std::size_t k = 0; k < 3; ++k) {  // Of each part the triangle of its first three vertices.
      EXPECT_EQ(objective.position().vector(objective.triangles()[p][k]),
                z.segment<3>(joined.first(p) + 3 * static_cast<Eigen::Index>(k)));
    }
  }
  // Elements are counted of each part on its own way.
  Field to(objective.vertices(), 3);
  to.values() = objective.position().values();
  to.vector(objective.triangles()[0][0]).x() += 1;
  to.vector(objective.triangles()[1][1]).x() += 2;
  EXPECT_NEAR(objective.inverted(objective.position(), to), 1 + 100 * 2, 1e-12);
}

TEST(StepObjective, CanWhatAnyPartOrWhatEveryPartCan) {
  const Joined joined({0, 1});
  EXPECT_FALSE(joined.objective->inverts());
  EXPECT_FALSE(joined.objective->suits_patches());
  EXPECT_TRUE(joined.objective->blends());
  joined.parts[1]->can_invert = joined.parts[1]->can_patch = true;
  joined.parts[1]->can_blend = false;
  EXPECT_TRUE(joined.objective->inverts());
  EXPECT_TRUE(joined.objective->suits_patches());
  EXPECT_FALSE(joined.objective->blends());
}

}  // namespace
}  // namespace pellicle
