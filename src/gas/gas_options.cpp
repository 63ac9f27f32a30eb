#include "gas/gas_options.h"

namespace pellicle {
inline namespace gas {

void describe(OptionTable& table, GasOptions& options) {
  table.add("gas.tangent", options.tangent)
      .solver_setting()
      .help(
          "derivative of the pressure force: with the factor 1/27 as printed, with the right factor 1/9, or with the "
          "load's geometric stiffness too")
      .source("balloon paper, eq. 16; docs/theory.md: readings");
  table.add("gas.ambient_pressure", options.ambient_pressure)
      .unit("Pa")
      .at_least(0)
      .help("absolute pressure outside, which the laws isothermal and adiabatic work against")
      .source("standard atmosphere");
  table.add("gas.ambient_temperature", options.ambient_temperature)
      .unit("K")
      .more_than(0)
      .help("temperature outside: of what flows in from there, and of the air that gas lighter than it rises in");
  table.add("gas.molar_mass", options.molar_mass)
      .unit("kg/mol")
      .more_than(0)
      .help("molar mass M of the gas, inside and outside; air unless given");
  table.add("gas.buoyancy", options.buoyancy)
      .help(
          "the pressures inside and outside grow downwards with the weight of gas and air, so that warm gas lifts what "
          "it is in; otherwise they are even");
  table.add_objects("gas_network.links", options.links,
                    "holes, tubes, valves and pumps between chambers, or a chamber and the ambient air");
}

void describe(OptionTable& table, LinkOptions& options) {
  const Condition has_area{"area", [&options] { return options.area.has_value(); }};
  const Condition has_flow{"flow", [&options] { return !options.flow.empty(); }};
  table.add("from", options.from)
      .help("name of a chamber of the laws isothermal or adiabatic; the ambient air unless given");
  table.add("to", options.to).help("likewise");
  table.add("area", options.area)
      .unit("m^2")
      .at_least(0)
      .help("area A of the narrowest place, through which gas flows without friction, at most at the speed of sound")
      .source("Saint-Venant and Wantzel 1839");
  table.add("discharge", options.discharge)
      .range(0, 1)
      .acts_with(has_area)
      .help("discharge coefficient: by what the area counts; of a hole with a sharp edge about 0.6");
  table.add("opens", options.opens)
      .unit("s,1")
      .range(0, 1)
      .acts_with(has_area)
      .help(
          "key points (time, share of the area that is open, 0 to 1), linear between, constant outside; open unless "
          "given");
  table.add("one_way", options.one_way).acts_with(has_area).help("a valve, through which nothing flows back");
  table.add("flow", options.flow)
      .unit("s,mol/s")
      .at_least(0)
      .help("in place of area, of a pump: key points (time, flow), whatever the pressures are");
  table.add("temperature", options.temperature)
      .unit("K")
      .more_than(0)
      .acts_with(has_flow)
      .help("of what a pump brings from outside; gas.ambient_temperature unless given");
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
  table.add("inside", options.inside)
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help(
          "name of the chamber that it lies inside, whose gas is round its wall and whose volume ends there; the "
          "ambient air unless given");
  table.add("pressure", options.pressure)
      .unit("s,Pa")
      .acts_with(law({GasLaw::relative, GasLaw::pressure}))
      .help(
          "key points (time, pressure), linear between, constant outside, as all below. Law relative: p0, absolute "
          "with nothing outside; law pressure: gauge, inside minus outside")
      .source("balloon paper, eq. 14");
  table.add("amount", options.amount)
      .unit("s,mol")
      .at_least(0)
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help("amount n of gas inside")
      .source("balloon paper, eq. 12");
  table.add("amount_ratio", options.amount_ratio)
      .unit("s,1")
      .at_least(0)
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help(
          "in place of amount: n over the amount that fills the undeformed volume at ambient pressure and the "
          "temperature at time 0; 1 unless given")
      .source("docs/theory.md: readings");
  table.add("temperature", options.temperature)
      .unit("s,K")
      .more_than(0)
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help("law isothermal: T; law adiabatic: one key point, T at the undeformed volume; 293.15 K unless given")
      .source("balloon paper, eq. 12");
  table.add("gamma", options.gamma)
      .more_than(1)
      .at_most(1.67)  // of one atom a molecule, 5/3 as it is often rounded
      .acts_with(law({GasLaw::adiabatic}))
      .help("ratio of the heat capacities; 1.4, air, unless given")
      .source("docs/theory.md: readings");
  table.add("hole_discharge", options.hole_discharge)
      .range(0, 1)
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help(
          "discharge coefficient of holes in the wall, of sharp edges about 0.6: boundaries of an open mesh and what "
          "has "
          "burnt or torn are closed by caps for the volume, gas flows through their areas, and its jets push. Unless "
          "given the wall must be closed, and a run ends where it opens");
  table.add("permeability", options.permeability)
      .range(0, 1)
      .acts_with(law({GasLaw::isothermal, GasLaw::adiabatic}))
      .help(
          "share c of the wall's area through which gas seeps as through holes: at small differences of pressure "
          "u = c sqrt(2 dp/rho) on all of it, as through the fabric of an airbag");
  table.add("heat_transfer", options.heat_transfer)
      .unit("W/(m^2 K)")
      .at_least(0)
      .acts_with(law({GasLaw::adiabatic}))
      .help("coefficient of the heat that goes between the wall and the gas, of natural convection some 5 W/(m^2 K)")
      .source("Newton's law of cooling");
  table.add("wall_temperature", options.wall_temperature)
      .unit("K")
      .more_than(0)
      .acts_with({"heat_transfer: more than 0", [&options] { return options.heat_transfer > 0; }})
      .help("temperature of the wall");
  table.add("volume_ratio", options.volume_ratio)
      .unit("s,1")
      .more_than(0)
      .acts_with(law({GasLaw::volume}))
      .help("enclosed volume over the undeformed one")
      .source("docs/theory.md: readings");
  table.add("volume", options.volume)
      .unit("s,m^3")
      .more_than(0)
      .acts_with(law({GasLaw::volume}))
      .help("in place of volume_ratio")
      .source("docs/theory.md: readings");
}

}  // namespace gas
}  // namespace pellicle
