#include "world/run_plan.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <utility>

#include "base/sorting.h"
#include "base/units.h"

namespace pellicle::world {

namespace {

/// Relative tolerance of the linear solves of several objects with sheets among them, unless the options of a balloon
/// give one: it costs no Newton iterations, and saves half of the linear ones.
constexpr double rtol_of_sheets = 1e-3;

/// Newton iterations of a step in which objects touch, before a shorter one is tried, unless the balloon says.
constexpr int most_iterations_of_contact = 50;

/// @throws Error when an object of those that touch is to do so in another way than the first
void require_alike(const NamedOptions& first, const NamedOptions& other) {
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
  NewtonOptions newton = elastic_options(options);
  if (options.dynamics == Dynamics::spring) {
    newton = options.spring;
  } else if (options.dynamics == Dynamics::projection) {  // The contact of a sheet that has been projected.
    newton.snes_rtol = 1e-8;
    newton.ksp_rtol = 1e-3;
    newton.max_iterations = 0;
    newton.far = FarTangent::exact;
  }
  if (follows_path(options.time)) {  // It follows from the whole tangent; a solve has to resolve more than its row.
    newton.newton = NewtonEnd::converged;
    newton.far = FarTangent::exact;
    newton.ksp_rtol = std::min(newton.linear_rtol(), 1e-6);
    newton.max_iterations = std::max(newton.max_iterations, 50);
  }
  return newton;
}

/// @throws Error when the forces on linked objects are in balance at different times in a step
void require_same_moment(const NamedOptions& first, const NamedOptions& other) {
  const auto moment = [](const NamedOptions& object) {
    const TimeOptions& time = object.options.time;
    return time.scheme == TimeScheme::generalized_alpha
               ? "generalized_alpha of spectral radius " + number_text(time.spectral_radius)
               : "implicit_euler";
  };
  if (moment(first) != moment(other)) {
    throw Error(other.name + ": time.scheme: " + moment(other) + ", expected " + moment(first) + " as of " +
                first.name + ", to whose chambers its own are linked");
  }
}

bool is_ambient(const std::string& end) { return end.empty() || end == "ambient"; }

std::string object_at(const std::string& end) { return is_ambient(end) ? "" : end.substr(0, end.find('.')); }

/// An end of a link as OBJECT.CHAMBER, whichever object says it.
std::string full_name(const std::deque<NamedOptions>& objects, const NamedOptions& self, const std::string& end,
                      const std::string& key) {
  if (is_ambient(end) || (self.name.empty() && end.find('.') == std::string::npos)) {
    return end;
  }
  if (end.find('.') == std::string::npos) {
    return self.name + "." + end;
  }
  if (self.name.empty()) {
    throw Error(key + ": " + end + ": the run has one object, without a name, expected a chamber of it or ambient");
  }
  std::string names;
  for (const NamedOptions& object : objects) {
    if (object.name == object_at(end)) {
      return end;
    }
    names += (names.empty() ? "" : ", ") + object.name;
  }
  throw Error(key + ": " + end + ": there is no object " + object_at(end) + ", expected a chamber of " + names);
}

bool same(const LinkOptions& a, const LinkOptions& b) {
  return a.from == b.from && a.to == b.to && a.area == b.area && a.discharge == b.discharge && a.opens == b.opens &&
         a.one_way == b.one_way && a.flow == b.flow && a.temperature == b.temperature;
}

/// The plan of the group of several objects.
GroupPlan plan_together(const std::deque<NamedOptions>& objects, std::vector<std::size_t> members) {
  // The first of the members for which something holds; null: none does.
  const auto first_with = [&](const auto& holds) {
    const std::size_t* found = first_that(members, [&](std::size_t i) { return holds(objects[i].options); });
    return found == nullptr ? nullptr : &objects[*found];
  };
  const NamedOptions* const touching = first_with([](const Options& options) { return options.contact.self; });
  const NamedOptions* const balloon =
      first_with([](const Options& options) { return options.chain == ChainKind::inflate; });
  const NamedOptions* const balanced = first_with(can_balance);
  const NamedOptions& first = touching != nullptr ? *touching : objects[members.front()];
  const NamedOptions& solving = balloon != nullptr ? *balloon : balanced != nullptr ? *balanced : first;
  GroupPlan plan{std::move(members), first.options.contact, newton_of(solving.options)};
  plan.newton.newton = NewtonEnd::converged;
  plan.newton.far = FarTangent::exact;
  if (plan.newton.max_iterations == 0) {
    plan.newton.max_iterations = most_iterations_of_contact;
  }
  for (const std::size_t i : plan.objects) {
    const Options& options = objects[i].options;
    if (options.contact.self) {
      require_alike(first, objects[i]);
      plan.contact.check = plan.contact.check || options.contact.check;
    }
    if (options.chain == ChainKind::burn && !(balloon != nullptr && plan.newton.ksp_rtol)) {
      plan.newton.ksp_rtol = rtol_of_sheets;
    }
  }
  return plan;
}

/// The groups of the objects of a plan, which have their links.
std::vector<GroupPlan> plan_groups(const std::deque<NamedOptions>& objects) {
  const auto touching = std::count_if(objects.begin(), objects.end(),
                                      [](const NamedOptions& object) { return object.options.contact.self; });
  std::vector<GroupPlan> plans;
  std::vector<std::size_t> members;
  const NamedOptions* first_linked = nullptr;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Options& options = objects[i].options;
    const bool is_linked = has_links_elsewhere(options);
    const bool touches_others = options.contact.self && touching > 1;
    if (!is_linked && !touches_others) {
      plans.push_back(plan_of(options, i));
      continue;
    }
    members.push_back(i);
    if (follows_path(options.time)) {
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
  if (members.size() == 1) {
    plans.push_back(plan_of(objects[members.front()].options, members.front()));
  } else if (!members.empty()) {
    plans.push_back(plan_together(objects, std::move(members)));
  }
  return plans;
}

}  // namespace

GroupPlan plan_of(const Options& options, std::size_t place) { return {{place}, options.contact, newton_of(options)}; }

RunPlan plan_run(std::deque<NamedOptions> objects) {
  for (const NamedOptions& object : objects) {
    about_object(object.name, [&object] { require_possible(object.options); });
  }
  share_links(objects);
  RunPlan plan;
  plan.objects = std::move(objects);
  plan.groups = plan_groups(plan.objects);
  return plan;
}

std::vector<std::string> RunPlan::lines() const {
  std::vector<std::string> lines;
  for (const GroupPlan& group : groups) {
    if (!group.is_single()) {
      std::vector<std::string> names;
      for (const std::size_t i : group.objects) {
        names.push_back(objects[i].name);
      }
      lines.push_back(fmt::format("{}: {}, one balance a step", fmt::join(names, ", "),
                                  group.contact.self ? "touch each other" : "are linked"));
    }
  }
  return lines;
}

void share_links(std::deque<NamedOptions>& objects) {
  using Links = std::map<std::string, LinkOptions>;
  std::vector<Links> of_objects(objects.size());
  for (std::size_t giver = 0; giver < objects.size(); ++giver) {
    const NamedOptions& self = objects[giver];
    if (!self.options.gas.links.empty() && self.options.chambers.count("ambient") > 0) {
      throw Error(heading_of(self.name) +
                  "chambers.ambient: links name the air outside by this word, expected another name of the chamber");
    }
    for (const auto& [name, given] : self.options.gas.links) {
      const std::string key = "gas_network.links." + name;
      LinkOptions link = given;
      link.from = full_name(objects, self, given.from, key + ".from");
      link.to = full_name(objects, self, given.to, key + ".to");
      for (std::size_t owner = 0; owner < objects.size(); ++owner) {
        const std::string& object = objects[owner].name;
        const bool is_of_none = object_at(link.from).empty() && object_at(link.to).empty();  // Its chambers say so.
        const bool is_owner = object.empty() || object == object_at(link.from) || object == object_at(link.to);
        if (!is_owner && !(is_of_none && owner == giver)) {
          continue;
        }
        const auto [found, is_new] = of_objects[owner].try_emplace(name, link);
        if (!is_new && !same(found->second, link)) {
          throw Error(self.name + ": " + key + ": ends in " + object +
                      ", where another link has this name, expected another one");
        }
      }
    }
  }
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::string own = objects[i].name + ".";
    for (auto& [name, link] : of_objects[i]) {
      for (std::string* end : {&link.from, &link.to}) {
        if (!objects[i].name.empty() && end->compare(0, own.size(), own) == 0) {
          end->erase(0, own.size());
        }
      }
    }
    objects[i].options.gas.links = std::move(of_objects[i]);
  }
}

}  // namespace pellicle::world
