#include "gas/gas_options.h"

namespace pellicle {
inline namespace gas {

void describe(OptionTable& table, GasOptions& options) {
  table.add("gas.tangent", options.tangent)
      .solver_setting()
      .help(
          "derivative of the pressure force: with the factor 1/27 as printed, with the right factor 1/9, or with the "
          "load's geometric stiffness too")
      .source("balloon paper, eq. 16; README: readings");
  table.add("gas.ambient_pressure", options.ambient_pressure)
      .unit("Pa")
      .at_least(0)
      .help("absolute pressure outside, which the laws isothermal and adiabatic work against")
      .source("standard atmosphere");
}

void describe(OptionTable& table, ChamberOptions& options) {
  const auto law = [&options](const std::vector<GasLaw>& laws) { return one_of("law", options.law, laws); };
  table.add("law", options.law)
      .help(
          "relative: p = p0 V0/V, alone, with nothing outside; isothermal: p V = n R T, absolute, against the ambient "
          "pressure; adiabatic: p V^gamma constant, absolute, against the ambient pressure; pressure: prescribed "
          "across the wall; volume: prescribed")
      .source("balloon paper, eq. 12 and 14");
  table.add("vertex", options.vertex)
      .at_least(-1)
      .help(
          "number of any vertex of the piece that bounds the chamber; -1: a chamber for every piece that no other "
          "names (NAME, NAME_2, ...)");
  table.add("pressure", options.pressure)
      .unit("s,Pa")
      .acts_with(law({GasLaw::relative, GasLaw::pressure}))
      .help(
          "key points (time, pressure), linear between, constant outside, as all below. Law relative: p0, absolute "
          "with nothing outside; law pressure: gauge, inside minus outside")
      .source("balloon paper, eq. 14");
  table.add("amount", options.amount)
      .unit("s,mol")
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help("amount n of gas inside")
      .source("balloon paper, eq. 12");
  table.add("amount_ratio", options.amount_ratio)
      .unit("s,1")
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help(
          "in place of amount: n over the amount that fills the undeformed volume at ambient pressure and the "
          "temperature at time 0; 1 unless given")
      .source("README: readings");
  table.add("temperature", options.temperature)
      .unit("s,K")
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help("law isothermal: T; law adiabatic: one key point, T at the undeformed volume; 293.15 K unless given")
      .source("balloon paper, eq. 12");
  table.add("gamma", options.gamma)
      .more_than(1)
      .acts_with(law({GasLaw::adiabatic}))
      .help("ratio of the heat capacities; 1.4, air, unless given")
      .source("README: readings");
  table.add("volume_ratio", options.volume_ratio)
      .unit("s,1")
      .acts_with(law({GasLaw::volume}))
      .help("enclosed volume over the undeformed one")
      .source("README: readings");
  table.add("volume", options.volume)
      .unit("s,m^3")
      .acts_with(law({GasLaw::volume}))
      .help("in place of volume_ratio")
      .source("README: readings");
}

}  // namespace gas
}  // namespace pellicle
