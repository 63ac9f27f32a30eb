#include "world/contact_of_object.h"

#include <algorithm>

#include "contact/crossings.h"
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
