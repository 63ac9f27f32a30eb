#include "world/gas_links.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "world/object.h"

namespace pellicle {
inline namespace world {

namespace {

bool is_ambient(const std::string& end) { return end.empty() || end == "ambient"; }

std::string object_at(const std::string& end) { return is_ambient(end) ? "" : end.substr(0, end.find('.')); }

/// An end of a link as OBJECT.CHAMBER, whichever object says it.
std::string full_name(const std::deque<ObjectOptions>& objects, const ObjectOptions& self, const std::string& end,
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
  for (const ObjectOptions& object : objects) {
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

}  // namespace

void share_links(std::deque<ObjectOptions>& objects) {
  using Links = std::map<std::string, LinkOptions>;
  std::vector<Links> of_objects(objects.size());
  for (std::size_t giver = 0; giver < objects.size(); ++giver) {
    const ObjectOptions& self = objects[giver];
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

}  // namespace world
}  // namespace pellicle
