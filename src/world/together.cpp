#include "world/together.h"

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

/// Of linear solves where sheets are among what touches, unless the balloon has one of its own: it costs no Newton
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

/// Whether forces on an object are brought into balance: a sheet that is not elastic is moved.
bool can_balance(const Options& options) {
  return options.chain == ChainKind::inflate || options.dynamics == Dynamics::elastic;
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

std::optional<TogetherOptions> find_together(std::deque<ObjectOptions>& objects) {
  const auto touching = std::count_if(objects.begin(), objects.end(),
                                      [](const ObjectOptions& object) { return object.options.contact.self; });
  std::vector<ObjectOptions*> members;
  const ObjectOptions* first_linked = nullptr;
  TogetherOptions together;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Options& options = objects[i].options;
    const bool is_linked = has_links_elsewhere(options);
    const bool touches_others = options.contact.self && touching > 1;
    if (is_linked || touches_others) {
      members.push_back(&objects[i]);
      together.objects.push_back(i);
      together.names.push_back(objects[i].name);
      together.touches.push_back(options.contact.self && (touches_others || can_balance(options)));
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
  if (members.size() < 2) {
    return std::nullopt;
  }
  const auto first_that_touches = std::find(together.touches.begin(), together.touches.end(), true);
  const auto first_of_contact = first_that_touches == together.touches.end()
                                    ? 0
                                    : static_cast<std::size_t>(first_that_touches - together.touches.begin());
  const ObjectOptions& first = *members[first_of_contact];
  together.contact = first.options.contact;
  const auto balloon = std::find_if(members.begin(), members.end(), [](const ObjectOptions* object) {
    return object->options.chain == ChainKind::inflate;
  });
  if (balloon != members.end()) {
    together.step = (*balloon)->options.prism;
  } else {
    const auto sheet = std::find_if(members.begin(), members.end(),
                                    [](const ObjectOptions* object) { return can_balance(object->options); });
    together.step.solver_prefix = (sheet != members.end() ? *sheet : members.front())->options.elastic.solver_prefix;
  }
  together.step.newton = NewtonEnd::converged;
  if (together.step.max_iterations == 0) {
    together.step.max_iterations = most_iterations_of_contact;
  }
  together.step.inertia = together.step.inertia && first.options.time.scheme != TimeScheme::statics;
  together.step.positive_elements = false;
  for (std::size_t i = 0; i < members.size(); ++i) {
    Options& options = members[i]->options;
    if (together.touches[i]) {
      require_alike(first, *members[i]);
    } else if (!can_balance(options)) {
      continue;
    }
    options.contact.together = true;
    together.contact.check = together.contact.check || options.contact.check;
    if (options.chain == ChainKind::burn && !together.step.ksp_rtol) {
      together.step.ksp_rtol = rtol_of_sheets;
    }
  }
  return together;
}

Together::Step::Step(const std::vector<StepPart*>& parts, std::unique_ptr<SurfaceContact> contact,
                     const TogetherOptions& options)
    : contact(std::move(contact)),
      objective(parts, this->contact ? std::vector<Potential*>{this->contact.get()} : std::vector<Potential*>(),
                options.step.mat_type, options.step.solver_prefix),
      solver(objective, options.step) {}

Together::Together(TogetherOptions options, const std::vector<Object*>& objects, OutputFolder& folder)
    : options_(std::move(options)), clock_({"implicit step"}) {
  if (options_.any_touches()) {
    history_ = std::make_unique<History>(folder, "contacts.csv", contacts_columns(options_.contact));
  }
  for (const std::size_t i : options_.objects) {
    objects_.push_back(objects[i]->touching());
  }
  std::vector<StartingObject> starting;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (options_.touches[i]) {
      starting.push_back({options_.names[i], objects_[i]});
    }
  }
  if (!starting.empty() && objects_.front()->state().step == 0) {
    start_line_ = settle_start(options_.contact, starting);
  }
  common();  // What is wrong with links is said before anything is written.
}

bool Together::has(const Object* object) const {
  return std::find(objects_.begin(), objects_.end(), object) != objects_.end();
}

/// Of an object that takes part: itself and others.
bool Together::touches(const Object* object) const {
  return options_
      .touches[static_cast<std::size_t>(std::find(objects_.begin(), objects_.end(), object) - objects_.begin())];
}

std::vector<TouchingObject*> Together::present() const {
  std::vector<TouchingObject*> present;
  std::copy_if(objects_.begin(), objects_.end(), std::back_inserter(present),
               [](const Object* object) { return !object->is_gone(); });
  return present;
}

/// Of these what is brought into balance.
std::vector<TouchingObject*> Together::with_parts() const {
  std::vector<TouchingObject*> objects = present();
  objects.erase(
      std::remove_if(objects.begin(), objects.end(), [](TouchingObject* object) { return object->part() == nullptr; }),
      objects.end());
  return objects;
}

std::string Together::solver_words() {
  const Step* step = common();
  return step == nullptr ? "" : "linear solver of what " + what() + ": " + step->solver.solver_words();
}

/// Made anew whenever an object has been numbered anew or is gone. @returns null: there is nothing to balance
Together::Step* Together::common() {
  std::vector<std::pair<const TouchingObject*, int>> numbering;
  for (const TouchingObject* object : present()) {
    numbering.emplace_back(object, object->replaced());
  }
  if (numbering == numbering_) {
    return step_.get();
  }
  numbering_ = std::move(numbering);
  std::vector<StepPart*> parts;
  std::vector<ContactSurface::Part> surfaces;
  for (TouchingObject* object : with_parts()) {
    parts.push_back(object->part());
    surfaces.push_back(object->contact_part());
  }
  step_ = nullptr;
  if (!parts.empty()) {
    std::unique_ptr<SurfaceContact> contact;
    if (options_.any_touches()) {
      const bool is_free = std::all_of(parts.begin(), parts.end(), [&](const StepPart* part) {
        return can_move_alike(surfaces.front().surface->comm(), part->projectors());
      });
      contact = std::make_unique<SurfaceContact>(surfaces, options_.contact, is_free);
    }
    step_ = std::make_unique<Step>(parts, std::move(contact), options_);
  }
  share_gas();
  return step_.get();
}

/// Makes one gas of what is in the chambers of parts that are linked. Where only one of them is left its links lead to
/// the ambient air.
void Together::share_gas() {
  std::vector<StepGas::Part> filled;
  std::vector<std::size_t> columns_of;  // the parts that have them
  std::vector<GasFilled*> sharing;
  std::size_t number = 0;  // of the part
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (objects_[i]->is_gone()) {
      continue;
    }
    GasFilled* gas = objects_[i]->gas();
    const bool is_part = objects_[i]->part() != nullptr;
    if (gas != nullptr && gas->gas_part().chambers->has_links_elsewhere()) {
      filled.push_back(gas->gas_part());
      filled.back().object = options_.names[i];
      sharing.push_back(gas);
      columns_of.push_back(is_part ? number : 0);
    }
    number += is_part ? 1 : 0;
  }
  if (sharing.empty()) {
    return;
  }
  const auto gas = std::make_shared<StepGas>(filled);
  for (std::size_t part = 0; part < sharing.size(); ++part) {
    sharing[part]->share_gas(gas, part);
  }
  if (step_ == nullptr) {
    return;
  }
  step_->objective.set_joint([gas, columns_of](LowRank& all, const std::vector<Eigen::Index>& first, double left) {
    std::vector<Eigen::Index> of_gas;
    std::transform(columns_of.begin(), columns_of.end(), std::back_inserter(of_gas),
                   [&first](std::size_t part) { return first[part]; });
    gas->join(all, of_gas, left);
  });
}

const std::string& Together::name_of(const Object* object) const {
  return options_
      .names[static_cast<std::size_t>(std::find(objects_.begin(), objects_.end(), object) - objects_.begin())];
}

StepResult Together::advance(double h) {
  StepResult all;
  const std::vector<TouchingObject*> objects = present();
  if (objects.empty()) {
    return all;
  }
  const auto add = [&](const Object* object, const StepResult& result) {
    all.converged = result.converged;
    all.reason = result.converged ? "" : heading_of(name_of(object)) + result.reason;
    return result.converged;
  };
  common();
  for (TouchingObject* object : objects) {
    const StepResult begun = object->begin(h);
    all.iterations += begun.iterations;
    if (!add(object, begun)) {
      return all;
    }
  }
  std::vector<TouchingObject*> movers;
  std::copy_if(objects.begin(), objects.end(), std::back_inserter(movers),
               [](TouchingObject* object) { return object->part() == nullptr; });
  last_ = {};
  for (bool are_done = false; !are_done;) {
    const StepResult balanced = balance(h);
    all.iterations += balanced.iterations;
    if (!balanced.converged) {
      all.converged = false;
      all.reason = "what " + what() + ": " + balanced.reason;
      for (const TouchingObject* object : objects) {
        if (const std::string fault = object->start_fault(); !fault.empty()) {
          all.reason = heading_of(name_of(object)) + fault;
          break;
        }
      }
      return all;
    }
    for (TouchingObject* object : movers) {
      object->choose_pressures();
    }
    are_done = true;
    for (TouchingObject* object : movers) {
      bool is_done = true;
      const StepResult moved = object->move(is_done);
      all.iterations += moved.iterations;
      if (!add(object, moved)) {
        return all;
      }
      are_done = are_done && is_done;
    }
  }
  if (const std::string fault = crossed(); !fault.empty()) {
    all.converged = false;
    all.reason = "what " + what() + ": " + fault;
    return all;
  }
  all.newton_iterations = last_.newton_iterations;
  count_contact();
  for (TouchingObject* object : objects) {
    const StepResult ended = object->end(last_);
    if (!add(object, ended)) {
      return all;
    }
    all.figures += (all.figures.empty() ? "" : ", ") + name_of(object) + " " + ended.figures;
    if (ended.step_error) {
      all.step_error = std::max(*ended.step_error, all.step_error.value_or(0));
    }
  }
  return all;
}

void Together::accept() {
  std::vector<TouchingObject*> touching = present();
  touching.erase(std::remove_if(touching.begin(), touching.end(), [this](const Object* o) { return !touches(o); }),
                 touching.end());
  open_lips(touching);
  if (const Step* step = common(); step != nullptr && step->contact != nullptr) {
    const std::vector<TouchingObject*> objects = with_parts();
    for (std::size_t p = 0; p < objects.size(); ++p) {
      objects[p]->spread(step->contact->load(p));
    }
  }
}

/// Brings what has a part into balance.
StepResult Together::balance(double h) {
  Step* step = common();
  if (step == nullptr) {
    return {};
  }
  const std::vector<TouchingObject*> objects = with_parts();
  const auto timer = clock_.time("implicit step");
  for (std::size_t p = 0; p < objects.size() && step->contact != nullptr; ++p) {
    step->contact->set_stiffness(objects[p]->contact_part().stiffness, p);
    const std::vector<bool> none(objects[p]->surface().triangles.size(), false);
    step->contact->set_surface(objects[p]->held(), touches(objects[p]) ? objects[p]->living() : &none, p);
  }
  const ImplicitResult before = std::exchange(last_, step->solver.advance(h));
  StepResult result;
  result.converged = last_.converged;
  result.reason = last_.reason;
  result.iterations = last_.linear_iterations;
  last_.newton_iterations += before.newton_iterations;
  last_.linear_iterations += before.linear_iterations;
  return result;
}

/// In words, what of the objects has passed through something in the balance because it touched; empty: nothing has.
std::string Together::crossed() {
  Step* step = common();
  if (step == nullptr || step->contact == nullptr) {
    return "";
  }
  std::vector<PlacedSurface> before;
  std::vector<PlacedSurface> after;
  std::vector<std::string> names;
  for (TouchingObject* object : with_parts()) {
    if (touches(object)) {
      before.push_back({object->surface(), object->part()->start(), object->living()});
      after.push_back({object->surface(), object->part()->position(), object->living()});
      names.push_back(name_of(object));
    }
  }
  return before.empty() ? "" : passed_through(*step->contact, before, after, names);
}

/// How what touches does so in the balance, and the work of it.
void Together::count_contact() {
  Step* step = common();
  if (step == nullptr || step->contact == nullptr) {
    return;
  }
  figures_ = step->contact->figures(step->objective.position());
  const std::vector<ContactWork> works = step->contact->work(step->objective.position());
  const std::vector<TouchingObject*> objects = with_parts();
  for (std::size_t p = 0; p < objects.size(); ++p) {
    objects[p]->state().contact_work += works[p].pressing;
    objects[p]->state().friction_work += works[p].friction;
  }
}

void Together::record(double time, int step) {
  if (history_ == nullptr) {
    return;
  }
  const std::vector<TouchingObject*> objects = present();
  ContactFigures figures;
  if (figures_) {
    figures = *figures_;
  } else if (const Step* step = common(); step != nullptr) {
    figures.smallest_gap = step->contact->thickness();
  }
  ContactWork work;
  for (const TouchingObject* object : objects_) {
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
  if (options_.contact.check) {
    std::vector<PlacedSurface> surfaces;
    for (const TouchingObject* object : objects) {
      if (!touches(object)) {
        continue;
      }
      surfaces.push_back({object->surface(), object->state().position, object->living()});
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
