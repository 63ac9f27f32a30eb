#include "base/units.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.h"

namespace pellicle::base {

namespace {

constexpr double pi = 3.14159265358979323846;

std::optional<Unit> find_unit(const std::string& symbol) {
  static const std::map<std::string, Unit> prefixable{
      {"m", {1, 0, {1, 0, 0, 0}}},    {"g", {1e-3, 0, {0, 1, 0, 0}}},  {"s", {1, 0, {0, 0, 1, 0}}},
      {"K", {1, 0, {0, 0, 0, 1}}},    {"N", {1, 0, {1, 1, -2, 0}}},    {"Pa", {1, 0, {-1, 1, -2, 0}}},
      {"J", {1, 0, {2, 1, -2, 0}}},   {"W", {1, 0, {2, 1, -3, 0}}},    {"Hz", {1, 0, {0, 0, -1, 0}}},
      {"l", {1e-3, 0, {3, 0, 0, 0}}}, {"mol", {1, 0, {0, 0, 0, 0, 1}}}};
  // These take no prefix, and are looked up first: "min" is not a milli-inch.
  static const std::map<std::string, Unit> plain{{"t", {1e3, 0, {0, 1, 0, 0}}},
                                                 {"min", {60, 0, {0, 0, 1, 0}}},
                                                 {"h", {3600, 0, {0, 0, 1, 0}}},
                                                 {"bar", {1e5, 0, {-1, 1, -2, 0}}},
                                                 {"rad", {1, 0, {0, 0, 0, 0, 0, 1}}},
                                                 {"deg", {pi / 180, 0, {0, 0, 0, 0, 0, 1}}},
                                                 {"%", {1e-2, 0, {}}},
                                                 {"1", {1, 0, {}}},
                                                 {"degC", {1, 273.15, {0, 0, 0, 1}}}};
  static const std::map<char, double> prefixes{{'n', 1e-9}, {'u', 1e-6}, {'m', 1e-3}, {'c', 1e-2},
                                               {'k', 1e3},  {'M', 1e6},  {'G', 1e9}};
  for (const auto* units : {&plain, &prefixable}) {
    if (const auto known = units->find(symbol); known != units->end()) {
      return known->second;
    }
  }
  const auto prefix = symbol.empty() ? prefixes.end() : prefixes.find(symbol[0]);
  const auto prefixed = prefix == prefixes.end() ? prefixable.end() : prefixable.find(symbol.substr(1));
  if (prefixed == prefixable.end()) {
    return std::nullopt;
  }
  Unit unit = prefixed->second;
  unit.factor *= prefix->second;
  return unit;
}

/// Recursive descent over: expression = factor {("*" | " " | "/") factor}, factor = (symbol | "(" expression ")") ["^"
/// integer].
class UnitParser {
 public:
  explicit UnitParser(const std::string& text) : text_(text) {}

  Unit parse() {
    const Unit unit = expression();
    if (position_ != text_.size()) {
      fail();
    }
    return unit;
  }

 private:
  Unit expression() {
    Unit product = factor();
    bool divided = false;
    while (true) {
      const bool space = skip_spaces();
      if (position_ == text_.size() || text_[position_] == ')') {
        return product;
      }
      const char sign = text_[position_];
      if (sign == '*' || sign == '/') {
        ++position_;
        skip_spaces();
      } else if (!space) {
        fail();
      }
      if (divided && sign != '/') {
        throw Error("unit \"" + text_ + "\" is ambiguous without parentheses after the /");
      }
      divided = divided || sign == '/';
      multiply(product, factor(), sign == '/' ? -1 : 1);
    }
  }

  Unit factor() {
    Unit unit;
    if (position_ < text_.size() && text_[position_] == '(') {
      ++position_;
      skip_spaces();
      unit = expression();
      if (position_ == text_.size()) {
        fail();
      }
      ++position_;
    } else {
      const std::size_t begin = position_;
      if (position_ < text_.size() && (text_[position_] == '1' || text_[position_] == '%')) {
        ++position_;
      } else {
        while (position_ < text_.size() && std::isalpha(static_cast<unsigned char>(text_[position_])) != 0) {
          ++position_;
        }
      }
      const std::string symbol = text_.substr(begin, position_ - begin);
      const std::optional<Unit> known = find_unit(symbol);
      if (!known) {
        fail(symbol);
      }
      if (known->offset != 0 && symbol != text_) {
        throw Error("unit \"" + text_ + "\": degC stands alone only");
      }
      unit = *known;
    }
    if (position_ < text_.size() && text_[position_] == '^') {
      int power = 0;
      const char* begin = text_.data() + position_ + 1;
      const auto [end, failure] = std::from_chars(begin, text_.data() + text_.size(), power);
      if (failure != std::errc() || std::abs(power) > 9) {
        fail();
      }
      position_ += static_cast<std::size_t>(end - begin) + 1;
      const Unit base = std::exchange(unit, Unit());
      multiply(unit, base, power);
    }
    return unit;
  }

  static void multiply(Unit& product, const Unit& unit, int power) {
    // A positive power first, then one division: keeps "1/mm" at exactly 1000.
    const double magnitude = std::pow(unit.factor, std::abs(power));
    product.factor = power < 0 ? product.factor / magnitude : product.factor * magnitude;
    product.offset = power == 1 ? product.offset + unit.offset : product.offset;
    for (std::size_t i = 0; i < product.dimension.size(); ++i) {
      product.dimension[i] += power * unit.dimension[i];
    }
  }

  bool skip_spaces() {
    const std::size_t begin = position_;
    position_ = std::min(text_.find_first_not_of(' ', begin), text_.size());
    return position_ > begin;
  }

  [[noreturn]] void fail(const std::string& part = "") const {
    throw Error(part.empty() ? "unit \"" + text_ + "\" is not understood" : "unknown unit \"" + part + "\"");
  }

  const std::string& text_;
  std::size_t position_ = 0;
};

}  // namespace

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

Unit parse_unit(const std::string& text) {
  const std::string unit = trimmed(text);
  const std::optional<Unit> known = find_unit(unit);
  return known ? *known : UnitParser(unit).parse();
}

Quantity parse_quantity(const std::string& text) {
  const std::string written = trimmed(text);
  // from_chars knows no plus sign; "+-1" is no number.
  const std::size_t sign = written.size() > 1 && written[0] == '+' && written[1] != '-' ? 1 : 0;
  Quantity quantity;
  const char* begin = written.data() + sign;
  const auto [end, failure] = std::from_chars(begin, written.data() + written.size(), quantity.value);
  if (failure != std::errc() || !std::isfinite(quantity.value)) {
    throw Error("\"" + text + "\" is not a finite number");
  }
  const std::string unit = trimmed(written.substr(static_cast<std::size_t>(end - written.data())));
  quantity.bare = unit.empty();
  if (!quantity.bare) {
    if (unit == "1") {
      throw Error("\"" + text + "\" is two numbers");
    }
    const Unit parsed = parse_unit(unit);
    // Divide by the reciprocal of small factors: 0.3 mm is 0.3/1000, correctly rounded to 0.0003.
    const double reciprocal = std::round(1 / parsed.factor);
    const bool divide = parsed.factor < 1 && std::abs(reciprocal * parsed.factor - 1) < 1e-12;
    quantity.value = (divide ? quantity.value / reciprocal : quantity.value * parsed.factor) + parsed.offset;
    quantity.dimension = parsed.dimension;
    if (!std::isfinite(quantity.value)) {
      throw Error("\"" + text + "\" is not a finite number in SI");
    }
  }
  return quantity;
}

std::string example_of(const std::string& unit) {
  static const std::vector<std::pair<Dimension, std::string>> examples{
      {{1, 0, 0, 0}, "a length such as 0.3 mm"},        {{0, 0, 1, 0}, "a time such as 2 ms"},
      {{0, 0, 0, 1}, "a temperature such as 450 degC"}, {{0, 1, 0, 0}, "a mass such as 5 g"},
      {{1, 0, -1, 0}, "a velocity such as 1.2 m/s"},    {{1, 0, -2, 0}, "an acceleration such as 9.81 m/s^2"},
      {{0, 0, -1, 0}, "a rate such as 20 1/s"},         {{-2, 1, 0, 0}, "a mass per area such as 80 g/m^2"},
      {{-3, 1, 0, 0}, "a density such as 800 kg/m^3"}};
  if (unit == "rad") {
    return "an angle such as 30 deg";
  }
  const Dimension dimension = parse_unit(unit).dimension;
  if (dimension == Dimension{}) {
    return "a pure number";
  }
  for (const auto& [known, example] : examples) {
    if (known == dimension) {
      return example;
    }
  }
  return "a quantity in " + unit;
}

std::string number_text(double value) {
  std::string text;
  // At least the digits before the point, or 100 would be 1e+02.
  const double magnitude = std::abs(value);
  const int before_point = magnitude >= 1 && magnitude < 1e9 ? static_cast<int>(std::log10(magnitude)) + 1 : 1;
  for (int digits = before_point; digits <= 17; ++digits) {
    text = fmt::format("{:.{}g}", value, digits);
    if (std::strtod(text.c_str(), nullptr) == value) {
      break;
    }
  }
  return text;
}

}  // namespace pellicle::base
