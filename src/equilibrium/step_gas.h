#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "energies/step_part.h"
#include "gas/flowing_gas.h"
#include "geometry/projectors.h"
#include "linear/low_rank.h"

namespace pellicle::equilibrium {

/// The gas in a step that is brought into balance: what it adds to the potential of a part, its gradient and its second
/// derivative. Of one part, or of several whose chambers are linked, so that the pressures in each follow from the
/// volumes in all of them.
///
/// Gas that links or heat join to something has no potential: its W is minus its work from where the tangent was last
/// taken, which is all that a search along a step of Newton's method asks for. Of a chamber with a hole, whose pressure
/// is given, W is minus the work on what is left of the wall, straight from x^n to x.
///
/// A chamber of prescribed volume has no W: its pressure p is the multiplier of V(x) = V*, an unknown beside x, as p
/// over its pressure scale, and the row of the residual is that scale times V* - V(x).
class StepGas {
 public:
  /// All must outlive it; positions are those that the parts go through.
  struct Part : FlowingGas::Object {
    const Field* start = nullptr;     ///< positions x^n at the start of the step [m]
    const Field* position = nullptr;  ///< positions x of the iteration [m]
    GasTangent tangent = GasTangent::exact;
    double force_scale = 0;  ///< StepPart::force_scale [N]
    /// Writes the positions at the end of the step, if forces are in balance at an earlier time; empty: the positions
    /// of the balance are those at the end.
    std::function<void(Field&)> write_end = {};
    /// Whether the part is not brought into balance but pushed by the pressures, by its response (`set_response`).
    bool is_pushed = false;
  };

  /// @throws Error see FlowingGas
  explicit StepGas(const std::vector<Part>& parts);

  /// Begins the step; the gas steps of all parts must have begun. @param time at which forces are in balance [s]
  void begin_step(double time);
  /// Changes the time of the loads [s].
  void set_time(double time) {
    time_ = time;
    move();
  }
  /// Sets how the pressures across the walls of a part that is pushed move them in this step.
  void set_response(std::size_t part, FlowingGas::Response response) {
    responses_[part] = std::move(response);
    move();
  }
  /// The volumes W of the chambers of a part with its pressures [m^3]; those of a part that is pushed follow from its
  /// response. Collective.
  const Eigen::VectorXd& walls(std::size_t part) {
    evaluate();
    return walls_[part];
  }
  /// Must be called when the positions of a part have changed.
  void move() {
    is_evaluated_ = false;
    has_work_ = false;
  }

  std::size_t parts() const { return parts_.size(); }

  // Quantities of one part at its positions. Collective.

  /// States of its chambers; the pressure of a chamber of prescribed volume is its multiplier.
  const std::vector<GasState>& states(std::size_t part) {
    evaluate();
    return parts_[part].states;
  }
  /// Gradient of the potential by the owned vertices (3 x owned) [N].
  Eigen::Matrix3Xd gradient(std::size_t part);
  /// The potential, summed over the ranks [J].
  double value(std::size_t part);
  /// Before the second derivative is asked for. @returns it, a column a chamber, without projectors. Of several parts
  /// those of joined chambers have no stiffness yet, see `join`
  /// @param left of what is not positive, 0 to 1
  LowRank begin_tangent(std::size_t part, double left);
  /// Gives the columns of all parts the stiffness of what is joined: its volumes change each other's pressures, so the
  /// columns become those along which the symmetric part of this stiffness is diagonal. (It is symmetric where all
  /// pressures are the same.)
  /// @param first column of each part; of one that is pushed, which has none, anything
  void join(LowRank& all, const std::vector<Eigen::Index>& first, double left);
  /// Pressures on the triangles of its surface, whose load stiffness counts [Pa]; empty: none does.
  std::vector<double> load_pressure(std::size_t part);
  /// Bound on the rounding error of the last gradient [N].
  double rounding(std::size_t part) const { return parts_[part].rounding; }

  /// Ends the step. @returns mass and heat that its chambers have exchanged
  /// @param end positions then @param time then [s] @param h length of the whole step [s]
  GasExchange end_step(std::size_t part, const Field& end, double time, double h);

  // Prescribed volumes of a part.

  const std::vector<int>& prescribed(std::size_t part) const { return parts_[part].prescribed; }
  const Eigen::VectorXd& multiplier(std::size_t part) const { return parts_[part].multiplier; }  ///< [Pa]
  void set_multiplier(std::size_t part, const Eigen::VectorXd& pressure);
  /// Changes the pressures to those that leave least of the forces where the step is. Collective.
  void balance(std::size_t part, StepPart& step);
  Eigen::VectorXd pressure_scales(std::size_t part) const;  ///< [Pa]
  Eigen::VectorXd volume_residual(std::size_t part);        ///< [m^3]

 private:
  struct Own : Part {
    std::vector<int> prescribed;
    Eigen::VectorXd multiplier;  ///< pressures of these [Pa]
    double rounding = 0;
    Eigen::Matrix3Xd of_tangent;  ///< positions of all local vertices, where the tangent was last taken
    Field between;                ///< on the way to the present ones
    std::vector<GasState> states;
    double work = 0;  ///< of what is joined, from where the tangent was last taken [J]
  };

  void evaluate();
  void find_work();
  template <class Points>
  void integrate(const Points& points, bool over_volumes);
  Eigen::VectorXd swept_by_rest(Own& own, const Field& end, bool (Chambers::*is_one)(int) const);
  Eigen::VectorXd swept_by_caps(Own& own, const Field& end, const Eigen::VectorXd& walls);

  std::vector<Own> parts_;
  FlowingGas flow_;
  double time_ = 0;
  bool is_evaluated_ = false;  ///< where the parts are
  bool has_work_ = false;      ///< whether the work of joined gas has been found there
  FlowingGas::Walls walls_;    ///< W of all parts
  FlowingGas::Walls of_tangent_;
  std::vector<FlowingGas::Response> responses_;  ///< of all parts
  GasNetwork::Step step_;
  GasNetwork::End end_;
  std::vector<GasExchange> ended_;  ///< of all parts, once the step has ended
};

/// Columns by vertices where these may move. @param projectors of the local vertices (StepPart::projectors)
LowRank projected(LowRank low_rank, const Projectors& projectors);

/// A part of a step with gas in its chambers, which may be one with that of other parts.
class GasFilled {
 public:
  virtual ~GasFilled() = default;

  /// The gas of the part, without the name of its object.
  virtual StepGas::Part gas_part() const = 0;
  /// Replaces the gas of the part by its share of a gas that several parts have in common.
  void share_gas(std::shared_ptr<StepGas> gas, std::size_t part) {
    gas_ = std::move(gas);
    number_ = part;
  }
  /// Ends the step in progress at positions `end`. Collective. @returns mass and heat that its chambers have exchanged
  GasExchange end_gas(const Field& end) { return gas_->end_step(number_, end, time_, h_); }

 protected:
  std::shared_ptr<StepGas> gas_;
  std::size_t number_ = 0;  ///< of the part of the gas
  double time_ = 0;         ///< at the end of the step [s]
  double h_ = 0;            ///< its length [s]
};

}  // namespace pellicle::equilibrium
