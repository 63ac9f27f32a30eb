#pragma once

#include <mpi.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <utility>

#include "equilibrium/equilibrium.h"
#include "surface/membrane.h"
#include "surface/mesh_rows.h"
#include "surface/sheet.h"
#include "world/group.h"
#include "world/object.h"

namespace pellicle {

/// How a step of an object that is alone has ended.
struct AloneStep : Step {
  bool converged = true;
  std::string reason;  ///< of a failure, in words
};

/// An object without a name that steps by itself; its steps are not accepted, so that its surface is never numbered
/// anew.
class Alone {
 public:
  /// @param mesh on all ranks, of which rank 0's counts
  Alone(const SurfaceMesh& mesh, Options options, ChainKind chain = ChainKind::burn, MPI_Comm comm = PETSC_COMM_WORLD)
      : object("", of_chain(std::move(options), chain), comm, rows_of(comm, mesh)),
        plan_(plan_of(object.options())),
        clock_({object.motion().stage()}),
        equilibrium_({{"", &object.motion(), plan_.contact.self}}, plan_.contact, plan_.newton, clock_,
                     object.motion().stage()) {}

  /// One step of length h [s].
  AloneStep advance(double h) {
    AloneStep step;
    const auto take = [&](const StageResult& result) {
      step.converged = result.converged;
      step.reason = result.reason;
    };
    take(object.begin(h));
    if (step.converged) {
      const EquilibriumResult balance = equilibrium_.solve(h, state().factorised_steps);
      step.converged = balance.converged;
      step.reason = balance.reason;
      if (balance.converged) {
        if (!balance.contact_work.empty()) {
          state().contact_work += balance.contact_work[0].pressing;
          state().friction_work += balance.contact_work[0].friction;
        }
        take(object.end(balance));
      }
    }
    static_cast<Step&>(step) = object.last_step();
    return step;
  }

  State& state() { return object.state(); }
  const State& state() const { return object.state(); }
  BurningFields& burning() { return *object.state().burning; }
  const BurningFields& burning() const { return *object.state().burning; }
  const Surface& surface() const { return object.surface(); }
  const Sheet& sheet() const { return static_cast<const Sheet&>(object.surface()); }
  const Membrane& membrane() const { return static_cast<const Membrane&>(object.surface()); }
  const Chambers& chambers() const { return *object.chambers(); }
  /// A number of the history about the last step, by its column. Collective.
  double figure(const std::string& column) const {
    const Report report = object.report(0, false);
    for (std::size_t i = 0; i < report.columns().size(); ++i) {
      if (report.columns()[i].name == column) {
        return report.values()[i];
      }
    }
    throw std::logic_error("no number of the name " + column);
  }
  /// Sums over the owned particles of all ranks. Collective.
  double sum(const std::function<double(PetscInt)>& of) const {
    return sum_of_vectors([&of](PetscInt i) { return Eigen::Vector3d(of(i), 0, 0); }).x();
  }
  Eigen::Vector3d sum_of_vectors(const std::function<Eigen::Vector3d(PetscInt)>& of) const {
    Eigen::Vector3d total = Eigen::Vector3d::Zero();
    for (PetscInt i = 0; i < surface().particles.owned; ++i) {
      total += of(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, total.data(), 3, MPI_DOUBLE, MPI_SUM, surface().comm());
    return total;
  }
  /// Mass that moves [kg], and its momentum [kg m/s]. Collective.
  double mass() const {
    return sum([this](PetscInt i) { return object.motion().mass()[i]; });
  }
  Eigen::Vector3d momentum() const {
    return sum_of_vectors(
        [this](PetscInt i) -> Eigen::Vector3d { return object.motion().mass()[i] * state().velocity.vector(i); });
  }
  /// Coordinate z of the particle of an id [m]. Collective.
  double height_of(PetscInt id) const {
    return sum([&](PetscInt i) { return surface().persistent_id[i] == id ? state().position.vector(i).z() : 0; });
  }
  /// Null: nothing touches.
  const SurfaceContact* contact() const { return equilibrium_.contact(); }
  /// The balance of a step that has begun.
  EquilibriumResult solve(double h) { return equilibrium_.solve(h, state().factorised_steps); }

  Object object;

 private:
  /// Whether or not the options say which chain it is.
  static Options of_chain(Options options, ChainKind chain) {
    options.chain = chain;
    return options;
  }

  GroupPlan plan_;
  StageClock clock_;
  Equilibrium equilibrium_;
};

}  // namespace pellicle
