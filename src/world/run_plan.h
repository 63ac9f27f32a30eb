#pragma once

#include <deque>
#include <string>
#include <vector>

#include "base/error.h"
#include "contact/contact_surface.h"
#include "energies/newton_options.h"
#include "world/options.h"

namespace pellicle::world {

/// The plan of a group: the objects of a run that are brought into balance together, because they touch each other or
/// their chambers are linked, and how that is done. An object that does neither is a group of its own.
struct GroupPlan {
  std::vector<std::size_t> objects;  ///< which, by their places in the run
  ContactOptions contact;            ///< `self`: whether those of them that have it touch themselves and each other
  NewtonOptions newton;

  bool is_single() const { return objects.size() == 1; }
};

/// The plan of a run, made once from the options of all its objects: it gives each object its links and says which
/// objects touch each other.
struct RunPlan {
  std::deque<NamedOptions> objects;  ///< with the links that join their chambers
  std::vector<GroupPlan> groups;     ///< each object is in one of them

  /// A line about each group of several objects that says who touches whom, such as "cloth, ball: touch each other".
  std::vector<std::string> lines() const;
};

/// Makes the plan of a run: objects with `contact.self` touch each other, and links join chambers of several.
/// @throws Error, with the name of the object, on options that do not go together; when objects are to touch in
/// different ways, are linked and balance forces at different times in a step, or cannot be brought into balance with
/// others; and on links as share_links does
RunPlan plan_run(std::deque<NamedOptions> objects);

/// The plan of the group of a single object. @param place of the object in the run
GroupPlan plan_of(const Options& options, std::size_t place = 0);

/// Gives every link of a run to the objects whose chambers it joins, and to no others. An end is a chamber of the
/// object in whose options the link is, or OBJECT.CHAMBER, or the ambient air; afterwards only ends in another object
/// are written OBJECT.CHAMBER. A link at the top of a deck is a single link, however many objects it is given to.
/// @throws Error that names object, link and key: an object that does not exist, links of one name that differ
void share_links(std::deque<NamedOptions>& objects);

/// "cloth: " of the name of an object, the beginning of a line; "" of one without a name.
inline std::string heading_of(const std::string& object) { return object.empty() ? "" : object + ": "; }

/// The key of an object in a deck: "objects.cloth"; "" of one without a name.
inline std::string key_of(const std::string& object) { return object.empty() ? "" : "objects." + object; }

/// Adds lines about an object, with its name before each.
inline void add_lines(std::vector<std::string>& lines, const std::string& object,
                      const std::vector<std::string>& of_object) {
  for (const std::string& line : of_object) {
    lines.push_back(heading_of(object) + line);
  }
}

/// Runs `work` on behalf of an object. @throws Error as `work` does, with the object's name before it
template <class Work>
auto about_object(const std::string& object, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    throw Error(heading_of(object) + error.what());
  }
}

}  // namespace pellicle::world
