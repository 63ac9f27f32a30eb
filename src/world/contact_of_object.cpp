#include "world/contact_of_object.h"

#include "contact/crossings.h"

namespace pellicle {
inline namespace world {

std::vector<History::Column> contact_columns(const ContactOptions& options) {
  std::vector<History::Column> columns;
  if (options.self && !options.together) {
    columns = {{"self_contacts", ""}, {"smallest_gap", "m"}, {"contact_energy", "J"}, {"contact_searches", ""}};
  }
  if (options.check && !options.together) {
    columns.insert(columns.end(), {{"crossings", ""}, {"crossing_element_1", ""}, {"crossing_element_2", ""}});
  }
  return columns;
}

std::vector<double> contact_values(const ContactOptions& options, const std::optional<SurfaceContact>& contact,
                                   const Surface& surface, const Field& position, const std::vector<bool>* living) {
  std::vector<double> values;
  if (contact) {
    const ContactFigures figures = contact->figures(position);
    values = {static_cast<double>(figures.contacts), figures.smallest_gap, figures.energy,
              static_cast<double>(figures.searches)};
  }
  if (options.check && !options.together) {
    const Crossings crossings = find_crossings({{surface, position, living}});
    values.insert(values.end(), {static_cast<double>(crossings.pairs), static_cast<double>(crossings.elements[0]),
                                 static_cast<double>(crossings.elements[1])});
  }
  return values;
}

}  // namespace world
}  // namespace pellicle
