#include "gas/gas_options.h"

namespace pellicle::gas {

void describe(OptionTable& table, GasOptions& options) {
  table.add("gas.tangent", options.tangent, Rules().solver_setting(),
            "derivative of the pressure force: with the factor 1/27 as printed, with the right factor 1/9, or with the "
            "load's geometric stiffness too",
            "balloon paper, eq. 16; docs/theory.md: readings");
  table.add("gas.ambient_pressure", options.ambient_pressure, Rules("Pa").at_least(0),
            "absolute pressure outside, which the laws isothermal and adiabatic work against", "standard atmosphere");
  table.add("gas.ambient_temperature", options.ambient_temperature, Rules("K").more_than(0),
            "temperature outside: of what flows in from there, and of the air that gas lighter than it rises in");
  table.add("gas.molar_mass", options.molar_mass, Rules("kg/mol").more_than(0),
            "molar mass M of the gas, inside and outside; air unless given");
  table.add("gas.buoyancy", options.buoyancy,
            "the pressures inside and outside grow downwards with the weight of gas and air, so that warm gas lifts "
            "what it is in; otherwise they are even");
  table.add_objects("gas_network.links", options.links,
                    "holes, tubes, valves and pumps between chambers, or a chamber and the ambient air");
}

void describe(OptionTable& table, LinkOptions& options) {
  const Condition has_area = is_given("area", options.area);
  const Condition has_flow = is_given("flow", options.flow);
  table.add("from", options.from,
            "name of a chamber of the laws isothermal or adiabatic; the ambient air unless given");
  table.add("to", options.to, "likewise");
  table.add("area", options.area, Rules("m^2").at_least(0),
            "area A of the narrowest place, through which gas flows without friction, at most at the speed of sound",
            "Saint-Venant and Wantzel 1839");
  table.add("discharge", options.discharge, Rules().range(0, 1).acts_with(has_area),
            "discharge coefficient: by what the area counts; of a hole with a sharp edge about 0.6");
  table.add(
      "opens", options.opens, Rules("s,1").range(0, 1).acts_with(has_area),
      "key points (time, share of the area that is open, 0 to 1), linear between, constant outside; open unless given");
  table.add("one_way", options.one_way, Rules().acts_with(has_area), "a valve, through which nothing flows back");
  table.add("flow", options.flow, Rules("s,mol/s").at_least(0),
            "in place of area, of a pump: key points (time, flow), whatever the pressures are");
  table.add("temperature", options.temperature, Rules("K").more_than(0).acts_with(has_flow),
            "of what a pump brings from outside; gas.ambient_temperature unless given");
}

void describe(OptionTable& table, ChamberOptions& options) {
  const Condition has_amount = one_of("law", options.law, {GasLaw::isothermal, GasLaw::adiabatic});
  const Condition adiabatic = one_of("law", options.law, {GasLaw::adiabatic});
  const Condition of_volume = one_of("law", options.law, {GasLaw::volume});
  table.add("law", options.law,
            "relative: p = p0 V0/V, alone, with nothing outside; isothermal: p V = n R T, absolute, against the "
            "ambient pressure; adiabatic: p V^gamma constant, absolute, against the ambient pressure; pressure: "
            "prescribed across the wall; volume: prescribed",
            "balloon paper, eq. 12 and 14");
  table.add("vertex", options.vertex, Rules().at_least(-1),
            "number of any vertex of the piece that bounds the chamber; -1: a chamber for every piece that no other "
            "names (NAME, NAME_2, ...)");
  table.add("inside", options.inside, Rules().acts_with(has_amount),
            "name of the chamber that it lies inside, whose gas is round its wall and whose volume ends there; the "
            "ambient air unless given");
  table.add("pressure", options.pressure,
            Rules("s,Pa").acts_with(one_of("law", options.law, {GasLaw::relative, GasLaw::pressure})),
            "key points (time, pressure), linear between, constant outside, as all below. Law relative: p0, absolute "
            "with nothing outside; law pressure: gauge, inside minus outside",
            "balloon paper, eq. 14");
  table.add("amount", options.amount, Rules("s,mol").at_least(0).acts_with(has_amount), "amount n of gas inside",
            "balloon paper, eq. 12");
  table.add("amount_ratio", options.amount_ratio, Rules("s,1").at_least(0).acts_with(has_amount),
            "in place of amount: n over the amount that fills the undeformed volume at ambient pressure and the "
            "temperature at time 0; 1 unless given",
            "docs/theory.md: readings");
  table.add("temperature", options.temperature, Rules("s,K").more_than(0).acts_with(has_amount),
            "law isothermal: T; law adiabatic: one key point, T at the undeformed volume; 293.15 K unless given",
            "balloon paper, eq. 12");
  constexpr double of_one_atom = 1.67;  // a molecule: 5/3 as it is often rounded
  table.add("gamma", options.gamma, Rules().more_than(1).at_most(of_one_atom).acts_with(adiabatic),
            "ratio of the heat capacities; 1.4, air, unless given", "docs/theory.md: readings");
  table.add("hole_discharge", options.hole_discharge, Rules().range(0, 1).acts_with(has_amount),
            "discharge coefficient of holes in the wall, of sharp edges about 0.6: boundaries of an open mesh and what "
            "has burnt or torn are closed by caps for the volume, gas flows through their areas, and its jets push. "
            "Unless given the wall must be closed, and a run ends where it opens");
  table.add("permeability", options.permeability, Rules().range(0, 1).acts_with(has_amount),
            "share c of the wall's area through which gas seeps as through holes: at small differences of pressure u = "
            "c sqrt(2 dp/rho) on all of it, as through the fabric of an airbag");
  table.add("heat_transfer", options.heat_transfer, Rules("W/(m^2 K)").at_least(0).acts_with(adiabatic),
            "coefficient of the heat that goes between the wall and the gas, of natural convection some 5 W/(m^2 K)",
            "Newton's law of cooling");
  table.add("wall_temperature", options.wall_temperature,
            Rules("K").more_than(0).acts_with(is_positive("heat_transfer", options.heat_transfer)),
            "temperature of the wall");
  table.add("volume_ratio", options.volume_ratio, Rules("s,1").more_than(0).acts_with(of_volume),
            "enclosed volume over the undeformed one", "docs/theory.md: readings");
  table.add("volume", options.volume, Rules("s,m^3").more_than(0).acts_with(of_volume), "in place of volume_ratio",
            "docs/theory.md: readings");
}

}  // namespace pellicle::gas
