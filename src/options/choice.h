#pragma once

#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::options {

class OptionTable;  // to which headers of options declare how they are added
struct Condition;   // under which they are

/// The names of the rows of a table, in their order: those of an enumeration's values that a table describes.
template <class Table>
std::vector<std::string> names_in(const Table& table) {
  std::vector<std::string> names;
  for (const auto& row : table) {
    names.push_back(row.name);
  }
  return names;
}

/// One of several names, for any enumeration: the part of a Choice that the option table uses.
class AnyChoice {
 public:
  const std::vector<std::string>& names() const { return *names_; }
  const std::string& name() const { return (*names_)[index_]; }
  /// @throws Error if the name is not among the names
  void set(const std::string& name);

 protected:
  AnyChoice(const std::vector<std::string>& names, std::size_t index) : names_(&names), index_(index) {}
  std::size_t index_value() const { return index_; }

 private:
  const std::vector<std::string>* names_;
  std::size_t index_;
};

/// An option's value of an enumeration. Next to the enumeration a function lists, once, the names of its values in
/// their order from 0:
///
///     enum class ChainKind { burn, inflate };
///     inline std::vector<std::string> names_of(ChainKind) { return {"burn", "inflate"}; }
///
/// and `table.add("chain", options.chain)` declares the option with these names.
template <class E>
class Choice : public AnyChoice {
 public:
  Choice(E value) : AnyChoice(all_names(), static_cast<std::size_t>(value)) {}  // NOLINT(google-explicit-constructor)
  /// @throws Error when the enumeration has no such name
  Choice(const std::string& name) : Choice(E{}) { set(name); }  // NOLINT(google-explicit-constructor)
  Choice(const char* name) : Choice(std::string(name)) {}       // NOLINT(google-explicit-constructor)

  operator E() const { return static_cast<E>(index_value()); }  // NOLINT(google-explicit-constructor)

 private:
  static const std::vector<std::string>& all_names() {
    static const std::vector<std::string> names = names_of(E{});
    return names;
  }
};

}  // namespace pellicle::options
