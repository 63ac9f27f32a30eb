#include "world/group.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "contact/crack_faces.h"
#include "contact/crossings.h"

namespace pellicle::world {

Group::Group(GroupPlan plan, std::vector<Object*> objects)
    : plan_(std::move(plan)), objects_(std::move(objects)), clock_({"implicit step"}) {
  if (const std::vector<Object*> starting = touching(); !starting.empty() && objects_.front()->state().step == 0) {
    start_line_ = settle_start(plan_.contact, starting);
  }
  equilibrium();  // What is wrong with links is said before anything is written.
}

std::vector<std::string> Group::first_remarks() {
  std::vector<std::string> lines;
  const std::string heading = plan_.is_single() ? heading_of(objects_.front()->name()) : "";
  if (!start_line_.empty()) {
    lines.push_back(heading + start_line_);
  }
  const std::string words = equilibrium() != nullptr ? equilibrium()->solver_words() : "";
  if (!words.empty()) {
    const std::string of = plan_.is_single() ? "" : plan_.contact.self ? " of what touches" : " of what is linked";
    lines.push_back(heading + "linear solver" + of + ": " + words);
  }
  return lines;
}

/// The objects that are not gone.
std::vector<Object*> Group::present() const {
  std::vector<Object*> present;
  std::copy_if(objects_.begin(), objects_.end(), std::back_inserter(present),
               [](const Object* object) { return !object->is_gone(); });
  return present;
}

/// The objects that touch each other and are not gone.
std::vector<Object*> Group::touching() const {
  std::vector<Object*> touching;
  std::copy_if(objects_.begin(), objects_.end(), std::back_inserter(touching),
               [](const Object* object) { return object->options().contact.self && !object->is_gone(); });
  return touching;
}

/// Made anew whenever an object has been numbered anew or is gone. @returns null: nothing is left
Equilibrium* Group::equilibrium() {
  const std::vector<Object*> present = this->present();
  std::vector<std::pair<const Object*, int>> numbering;
  for (const Object* object : present) {
    numbering.emplace_back(object, object->replaced());
  }
  if (numbering == numbering_) {
    return equilibrium_.get();
  }
  numbering_ = std::move(numbering);
  equilibrium_ = nullptr;
  std::vector<CoupledMotion> motions;
  for (Object* object : present) {
    motions.push_back({object->name(), &object->motion(), object->options().contact.self});
  }
  if (!motions.empty()) {
    equilibrium_ = std::make_unique<Equilibrium>(motions, plan_.contact, plan_.newton,
                                                 plan_.is_single() ? objects_.front()->clock() : clock_,
                                                 plan_.is_single() ? motions.front().motion->stage() : "implicit step");
  }
  return equilibrium_.get();
}

void Group::advance(double h, StepResult& all) {
  Equilibrium* const equilibrium = this->equilibrium();
  if (equilibrium == nullptr) {
    return;
  }
  const auto is_good = [&](const Object& object, const StageResult& result) {
    all.converged = result.converged;
    all.reason = result.converged ? "" : heading_of(object.name()) + result.reason;
    return result.converged;
  };
  const std::vector<Object*> present = this->present();
  for (Object* object : present) {
    const StageResult begun = object->begin(h);
    all.iterations += begun.iterations;
    if (!is_good(*object, begun)) {
      return;
    }
  }
  FactorisedSteps& factorised = present.front()->state().factorised_steps;
  last_ = equilibrium->solve(h, factorised);
  all.iterations += last_.linear_iterations + last_.moving_iterations;
  all.newton_iterations += last_.newton_iterations;
  if (!last_.converged) {
    all.converged = false;
    all.reason = last_.reason;
    for (Object* object : present) {  // For the picture of what has failed.
      if (const StepPart* part = object->motion().part(); part != nullptr) {
        object->state().position.values() = part->position().values();
      }
    }
    return;
  }
  for (std::size_t k = 0; k < present.size(); ++k) {
    Object& object = *present[k];
    object.state().factorised_steps = factorised;
    if (!last_.contact_work.empty()) {
      object.state().contact_work += last_.contact_work[k].pressing;
      object.state().friction_work += last_.contact_work[k].friction;
    }
    if (!is_good(object, object.end(last_))) {
      return;
    }
    const std::string& name = object.name();
    all.figures += (all.figures.empty() ? "" : ", ") + name + (name.empty() ? "" : " ") +
                   object.motion().progress(object.last_step());
    if (const std::optional<double> error = object.last_step().error; error) {
      all.step_error = std::max(*error, all.step_error.value_or(0));
    }
  }
}

void Group::accept() {
  const std::vector<Object*> touching = this->touching();
  if (std::any_of(touching.begin(), touching.end(),
                  [](const Object* object) { return !object->fresh_crack_faces().empty(); })) {
    std::vector<CrackedSurface> surfaces;
    for (Object* object : touching) {
      const Motion& motion = object->motion();
      surfaces.push_back({motion.contact_part(), motion.active(), motion.constrained(), object->fresh_crack_faces(),
                          object->state().position});
    }
    separate_crack_faces(surfaces);
  }
  if (equilibrium_ != nullptr) {
    std::vector<std::pair<Object*, std::vector<double>>> loads;
    for (Object* object : touching) {
      const bool is_known = std::find(numbering_.begin(), numbering_.end(),
                                      std::pair<const Object*, int>(object, object->replaced())) != numbering_.end();
      loads.emplace_back(object, is_known ? equilibrium_->contact_load(object->motion()) : std::vector<double>());
    }
    for (const auto& [object, load] : loads) {
      if (!load.empty()) {
        object->spread(load);
      }
    }
  }
}

Report Group::report() const {
  ContactFigures figures;
  if (last_.contact) {
    figures = *last_.contact;
  } else if (equilibrium_ != nullptr && equilibrium_->contact() != nullptr) {
    figures.smallest_gap = equilibrium_->contact()->thickness();
  }
  ContactWork work;
  double time = 0;
  PetscInt step = 0;
  for (const Object* object : objects_) {
    work.pressing += object->state().contact_work;
    work.friction += object->state().friction_work;
    time = std::max(time, object->state().time);
    step = std::max(step, object->state().step);
  }
  Report report;
  report.add("time", "s", time);
  report.add("step", "", static_cast<double>(step));
  report.add("contacts", "", static_cast<double>(figures.contacts));
  report.add("smallest_gap", "m", figures.smallest_gap);
  report.add("contact_energy", "J", figures.energy);
  report.add("contact_searches", "", static_cast<double>(figures.searches));
  report.add("room_used", "", figures.room_used);
  report.add("contact_work", "J", work.pressing);
  report.add("friction_work", "J", work.friction);
  report.add("newton_iterations", "", last_.newton_iterations);
  report.add("linear_iterations", "", last_.linear_iterations);
  report.add("residual_over_tolerance", "", last_.over_tolerance);
  if (plan_.contact.check) {
    std::vector<PlacedSurface> surfaces;
    for (const Object* object : touching()) {
      surfaces.push_back({object->surface(), object->state().position, object->state().active_triangles()});
    }
    const Crossings crossings = surfaces.empty() ? Crossings() : find_crossings(surfaces);
    report.add("crossings", "", static_cast<double>(crossings.pairs));
    report.add("crossing_object_1", "", static_cast<double>(crossings.surfaces[0]));
    report.add("crossing_element_1", "", static_cast<double>(crossings.elements[0]));
    report.add("crossing_object_2", "", static_cast<double>(crossings.surfaces[1]));
    report.add("crossing_element_2", "", static_cast<double>(crossings.elements[1]));
  }
  return report;
}

}  // namespace pellicle::world
