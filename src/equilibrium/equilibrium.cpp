#include "equilibrium/equilibrium.h"

#include <algorithm>
#include <utility>

#include "contact/crossings.h"
#include "parallel/collective.h"

namespace pellicle::equilibrium {

Equilibrium::Equilibrium(std::vector<CoupledMotion> objects, const ContactOptions& contact,
                         const NewtonOptions& options, StageClock& clock, const std::string& stage)
    : objects_(std::move(objects)), clock_(clock), stage_(stage) {
  std::copy_if(objects_.begin(), objects_.end(), std::back_inserter(balanced_),
               [](const CoupledMotion& object) { return object.motion->part() != nullptr; });
  if (!balanced_.empty()) {
    std::vector<StepPart*> parts;
    std::vector<ContactSurface::Part> surfaces;
    bool any_held = false;
    bool any_touches = false;
    for (const CoupledMotion& object : balanced_) {
      parts.push_back(object.motion->part());
      surfaces.push_back(object.motion->contact_part());
      any_held = any_held || !parts.back()->projectors().bound().empty();
      any_touches = any_touches || object.touches;
    }
    if (any_touches) {
      const bool is_free = !on_any_rank(surfaces.front().surface->comm(), any_held);
      contact_ = std::make_unique<SurfaceContact>(surfaces, contact, is_free);
    }
    objective_ = std::make_unique<StepObjective>(parts, contact_.get(), options.mat_type, options.solver_prefix);
    solver_ = std::make_unique<ImplicitStep>(*objective_, options);
  }
  share_gas();
}

/// Joins the gas in the chambers of linked objects. If only one of them is in the balance its links lead to the ambient
/// air.
void Equilibrium::share_gas() {
  std::vector<StepGas::Part> filled;
  std::vector<std::size_t> part_of;  // place in `balanced_`; of those that are not balanced anything
  std::vector<GasFilled*> sharing;
  std::size_t number = 0;
  for (const CoupledMotion& object : objects_) {
    GasFilled* gas = object.motion->gas();
    const bool is_balanced = object.motion->part() != nullptr;
    if (gas != nullptr && gas->gas_part().chambers->has_links_elsewhere()) {
      filled.push_back(gas->gas_part());
      filled.back().name = object.name;
      sharing.push_back(gas);
      part_of.push_back(is_balanced ? number : 0);
    }
    number += is_balanced ? 1 : 0;
  }
  if (sharing.empty()) {
    return;
  }
  const auto gas = std::make_shared<StepGas>(filled);
  for (std::size_t part = 0; part < sharing.size(); ++part) {
    sharing[part]->share_gas(gas, part);
  }
  if (objective_ != nullptr) {
    objective_->set_joint([gas, part_of](LowRank& all, const std::vector<Eigen::Index>& first, double left) {
      std::vector<Eigen::Index> first_of_gas;
      std::transform(part_of.begin(), part_of.end(), std::back_inserter(first_of_gas),
                     [&first](std::size_t part) { return first[part]; });
      gas->join(all, first_of_gas, left);
    });
  }
}

EquilibriumResult Equilibrium::solve(double h, FactorisedSteps& factorised) {
  EquilibriumResult result;
  const auto fail = [&](const std::string& of_whom, const std::string& reason) {
    result.converged = false;
    result.reason = of_whom + reason;
    for (const CoupledMotion& object : objects_) {
      if (const std::string fault = object.motion->start_fault(); !fault.empty()) {
        result.reason = heading(object) + fault;
        break;
      }
      if (const std::string limit = object.motion->passed_limit(); !limit.empty()) {
        result.reason = heading(object) + limit + ": " + reason;
        break;
      }
    }
    return result;
  };
  const std::string of_all = objects_.size() == 1  ? heading(objects_.front())
                             : contact_ != nullptr ? "what touches: "
                                                   : "what is linked: ";
  for (bool is_done = false; !is_done;) {
    const int newton_iterations = result.newton_iterations;
    const int linear_iterations = result.linear_iterations;
    static_cast<ImplicitResult&>(result) = balance(h, factorised);
    result.newton_iterations += newton_iterations;
    result.linear_iterations += linear_iterations;
    if (!result.converged) {
      return fail(of_all, result.reason);
    }
    for (const CoupledMotion& object : objects_) {
      object.motion->choose_pressures();
    }
    is_done = true;
    for (const CoupledMotion& object : objects_) {
      bool object_is_done = true;
      const StageResult moved = object.motion->move(object_is_done);
      result.moving_iterations += moved.iterations;
      if (!moved.converged) {
        return fail(heading(object), moved.reason);
      }
      is_done = is_done && object_is_done;
    }
  }
  if (const std::string fault = crossed(); !fault.empty()) {
    return fail(of_all, fault);
  }
  count_contact(result);
  return result;
}

/// Brings the objects that have a part into balance.
ImplicitResult Equilibrium::balance(double h, FactorisedSteps& factorised) {
  if (solver_ == nullptr) {
    return {};
  }
  const auto timer = clock_.time(stage_);
  for (std::size_t p = 0; p < balanced_.size() && contact_ != nullptr; ++p) {
    const Motion& motion = *balanced_[p].motion;
    const ContactSurface::Part part = motion.contact_part();
    contact_->set_stiffness(part.stiffness, p);
    if (balanced_[p].touches) {
      contact_->set_surface(motion.constrained(), motion.active(), p);
    } else {
      const std::vector<bool> none(part.surface->triangles.size(), false);
      contact_->set_surface(motion.constrained(), &none, p);
    }
  }
  return solver_->advance(h, factorised);
}

/// Message about surfaces that have passed through each other because they touched at the start, or empty.
std::string Equilibrium::crossed() const {
  if (contact_ == nullptr || !contact_->anything_touched()) {
    return "";
  }
  std::vector<PlacedSurface> before;
  std::vector<PlacedSurface> after;
  std::vector<std::string> names;
  for (const CoupledMotion& object : balanced_) {
    if (object.touches) {
      const Surface& surface = *object.motion->contact_part().surface;
      before.push_back({surface, object.motion->part()->start(), object.motion->active()});
      after.push_back({surface, object.motion->part()->position(), object.motion->active()});
      names.push_back(object.name);
    }
  }
  const Crossings crossings = find_new_crossings(before, after);
  return crossings.pairs == 0 ? ""
                              : "of what touched at its start, " + crossing_words(crossings, names) +
                                    "; expected surfaces apart, as contact.start: untangle makes them";
}

void Equilibrium::count_contact(EquilibriumResult& result) const {
  if (contact_ == nullptr) {
    return;
  }
  result.contact = contact_->figures(objective_->position());
  const std::vector<ContactWork> works = contact_->work(objective_->position());
  std::size_t part = 0;
  for (const CoupledMotion& object : objects_) {
    result.contact_work.push_back(object.motion->part() != nullptr ? works[part++] : ContactWork());
  }
}

std::vector<double> Equilibrium::contact_load(const Motion& motion) const {
  for (std::size_t p = 0; p < balanced_.size() && contact_ != nullptr; ++p) {
    if (balanced_[p].motion == &motion) {
      return contact_->load(p);
    }
  }
  return {};
}

}  // namespace pellicle::equilibrium
