#include "world/contact_of_object.h"

#include <algorithm>
#include <cstdio>

#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

std::vector<History::Column> contact_columns(const ContactOptions& options, bool apart) {
  std::vector<History::Column> columns;
  if (options.self && !apart) {
    columns = {{"self_contacts", ""},
               {"smallest_gap", "m"},
               {"contact_energy", "J"},
               {"contact_searches", ""},
               {"room_used", ""}};
  }
  if (options.self) {
    columns.insert(columns.end(), {{"contact_work", "J"}, {"friction_work", "J"}});
  }
  if (options.check && !apart) {
    columns.insert(columns.end(), {{"crossings", ""}, {"crossing_element_1", ""}, {"crossing_element_2", ""}});
  }
  return columns;
}

std::vector<double> contact_values(const ContactOptions& options, bool apart,
                                   const std::optional<ContactFigures>& figures, const Surface& surface,
                                   const ObjectState& state, const std::vector<bool>* living) {
  std::vector<double> values;
  if (options.self && !apart) {
    const ContactFigures last = figures ? *figures : ContactFigures{0, contact_thickness(surface, options)};
    values = {static_cast<double>(last.contacts), last.smallest_gap, last.energy, static_cast<double>(last.searches),
              last.room_used};
  }
  if (options.self) {
    values.insert(values.end(), {state.contact_work, state.friction_work});
  }
  if (options.check && !apart) {
    const Crossings crossings = find_crossings({{surface, state.position, living}});
    values.insert(values.end(), {static_cast<double>(crossings.pairs), static_cast<double>(crossings.elements[0]),
                                 static_cast<double>(crossings.elements[1])});
  }
  return values;
}

void open_lips(const std::vector<Object*>& objects) {
  if (std::all_of(objects.begin(), objects.end(), [](const Object* object) { return object->fresh_lips().empty(); })) {
    return;
  }
  std::vector<CrackedSurface> surfaces;
  for (Object* object : objects) {
    const Motion& motion = object->motion();
    surfaces.push_back(
        {motion.contact_part(), motion.living(), motion.held(), object->fresh_lips(), object->state().position});
  }
  contact::open_lips(surfaces);
}

}  // namespace world
}  // namespace pellicle
