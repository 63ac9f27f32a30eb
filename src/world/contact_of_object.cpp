#include "world/contact_of_object.h"

#include <algorithm>
#include <cstdio>

#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

std::vector<History::Column> contact_columns(const ContactOptions& options) {
  std::vector<History::Column> columns;
  if (options.self && !options.together) {
    columns = {{"self_contacts", ""},
               {"smallest_gap", "m"},
               {"contact_energy", "J"},
               {"contact_searches", ""},
               {"room_used", ""}};
  }
  if (options.self) {
    columns.insert(columns.end(), {{"contact_work", "J"}, {"friction_work", "J"}});
  }
  if (options.check && !options.together) {
    columns.insert(columns.end(), {{"crossings", ""}, {"crossing_element_1", ""}, {"crossing_element_2", ""}});
  }
  return columns;
}

std::vector<double> contact_values(const ContactOptions& options, const std::optional<SurfaceContact>& contact,
                                   const std::optional<ContactFigures>& figures, const Surface& surface,
                                   const ObjectState& state, const std::vector<bool>* living) {
  std::vector<double> values;
  if (contact) {
    const ContactFigures last = figures ? *figures : ContactFigures{0, contact->thickness()};
    values = {static_cast<double>(last.contacts), last.smallest_gap, last.energy, static_cast<double>(last.searches),
              last.room_used};
  }
  if (options.self) {
    values.insert(values.end(), {state.contact_work, state.friction_work});
  }
  if (options.check && !options.together) {
    const Crossings crossings = find_crossings({{surface, state.position, living}});
    values.insert(values.end(), {static_cast<double>(crossings.pairs), static_cast<double>(crossings.elements[0]),
                                 static_cast<double>(crossings.elements[1])});
  }
  return values;
}

std::string crossing_words(const Crossings& crossings, const std::vector<std::string>& names) {
  const auto element = [&](std::size_t k) {
    const std::string& object = names[static_cast<std::size_t>(crossings.surfaces[k])];
    return (object.empty() ? "" : object + "'s ") + std::to_string(crossings.elements[k]);
  };
  std::string words;
  if (crossings.pairs > 0) {
    words = std::to_string(crossings.pairs) + " pairs of triangles pass through each other";
  }
  if (crossings.touching > 0) {
    words += words.empty() ? std::to_string(crossings.touching) + " pairs of triangles touch"
                           : " and " + std::to_string(crossings.touching) + " touch";
  }
  char text[200];
  std::snprintf(text, sizeof text, ", first of elements %s and %s at (%.4g, %.4g, %.4g) m", element(0).c_str(),
                element(1).c_str(), crossings.place[0], crossings.place[1], crossings.place[2]);
  return words + text;
}

std::string passed_through(const SurfaceContact& contact, const std::vector<PlacedSurface>& before,
                           const std::vector<PlacedSurface>& after, const std::vector<std::string>& names) {
  if (!contact.anything_touched()) {
    return "";
  }
  const Crossings crossings = find_new_crossings(before, after);
  return crossings.pairs == 0 ? ""
                              : "of what touched at its start, " + crossing_words(crossings, names) +
                                    "; expected surfaces apart, as contact.start: untangle makes them";
}

bool can_move_alike(MPI_Comm comm, const Projectors& projectors) {
  return !on_any_rank(comm, !projectors.bound().empty());
}

void open_lips(const std::vector<TouchingObject*>& objects) {
  if (std::all_of(objects.begin(), objects.end(),
                  [](const TouchingObject* object) { return object->fresh_lips().empty(); })) {
    return;
  }
  std::vector<CrackedSurface> surfaces;
  for (TouchingObject* object : objects) {
    surfaces.push_back(
        {object->contact_part(), object->living(), object->held(), object->fresh_lips(), object->state().position});
  }
  contact::open_lips(surfaces);
}

}  // namespace world
}  // namespace pellicle
