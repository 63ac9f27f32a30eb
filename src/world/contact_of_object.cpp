#include "world/contact_of_object.h"

#include <algorithm>

#include "contact/body_contact.h"
#include "contact/crossings.h"

namespace pellicle {
inline namespace world {

void report_contact(Report& report, const ContactOptions& options, bool apart,
                    const std::optional<ContactFigures>& figures, const Surface& surface, const State& state) {
  if (options.self && !apart) {
    const ContactFigures last = figures ? *figures : ContactFigures{0, contact_thickness(surface, options)};
    report.add("self_contacts", "", static_cast<double>(last.contacts));
    report.add("smallest_gap", "m", last.smallest_gap);
    report.add("contact_energy", "J", last.energy);
    report.add("contact_searches", "", static_cast<double>(last.searches));
    report.add("room_used", "", last.room_used);
  }
  if (options.self) {
    report.add("contact_work", "J", state.contact_work);
    report.add("friction_work", "J", state.friction_work);
  }
  if (options.check && !apart) {
    const Crossings crossings = find_crossings({{surface, state.position, state.active_triangles()}});
    report.add("crossings", "", static_cast<double>(crossings.pairs));
    report.add("crossing_element_1", "", static_cast<double>(crossings.elements[0]));
    report.add("crossing_element_2", "", static_cast<double>(crossings.elements[1]));
  }
}

void separate_crack_faces(const std::vector<Object*>& objects) {
  if (std::all_of(objects.begin(), objects.end(),
                  [](const Object* object) { return object->fresh_crack_faces().empty(); })) {
    return;
  }
  std::vector<CrackedSurface> surfaces;
  for (Object* object : objects) {
    const Motion& motion = object->motion();
    surfaces.push_back({motion.contact_part(), motion.active(), motion.constrained(), object->fresh_crack_faces(),
                        object->state().position});
  }
  contact::separate_crack_faces(surfaces);
}

}  // namespace world
}  // namespace pellicle
