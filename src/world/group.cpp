#include "world/group.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "contact/crossings.h"
#include "world/contact_of_object.h"
#include "world/contact_start.h"

namespace pellicle {
inline namespace world {

namespace {

/// Of linear solves where sheets are among several objects, unless a balloon has one of its own: it costs no Newton
/// iterations, and saves half of the linear ones.
constexpr double rtol_of_sheets = 1e-3;

/// Newton iterations of a step in which objects touch, before a shorter one is tried, unless the balloon says.
constexpr int most_iterations_of_contact = 50;

/// @throws Error when an object of those that touch is to do so in another way than the first
void require_alike(const ObjectOptions& first, const ObjectOptions& other) {
  const auto require = [&](const std::string& key, double of_first, double of_other) {
    if (of_first != of_other) {
      throw Error(other.name + ": " + key + ": " + number_text(of_other) + ", expected " + number_text(of_first) +
                  " as of " + first.name + ", which it touches");
    }
  };
  const ContactOptions& a = first.options.contact;
  const ContactOptions& b = other.options.contact;
  require("contact.friction", a.friction, b.friction);
  require("contact.slip_speed", a.slip_speed, b.slip_speed);
  if (a.start != b.start) {
    throw Error(other.name + ": contact.start: " + b.start.name() + ", expected " + a.start.name() + " as of " +
                first.name + ", which it touches");
  }
}

/// Whether the forces on an object alone are brought into balance: a projected sheet is moved.
bool can_balance(const Options& options) {
  return options.chain == ChainKind::inflate || options.dynamics != Dynamics::projection;
}

/// How the step of an object is brought into balance.
NewtonOptions newton_of(const Options& options) {
  if (options.chain == ChainKind::inflate) {
    return options.prism;
  }
  if (options.dynamics == Dynamics::spring) {
    return options.spring;
  }
  NewtonOptions newton = options.elastic;
  if (options.dynamics == Dynamics::projection) {  // The contact of a sheet that has been projected.
    newton.snes_rtol = 1e-8;
    newton.ksp_rtol = 1e-3;
    newton.max_iterations = 0;
    newton.far = FarTangent::exact;
  }
  return newton;
}

/// @throws Error when the forces on linked objects are in balance at different times in a step
void require_same_moment(const ObjectOptions& first, const ObjectOptions& other) {
  const auto radius = [](const Options& options) {  // of generalized alpha
    const bool is_alpha = options.chain == ChainKind::inflate && options.time.scheme == TimeScheme::generalized_alpha;
    return is_alpha ? std::optional(options.time.spectral_radius) : std::nullopt;
  };
  const auto words = [&](const ObjectOptions& object) {
    const std::optional<double> of_object = radius(object.options);
    return of_object ? "generalized_alpha of spectral radius " + number_text(*of_object) : "implicit_euler";
  };
  if (radius(first.options) != radius(other.options)) {
    throw Error(other.name + ": time.scheme: " + words(other) + ", expected " + words(first) + " as of " + first.name +
                ", to whose chambers its own are linked");
  }
}

/// The columns of contacts.csv.
std::vector<History::Column> contacts_columns(const ContactOptions& options) {
  std::vector<History::Column> columns{{"time", "s"},
                                       {"step", ""},
                                       {"contacts", ""},
                                       {"smallest_gap", "m"},
                                       {"contact_energy", "J"},
                                       {"contact_searches", ""},
                                       {"room_used", ""},
                                       {"contact_work", "J"},
                                       {"friction_work", "J"},
                                       {"newton_iterations", ""},
                                       {"linear_iterations", ""},
                                       {"residual_over_tolerance", ""}};
  if (options.check) {
    columns.insert(columns.end(), {{"crossings", ""},
                                   {"crossing_object_1", ""},
                                   {"crossing_element_1", ""},
                                   {"crossing_object_2", ""},
                                   {"crossing_element_2", ""}});
  }
  return columns;
}

}  // namespace

std::string GroupPlan::words() const {
  if (is_single()) {
    return "";
  }
  std::string all;
  for (const std::string& name : names) {
    all += (all.empty() ? "" : ", ") + name;
  }
  return all + (any_touches() ? ": touch each other" : ": are linked") + ", one balance a step";
}

GroupPlan plan_of(const std::string& name, const Options& options) {
  GroupPlan plan;
  plan.objects = {0};
  plan.names = {name};
  plan.touches = {options.contact.self};
  plan.contact = options.contact;
  plan.newton = newton_of(options);
  return plan;
}

std::vector<GroupPlan> plan_groups(const std::deque<ObjectOptions>& objects) {
  const auto touching = std::count_if(objects.begin(), objects.end(),
                                      [](const ObjectOptions& object) { return object.options.contact.self; });
  std::vector<GroupPlan> plans;
  std::vector<const ObjectOptions*> members;
  const ObjectOptions* first_linked = nullptr;
  GroupPlan coupled;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Options& options = objects[i].options;
    const bool is_linked = has_links_elsewhere(options);
    const bool touches_others = options.contact.self && touching > 1;
    if (!is_linked && !touches_others) {
      plans.push_back(plan_of(objects[i].name, options));
      plans.back().objects = {i};
      continue;
    }
    members.push_back(&objects[i]);
    coupled.objects.push_back(i);
    coupled.names.push_back(objects[i].name);
    coupled.touches.push_back(options.contact.self);
    if (options.time.arc_length) {
      throw Error(objects[i].name +
                  ": time.arc_length: does not go with objects that touch or are linked, expected none");
    }
    if (is_linked) {
      first_linked = first_linked == nullptr ? &objects[i] : first_linked;
      require_same_moment(*first_linked, objects[i]);
      if (touches_others && !can_balance(options)) {
        throw Error(objects[i].name +
                    ": contact.self: true of several objects, and gas_network.links to a chamber of another, do not go "
                    "with dynamics: " +
                    options.dynamics.name() + ", expected elastic");
      }
    }
  }
  if (members.empty()) {
    return plans;
  }
  if (members.size() == 1) {
    plans.push_back(plan_of(coupled.names.front(), members.front()->options));
    plans.back().objects = coupled.objects;
    return plans;
  }
  const auto first_that_touches = std::find(coupled.touches.begin(), coupled.touches.end(), true);
  const ObjectOptions& first = first_that_touches == coupled.touches.end()
                                   ? *members.front()
                                   : *members[first_that_touches - coupled.touches.begin()];
  coupled.contact = first.options.contact;
  const auto find = [&members](const auto& is_one) {
    return std::find_if(members.begin(), members.end(),
                        [&is_one](const ObjectOptions* object) { return is_one(object->options); });
  };
  const auto balloon = find([](const Options& options) { return options.chain == ChainKind::inflate; });
  const auto sheet = find([](const Options& options) { return can_balance(options); });
  const ObjectOptions& solving = balloon != members.end() ? **balloon : sheet != members.end() ? **sheet : first;
  coupled.newton = newton_of(solving.options);
  coupled.newton.newton = NewtonEnd::converged;
  coupled.newton.far = FarTangent::exact;
  if (coupled.newton.max_iterations == 0) {
    coupled.newton.max_iterations = most_iterations_of_contact;
  }
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Options& options = members[i]->options;
    if (coupled.touches[i]) {
      require_alike(first, *members[i]);
      coupled.contact.check = coupled.contact.check || options.contact.check;
    }
    if (options.chain == ChainKind::burn && !(balloon != members.end() && coupled.newton.ksp_rtol)) {
      coupled.newton.ksp_rtol = rtol_of_sheets;
    }
  }
  plans.push_back(std::move(coupled));
  return plans;
}

Group::Group(GroupPlan plan, std::vector<std::pair<Object*, StageClock*>> objects, OutputFolder& folder)
    : plan_(std::move(plan)),
      clock_({"implicit step"}),
      clock_of_balance_(plan_.is_single() ? objects.front().second : &clock_) {
  if (!plan_.is_single() && plan_.any_touches()) {
    history_ = std::make_unique<History>(folder, "contacts.csv", contacts_columns(plan_.contact));
  }
  std::vector<StartingObject> starting;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    objects_.push_back(objects[i].first);
    if (plan_.touches[i]) {
      starting.push_back({plan_.names[i], objects_[i]});
    }
  }
  if (!starting.empty() && objects_.front()->state().step == 0) {
    start_line_ = settle_start(plan_.contact, starting);
  }
  equilibrium();  // What is wrong with links is said before anything is written.
}

std::vector<std::string> Group::first_remarks() {
  std::vector<std::string> lines;
  const std::string heading = plan_.is_single() ? heading_of(plan_.names.front()) : "";
  if (!start_line_.empty()) {
    lines.push_back(heading + start_line_);
  }
  const std::string words = equilibrium() != nullptr ? equilibrium()->solver_words() : "";
  if (!words.empty()) {
    const std::string of = plan_.is_single() ? "" : plan_.any_touches() ? " of what touches" : " of what is linked";
    lines.push_back(heading + "linear solver" + of + ": " + words);
  }
  return lines;
}

/// The places of the objects that are not gone.
std::vector<std::size_t> Group::present() const {
  std::vector<std::size_t> present;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (!objects_[i]->is_gone()) {
      present.push_back(i);
    }
  }
  return present;
}

/// Made anew whenever an object has been numbered anew or is gone. @returns null: nothing is left
Equilibrium* Group::equilibrium() {
  std::vector<std::pair<const Object*, int>> numbering;
  for (const std::size_t i : present()) {
    numbering.emplace_back(objects_[i], objects_[i]->replaced());
  }
  if (numbering == numbering_) {
    return equilibrium_.get();
  }
  numbering_ = std::move(numbering);
  equilibrium_ = nullptr;
  std::vector<CoupledMotion> motions;
  for (const std::size_t i : present()) {
    motions.push_back({plan_.names[i], &objects_[i]->motion(), plan_.touches[i]});
  }
  if (!motions.empty()) {
    equilibrium_ = std::make_unique<Equilibrium>(motions, plan_.contact, plan_.newton, *clock_of_balance_,
                                                 plan_.is_single() ? motions.front().motion->stage() : "implicit step");
  }
  return equilibrium_.get();
}

StepResult Group::advance(double h) {
  StepResult all;
  Equilibrium* const equilibrium = this->equilibrium();
  if (equilibrium == nullptr) {
    return all;
  }
  const auto add = [&](std::size_t i, const StepResult& result) {
    all.converged = result.converged;
    all.reason = result.converged ? "" : heading(i) + result.reason;
    return result.converged;
  };
  const std::vector<std::size_t> present = this->present();
  for (const std::size_t i : present) {
    const StepResult begun = objects_[i]->begin(h);
    all.iterations += begun.iterations;
    if (!add(i, begun)) {
      return all;
    }
  }
  last_ = equilibrium->solve(h);
  all.iterations += last_.linear_iterations + last_.moving_iterations;
  all.newton_iterations = last_.newton_iterations;
  if (!last_.converged) {
    all.converged = false;
    all.reason = last_.reason;
    for (const std::size_t i : present) {  // For the picture of what has failed.
      if (const StepPart* part = objects_[i]->motion().part(); part != nullptr) {
        objects_[i]->state().position.values() = part->position().values();
      }
    }
    return all;
  }
  for (std::size_t k = 0; k < present.size(); ++k) {
    const std::size_t i = present[k];
    if (!last_.contact_work.empty()) {
      objects_[i]->state().contact_work += last_.contact_work[k].pressing;
      objects_[i]->state().friction_work += last_.contact_work[k].friction;
    }
    const StepResult ended = objects_[i]->end(last_);
    if (!add(i, ended)) {
      return all;
    }
    const std::string name = plan_.names[i];
    all.figures += (all.figures.empty() ? "" : ", ") + name + (name.empty() ? "" : " ") + ended.figures;
    if (ended.step_error) {
      all.step_error = std::max(*ended.step_error, all.step_error.value_or(0));
    }
  }
  return all;
}

void Group::accept() {
  std::vector<Object*> touching;
  for (const std::size_t i : present()) {
    if (plan_.touches[i]) {
      touching.push_back(objects_[i]);
    }
  }
  open_lips(touching);
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

void Group::record(double time, int step) {
  if (history_ == nullptr) {
    return;
  }
  ContactFigures figures;
  if (last_.contact) {
    figures = *last_.contact;
  } else if (const Equilibrium* common = equilibrium(); common != nullptr && common->contact() != nullptr) {
    figures.smallest_gap = common->contact()->thickness();
  }
  ContactWork work;
  for (const Object* object : objects_) {
    work.pressing += object->state().contact_work;
    work.friction += object->state().friction_work;
  }
  std::vector<double> values{time,
                             static_cast<double>(step),
                             static_cast<double>(figures.contacts),
                             figures.smallest_gap,
                             figures.energy,
                             static_cast<double>(figures.searches),
                             figures.room_used,
                             work.pressing,
                             work.friction,
                             static_cast<double>(last_.newton_iterations),
                             static_cast<double>(last_.linear_iterations),
                             last_.over_tolerance};
  if (plan_.contact.check) {
    std::vector<PlacedSurface> surfaces;
    for (const std::size_t i : present()) {
      if (plan_.touches[i]) {
        surfaces.push_back({objects_[i]->surface(), objects_[i]->state().position, objects_[i]->motion().living()});
      }
    }
    const Crossings crossings = surfaces.empty() ? Crossings() : find_crossings(surfaces);
    values.insert(values.end(), {static_cast<double>(crossings.pairs), static_cast<double>(crossings.surfaces[0]),
                                 static_cast<double>(crossings.elements[0]), static_cast<double>(crossings.surfaces[1]),
                                 static_cast<double>(crossings.elements[1])});
  }
  history_->add(values);
}

}  // namespace world
}  // namespace pellicle
