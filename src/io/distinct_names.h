#pragma once

#include <map>
#include <string>
#include <utility>

#include "base/error.h"
#include "options/spelling.h"

namespace pellicle::io {

/// Names that have to differ, of the files in a folder or of the columns of a table, each with the option that chooses
/// it. Case is ignored, as some file systems, and some programs that read tables, do.
class DistinctNames {
 public:
  /// @param kind of the named things, "file" or "column" @param place where they have to differ, " of history.csv"
  explicit DistinctNames(std::string kind, std::string place = "") : kind_(std::move(kind)), place_(std::move(place)) {}

  /// @param owner key of the option, "bodies.ball"; empty: the program chooses the name
  /// @throws Error, which names both owners, if another has the name
  void add(const std::string& name, const std::string& owner) {
    const auto [first, is_new] = named_.emplace(in_lower_case(name), Named{name, owner});
    if (!is_new) {
      const auto words = [](const std::string& owner) { return owner.empty() ? "the program itself" : owner; };
      const bool is_same = first->second.name == name;
      throw Error(words(first->second.owner) + " and " + words(owner) + " both name the " + kind_ + " " + name +
                  (is_same ? "" : " (or " + first->second.name + ", which differs by upper and lower case alone)") +
                  place_ + "; expected another name of one of them");
    }
  }

 private:
  struct Named {
    std::string name;
    std::string owner;
  };

  std::string kind_;
  std::string place_;
  std::map<std::string, Named> named_;  ///< by the name in lower case
};

}  // namespace pellicle::io
