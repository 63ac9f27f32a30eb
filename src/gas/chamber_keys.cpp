#include "gas/chamber_keys.h"

#include <algorithm>
#include <vector>

#include "base/error.h"

namespace pellicle {
inline namespace gas {

namespace {

/// Key points of a chamber: their key, the lower bound of their values, the laws that use them.
struct Quantity {
  const char* key;
  Rows ChamberOptions::*rows;
  double lowest;
  bool may_be_lowest;
  std::vector<GasLaw> laws;
};

const std::vector<Quantity>& quantities() {
  static const std::vector<Quantity> all{
      {"pressure", &ChamberOptions::pressure, 0, true, {GasLaw::relative, GasLaw::pressure}},
      {"amount", &ChamberOptions::amount, 0, true, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"amount_ratio", &ChamberOptions::amount_ratio, 0, true, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"temperature", &ChamberOptions::temperature, 0, false, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"volume_ratio", &ChamberOptions::volume_ratio, 0, false, {GasLaw::volume}},
      {"volume", &ChamberOptions::volume, 0, false, {GasLaw::volume}}};
  return all;
}

[[noreturn]] void refuse_for_law(const std::string& key, const std::string& law) {
  throw Error(key + ": given, but the law " + law + " does not use it, expected another law or no such key");
}

}  // namespace

void require_valid_chamber(const std::string& chamber, const ChamberOptions& options, double ambient_pressure) {
  for (const Quantity& quantity : quantities()) {
    const Rows& rows = options.*quantity.rows;
    const std::string key = chamber + "." + quantity.key;
    if (rows.empty()) {
      continue;
    }
    if (std::find(quantity.laws.begin(), quantity.laws.end(), GasLaw(options.law)) == quantity.laws.end()) {
      refuse_for_law(key, options.law.name());
    }
    if (const std::string fault = fault_of_key_points(rows, {"time", "value"}); !fault.empty()) {
      throw Error(key + ": " + fault);
    }
    const bool is_gauge = &rows == &options.pressure && options.law == GasLaw::pressure;
    const double lowest = is_gauge ? -ambient_pressure : quantity.lowest;
    for (const auto& row : rows) {
      if (!(quantity.may_be_lowest ? row[1] >= lowest : row[1] > lowest)) {
        throw Error(key + ": " + number_text(row[1]) + " at " + number_text(row[0]) + " s, expected " +
                    (quantity.may_be_lowest ? "at least " : "more than ") + number_text(lowest) +
                    (is_gauge ? ", a vacuum inside where gas.ambient_pressure is outside" : ""));
      }
    }
  }
  if (options.gamma && options.law != GasLaw::adiabatic) {
    refuse_for_law(chamber + ".gamma", options.law.name());
  }
  if (options.law == GasLaw::adiabatic && options.temperature.size() > 1) {
    throw Error(chamber + ".temperature: " + std::to_string(options.temperature.size()) +
                " key points, expected one with the law adiabatic: the temperature at the undeformed volume");
  }
  const auto refuse_pair = [&](const std::string& pair) {
    throw Error(chamber + ": " + pair + " given, expected one of them");
  };
  if (!options.amount.empty() && !options.amount_ratio.empty()) {
    refuse_pair("both amount and amount_ratio");
  }
  if (!options.volume.empty() && !options.volume_ratio.empty()) {
    refuse_pair("both volume and volume_ratio");
  }
  if (options.law == GasLaw::volume && options.volume.empty() && options.volume_ratio.empty()) {
    refuse_pair("neither volume nor volume_ratio");
  }
  if ((options.law == GasLaw::relative || options.law == GasLaw::pressure) && options.pressure.empty()) {
    throw Error(chamber + ".pressure: not given, expected key points (time, pressure) with the law " +
                options.law.name());
  }
}

}  // namespace gas
}  // namespace pellicle
