#pragma once

#include <array>
#include <string>

#include "base/namespaces.h"

namespace pellicle::base {

/// Exponents of metre, kilogram, second, kelvin, mole and radian: an angle is not a pure number, so that neither is
/// read as the other.
using Dimension = std::array<int, 6>;

/// A unit: a quantity of `value` in it is `factor * value + offset` in SI.
struct Unit {
  double factor = 1;
  double offset = 0;  ///< not 0 for degC alone
  Dimension dimension{};
};

/// A number of a deck, converted to SI.
struct Quantity {
  double value = 0;
  Dimension dimension{};
  bool bare = false;  ///< given without a unit: SI of any dimension
};

/// Reads a unit such as "mm", "kg/m^2", "1/(K s)", "W/(m^2 K)" or "degC"; "1" is the pure number. Factors are joined
/// by a space or `*`; what follows a `/` must be in parentheses when it has several factors.
/// Known: m g s K mol N Pa J W Hz l with the prefixes n u m c k M G; t min h bar rad deg % degC.
/// @throws Error with the fault; the caller adds the expected value.
Unit parse_unit(const std::string& text);

/// Reads "0.3 mm", "450 degC" or "1e-3". @throws Error if there is no finite number, or an unknown unit.
Quantity parse_quantity(const std::string& text);

/// Description of a quantity of a unit: "a length such as 0.3 mm", "a quantity in 1/(K s)".
std::string example_of(const std::string& unit);

/// The shortest text that reads back as the same number.
std::string number_text(double value);

/// A text without the blanks at its ends.
std::string trimmed(const std::string& text);

}  // namespace pellicle::base
