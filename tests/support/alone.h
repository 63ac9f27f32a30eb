#pragma once

#include <type_traits>

#include "equilibrium/equilibrium.h"
#include "world/group.h"
#include "world/inflate.h"

namespace pellicle {

/// A sheet or a balloon that steps by itself.
/// @tparam Chain Burn or Inflate
template <class Chain>
class Alone {
 public:
  /// @param chain must outlive it
  explicit Alone(Chain& chain)
      : chain_(chain),
        plan_(plan_of("", options_of(chain))),
        clock_({chain.stage()}),
        equilibrium_({{"", &chain, plan_.touches[0]}}, plan_.contact, plan_.newton, clock_, chain.stage()) {}

  /// One step of length h [s]. @returns BurnStep or InflateStep
  template <class State>
  auto advance(State& state, double h) {
    auto step = chain_.begin(state, h);
    if (step.converged) {
      const EquilibriumResult balance = equilibrium_.solve(h);
      step.converged = balance.converged;
      step.reason = balance.reason;
      step.newton_iterations = balance.newton_iterations;
      if (balance.converged) {
        if (!balance.contact_work.empty()) {
          state.contact_work += balance.contact_work[0].pressing;
          state.friction_work += balance.contact_work[0].friction;
        }
        chain_.end(state, balance, step);
      }
    }
    return step;
  }

  /// Null: nothing touches.
  const SurfaceContact* contact() const { return equilibrium_.contact(); }
  /// The balance of a step that has begun.
  EquilibriumResult solve(double h) { return equilibrium_.solve(h); }

 private:
  /// Whether or not they say which chain it is.
  static Options options_of(const Chain& chain) {
    Options options = chain.options();
    options.chain = std::is_same_v<Chain, Inflate> ? ChainKind::inflate : ChainKind::burn;
    return options;
  }

  Chain& chain_;
  GroupPlan plan_;
  StageClock clock_;
  Equilibrium equilibrium_;
};

/// One step of length h [s], by an equilibrium of its own.
template <class Chain, class State>
auto advance_alone(Chain& chain, State& state, double h) {
  return Alone<Chain>(chain).advance(state, h);
}

}  // namespace pellicle
