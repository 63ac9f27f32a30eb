#include "world/options.h"

#include <algorithm>

#include "base/error.h"
#include "base/units.h"
#include "contact/body_heat.h"
#include "options/options.h"
#include "options/run_options.h"

namespace pellicle::world {

void describe(OptionTable& table, TimeOptions& options) {
  table.add("time.step", options.step, Rules("s").more_than(0), "time step h", "burning paper, Table 2");
  table.add("time.scheme", options.scheme,
            "implicit_euler: of first order, damps vibrations; generalized_alpha, not with dynamics projection: of "
            "second order, conserves energy except that of motions which the step does not resolve; statics: every "
            "step ends in equilibrium, without inertia and damping",
            "balloon paper, eq. 18; Chung and Hulbert 1993");
  table.add("time.spectral_radius", options.spectral_radius,
            Rules().range(0, 1).acts_with(one_of("time.scheme", options.scheme, {TimeScheme::generalized_alpha})),
            "factor by which a step multiplies motions much faster than the step; 1: nothing is damped, and angular "
            "momentum is conserved, too",
            "Chung and Hulbert 1993, eq. 25");
  table.add("time.arc_length", options.arc_length,
            Rules("m/s").more_than(0).acts_with(one_of("time.scheme", options.scheme, {TimeScheme::statics})),
            "follows the path of equilibria beyond limit points: the vertices move so far in a second, root mean "
            "square, and the loads have a time of their own, which may go back (history.csv: load_time); unless given "
            "the loads' time is that of the run",
            "Riks 1979");
  table.add("time.end", options.end, Rules("s").at_least(0), "the run ends at this time");
  table.add("time.max_steps", options.max_steps, Rules().at_least(0), "or after so many steps; 0: no such limit");
  table.add("time.max_retries", options.max_retries, Rules().range(0, 30),
            "a step that fails is tried again with half its length, down to time.step halved so many times");
  table.add("time.tolerance", options.tolerance, Rules().range(0, 1),
            "error of a step that is aimed at, as a share of the square root of the object's area; from it follow the "
            "lengths of the steps, the first of time.step; 0: all of time.step");
  table.add("time.max_step", options.max_step,
            Rules("s").more_than(0).acts_with(is_positive("time.tolerance", options.tolerance)),
            "longest step with a tolerance; time.step unless given");
}

void require_valid(const TimeOptions& options) {
  if (options.max_step && *options.max_step < options.step) {
    throw Error("time.max_step: " + number_text(*options.max_step) + " s, expected at least time.step, " +
                number_text(options.step) + " s");
  }
}

void describe(OptionTable& table, ForceOptions& options) {
  table.add("force.gravity", options.gravity, Rules("m/s^2"), "acceleration of every particle", "burning paper, eq. 8");
  table.add("force.damping", options.damping, Rules("1/s").at_least(0),
            "rate c at which velocities of a sheet fade, whatever moves with it: v exp(-c h), also of a free fall and "
            "of a sheet as a whole; what is at rest bears all of its weight. Unless given 0 with dynamics elastic, "
            "where sheet.damping damps what deforms, and 2/s otherwise; of a balloon: prism.mass_damping; by the air: "
            "force.air_density",
            "docs/theory.md: parameters");
  describe(table, options.air);
}

void describe(OptionTable& table, CheckpointOptions& options) {
  const Condition kept = is_positive("checkpoint.keep", options.keep);
  table.add("checkpoint.interval_steps", options.interval_steps, Rules().at_least(0).acts_with(kept),
            "steps between checkpoints, from which -restart goes on; 0: none by steps");
  table.add("checkpoint.interval_wall", options.interval_wall, Rules("s").at_least(0).acts_with(kept),
            "time on the wall between checkpoints, such as 30 min; 0: none by this clock; by default 3 min, or a "
            "twentieth of the time since the run began if that is longer, and the first after 30 s");
  table.add("checkpoint.keep", options.keep, Rules().at_least(0),
            "how many checkpoints are kept, the newest ones; one is also written at the end of the run, whatever ends "
            "it; 0: none");
}

bool follows_path(const TimeOptions& time) { return time.scheme == TimeScheme::statics && time.arc_length; }

TimeIntegrator integrator_of(const TimeOptions& time) {
  switch (time.scheme) {
    case TimeScheme::generalized_alpha:
      return TimeIntegrator::generalized_alpha(time.spectral_radius);
    case TimeScheme::statics:
      return TimeIntegrator::statics(time.arc_length);
    default:
      return {};
  }
}

ElasticOptions elastic_options(const Options& options) {
  ElasticOptions elastic = options.elastic;
  const bool is_undamped = options.time.scheme == TimeScheme::generalized_alpha;
  elastic.snes_rtol = elastic.newton_tolerance.value_or(is_undamped ? 1e-4 : elastic.snes_rtol);
  elastic.strain_limit = options.project.strain_limit;
  elastic.usual_h = options.time.step;
  return elastic;
}

SheetOptions shell_options(const Options& options) {
  SheetOptions sheet = options.sheet;
  sheet.is_one_surface = options.dynamics == Dynamics::elastic;
  return sheet;
}

double velocity_damping(const Options& options) {
  constexpr double of_projection = 2;  // [1/s]
  return options.force.damping.value_or(options.dynamics == Dynamics::elastic ? 0 : of_projection);
}

namespace {

bool inflates(const Options& options) { return options.chain == ChainKind::inflate; }

/// Whether a predicate holds for a chamber.
template <class OfChamber>
bool any_chamber(const Options& options, const OfChamber& holds) {
  return std::any_of(options.chambers.begin(), options.chambers.end(),
                     [&holds](const auto& chamber) { return holds(chamber.second); });
}

bool has_holes(const Options& options) {
  return any_chamber(options, [](const ChamberOptions& chamber) { return chamber.hole_discharge.has_value(); });
}

/// Whether a chamber has one of some laws.
bool has_law(const Options& options, const std::vector<GasLaw>& laws) {
  return any_chamber(options, [&laws](const ChamberOptions& chamber) {
    return std::find(laws.begin(), laws.end(), chamber.law) != laws.end();
  });
}

/// Whether anything heats or tears an object.
bool heats_or_tears(const Options& options) {
  const HeatOptions& heat = options.heat;
  return !heat.sources.empty() || heat.convection > 0 || heat.emissivity > 0 || options.ablation.strength ||
         options.wall.strength || exchange_heat(options.bodies) ||
         heat.initial_temperature > options.combustion.ignition_temperature;
}

using Predicate = bool (*)(const Options&);

/// Whether fire or cracks can remove elements.
bool removes_elements(const Options& options) {
  return options.ablation.loss_mass > 0 || options.ablation.strength.has_value();
}

/// A sheet: its options have no effect on a balloon.
void describe_sheet(OptionTable& table, Options& options) {
  table.add(
      "dynamics", options.dynamics,
      "what holds the sheet together: successive fast projection of the springs onto their target lengths; spring: "
      "Hooke's law, the mass-spring baseline; elastic: a material with tensile, shear and bending stiffness",
      "burning paper, section 7 and Fig. 7");
  const Condition elastic = one_of("dynamics", options.dynamics, {Dynamics::elastic});
  table.add_under(elastic, [&] { describe(table, options.material); });
  table.add_solver_settings([&] {
    const Condition projection = one_of("dynamics", options.dynamics, {Dynamics::projection});
    table.add_under(projection, [&] { describe(table, options.project); });
    table.add_under(one_of("dynamics", options.dynamics, {Dynamics::projection, Dynamics::elastic}),
                    [&] { describe_strain_limit(table, options.project); });
    table.add_under(one_of("dynamics", options.dynamics, {Dynamics::spring}), [&] { describe(table, options.spring); });
    table.add_under(elastic, [&] { describe(table, options.elastic); });
    const Condition balances{"dynamics: elastic, or contact.self: true",
                             [&options] { return options.dynamics == Dynamics::elastic || options.contact.self; }};
    table.add_under(balances, [&] { describe_balance(table, options.elastic); });
  });
}

/// A balloon, or a part of one: its options have no effect on a burning sheet.
void describe_balloon(OptionTable& table, Options& options) {
  table.add_solver_settings([&] { describe(table, options.prism); });
  describe(table, options.wall);
  table.add_solver_settings([&] {
    table.add_under(one_of("prism.thickness", options.wall.thickness_rule, {WallThickness::global_volume}),
                    [&] { describe(table, options.volume); });
  });
  table.add_objects("symmetry", options.symmetry, "planes that the vertices in them do not leave (balloons)");
  table.add_objects("attachments", options.attachments, "vertices tied to moving places by springs (balloons)");
  table.add_objects("forces", options.forces, "forces on parts of a balloon");
}

/// A deck that describes a wall, without naming a chain, means a balloon.
void choose_chain(OptionTable& table, Options& options) {
  const auto is_of_wall = [](const Option& option) {
    return option.key().compare(0, 5, "wall.") == 0 && option.origin() && !option.origin()->is_laid_over;
  };
  const auto& all = table.options();
  if (!table.find_key("chain")->origin() && std::any_of(all.begin(), all.end(), is_of_wall)) {
    options.chain = ChainKind::inflate;
  }
}

/// Describes the options that cannot be combined: a motion after the balance, or loads that may go back in time, would
/// contradict another option.
void describe_exclusions(OptionTable& table, const Options& options) {
  const auto exclude = [&](const char* option, const char* other, const char* expected, Predicate first,
                           Predicate second) {
    table.exclude({option, other, expected, [&options, first, second] { return first(options) && second(options); }});
  };
  const Predicate is_alpha = [](const Options& of) {
    return of.time.scheme == TimeScheme::generalized_alpha && (inflates(of) || of.dynamics != Dynamics::projection);
  };
  const Predicate is_path = [](const Options& of) { return follows_path(of.time); };
  const Predicate is_static_sheet = [](const Options& of) {
    return !inflates(of) && of.time.scheme == TimeScheme::statics;
  };
  const Predicate is_projected = [](const Options& of) { return !inflates(of) && of.dynamics == Dynamics::projection; };
  const Predicate touches = [](const Options& of) { return of.contact.self; };
  const Predicate keeps_wall_volume = [](const Options& of) {
    return inflates(of) && of.wall.thickness_rule == WallThickness::global_volume;
  };
  const Predicate prescribes_volume = [](const Options& of) { return has_law(of, {GasLaw::volume}); };
  const char* const alpha = "time.scheme: generalized_alpha";
  const char* const path = "time.arc_length";
  const char* const statics = "time.scheme: statics of a sheet";
  const char* const global = "prism.thickness: global, whose volume is preserved behind the step";
  const char* const projection = "dynamics: projection, whose springs have no forces";
  const char* const volume = "chambers.NAME.law: volume";
  exclude(alpha, "prism.inertia: false, without which there are no accelerations", "implicit_euler", is_alpha,
          [](const Options& of) { return inflates(of) && !of.prism.inertia; });
  exclude(alpha, "a balloon that heats, burns or tears", "implicit_euler", is_alpha, balloon_burns);
  exclude(alpha, global, "implicit_euler", is_alpha, keeps_wall_volume);
  exclude(alpha, volume, "implicit_euler", is_alpha, prescribes_volume);
  exclude(path, "an object that heats, burns or tears", "none", is_path, heats_or_tears);
  exclude(path, global, "none", is_path, keeps_wall_volume);
  exclude(path, volume, "none", is_path, prescribes_volume);
  exclude(path, "force.air_density", "none", is_path, [](const Options& of) { return of.force.air.density > 0; });
  exclude(path,
          "gas that flows (gas_network.links, and holes, permeability, heat_transfer and inside of chambers): the "
          "loads' time may go back",
          "none", is_path, gas_is_joined);
  exclude(
      alpha, projection, "implicit_euler",
      [](const Options& of) { return of.time.scheme == TimeScheme::generalized_alpha; }, is_projected);
  exclude(path, projection, "none", is_path, is_projected);
  exclude(statics, "gas that flows or has weight", "implicit_euler", is_static_sheet,
          [](const Options& of) { return gas_is_joined(of) || gas_pushes_unevenly(of); });
  exclude(statics, "time.tolerance, which is an error of velocities", "implicit_euler", is_static_sheet,
          [](const Options& of) { return of.time.tolerance > 0; });
  exclude("contact.self", alpha, "implicit_euler or statics", touches, is_alpha);
  exclude("contact.self", global, "another thickness", touches, keeps_wall_volume);
  exclude("gas_network.links to chambers of other objects", global, "another thickness", has_links_elsewhere,
          keeps_wall_volume);
  exclude("prism.thickness: global, the volume of the whole wall",
          "a balloon that heats, burns or tears, of which fire takes away", "incompressible, plane_stress or fixed",
          keeps_wall_volume, balloon_burns);
  exclude(
      "sheet.layers: 1", "dynamics: elastic or spring", "dynamics: projection",
      [](const Options& of) { return !inflates(of) && of.sheet.layers == 1; },
      [](const Options& of) { return of.dynamics != Dynamics::projection; });
  exclude(
      "time.tolerance", "dynamics: projection or spring, the error of whose steps is not known", "0",
      [](const Options& of) { return !inflates(of) && of.time.tolerance > 0; },
      [](const Options& of) { return of.dynamics != Dynamics::elastic; });
  exclude(
      "ablation.strength", "dynamics: spring, whose springs all pull alike", "elastic or projection",
      [](const Options& of) { return of.ablation.strength.has_value(); },
      [](const Options& of) { return !inflates(of) && of.dynamics == Dynamics::spring; });
}

void name_solvers(Options& options, const std::string& prefix) {
  for (std::string* solver :
       {&options.heat.solver_prefix, &options.project.solver_prefix, &options.spring.solver_prefix,
        &options.elastic.solver_prefix, &options.prism.solver_prefix, &options.ablation.solver_prefix}) {
    *solver = prefix + *solver;
  }
}

}  // namespace

bool balloon_burns(const Options& options) { return inflates(options) && heats_or_tears(options); }

bool balances_bodies(const Options& options) {
  return inflates(options) || options.dynamics != Dynamics::projection || options.contact.self;
}

AblationOptions cracks_of(const Options& options) {
  AblationOptions cracks = options.ablation;
  if (inflates(options) && options.wall.strength) {
    if (cracks.strength) {
      throw Error("wall.strength: given, and ablation.strength too, expected one of them");
    }
    cracks.strength = options.wall.strength;
  }
  return cracks;
}

bool has_links_elsewhere(const Options& options) {
  return std::any_of(options.gas.links.begin(), options.gas.links.end(), [](const auto& link) {
    return (link.second.from + link.second.to).find('.') != std::string::npos;
  });
}

bool gas_is_joined(const Options& options) {
  return !options.gas.links.empty() || has_holes(options) || any_chamber(options, [](const ChamberOptions& chamber) {
    return chamber.heat_transfer > 0 || chamber.permeability > 0 || !chamber.inside.empty();
  });
}

bool gas_pushes_unevenly(const Options& options) { return options.gas.buoyancy || has_holes(options); }

Eigen::Vector3d gravity_of_gas(const Options& options) {
  return options.gas.buoyancy ? options.force.gravity : Eigen::Vector3d::Zero();
}

void describe(OptionTable& table, Options& options) {
  const Condition burns = one_of("chain", options.chain, {ChainKind::burn});
  const Condition balloons = one_of("chain", options.chain, {ChainKind::inflate});
  const auto when = [&options](const char* words, Predicate holds) {
    return Condition{words, [&options, holds] { return holds(options); }};
  };
  const Condition heats = when(
      "chain: burn, or for a balloon heat.sources, heat.convection, heat.emissivity, ablation.strength, wall.strength, "
      "bodies.NAME.temperature, or heat.initial_temperature above combustion.ignition_temperature",
      [](const Options& of) { return !inflates(of) || balloon_burns(of); });
  table.add("chain", options.chain,
            "burn: a sheet of quads that heats, burns and shrinks; inflate: a balloon of triangles, also unless given "
            "where the first deck has a wall");
  table.follow_decks([&] { choose_chain(table, options); });
  describe(table, options.mesh);
  describe(table, options.sheet);
  table.add_of_run([&] {
    table.add("mesh.only", options.mesh_only,
              "read or generate the mesh, check it, write it with its quality and partition, and end");
    describe(table, options.time);
  });
  table.add_under(burns, [&] { describe_sheet(table, options); });
  table.add_under(heats, [&] {
    describe(table, options.heat);
    describe(table, options.combustion);
    describe(table, options.ablation, when("ablation.strength or wall.strength", [](const Options& of) {
               return of.ablation.strength || of.wall.strength;
             }));
  });
  table.add_of_run([&] { describe(table, options.force); });
  describe(table, options.gas);
  table.add_objects("chambers", options.chambers, "volumes of gas that closed sheets and balloons enclose");
  table.add_under(balloons, [&] { describe_balloon(table, options); });
  const auto has_bodies = [&options](bool rub) {
    return (inflates(options) || options.dynamics == Dynamics::elastic) &&
           std::any_of(options.bodies.begin(), options.bodies.end(),
                       [rub](const auto& body) { return !rub || body.second.friction > 0; });
  };
  describe(table, options.contact, {"", [has_bodies] { return has_bodies(false); }},
           {"", [has_bodies] { return has_bodies(true); }});
  table.add_objects("pins", options.pins, "particles that are held, or led along a path");
  table.add_of_run([&] {
    table.add_objects("bodies", options.bodies, "solids that sheets and balloons cannot enter");
    describe(table, options.output);
    describe(table, options.checkpoint);
    table.add(
        "replay", options.replay,
        Rules().file().not_read_again().needs_value(
            "a file that -heat_save_system or another option of this kind has written"),
        "in place of a run, solves the linear system of this file, which -heat_save_system FILE (or -project_red_, "
        "-elastic_, -prism_, ...) has written, by the solver of -replay_ksp_type, -replay_pc_type and so on");
    table.add_solver_prefix("replay_");
    table.add("restart", options.restart,
              Rules().file().not_read_again().needs_value("the folder of a run, or a checkpoint of it"),
              "goes on from the newest sound checkpoint of this folder of a run, or from this file");
    table.add("verify_restart", options.verify_restart,
              Rules().at_least(0).acts_with(is_positive("checkpoint.keep", options.checkpoint.keep)),
              "runs so many steps, writes a checkpoint, runs as many more both straight and from the checkpoint, and "
              "compares the fields; 0: an ordinary run");
  });
  const auto a_chamber_of = [&options](const std::string& words, const std::vector<GasLaw>& laws) {
    return Condition{"a chamber of the law " + words, [&options, laws] { return has_law(options, laws); }};
  };
  // A balloon has one layer of particles. An object with gas in it is not renumbered: what has died stays where it is.
  const std::pair<Condition, std::vector<const char*>> restrictions[]{
      {heats, {"wall.reference_temperature"}},
      {one_of("dynamics", options.dynamics, {Dynamics::projection, Dynamics::elastic}),
       {"ablation.strength", "ablation.strength_texture", "ablation.strength_range", "ablation.char_strength",
        "ablation.strength_length", "ablation.strength_scatter", "ablation.scatter_length"}},
      {a_chamber_of("isothermal, adiabatic or pressure", {GasLaw::isothermal, GasLaw::adiabatic, GasLaw::pressure}),
       {"gas.ambient_pressure"}},
      {a_chamber_of("isothermal or adiabatic", {GasLaw::isothermal, GasLaw::adiabatic}),
       {"gas.buoyancy", "gas.molar_mass", "gas.ambient_temperature"}},
      {balloons, {"gas.tangent"}},
      {is_given("chambers", options.chambers), {"gas.tangent"}},
      {one_of("dynamics", options.dynamics, {Dynamics::projection}), {"sheet.layers"}},
      {burns,
       {"sheet.layers", "sheet.thickness", "sheet.areal_density", "force.damping", "output.springs",
        "combustion.corner_factor", "combustion.lattice_factor", "ablation.compact_fraction", "sheet.imbalance_limit"}},
      {when("chain: inflate or dynamics: elastic",
            [](const Options& of) { return inflates(of) || of.dynamics == Dynamics::elastic; }),
       {"combustion.char_stiffness", "time.tolerance"}},
      {when("chain: inflate, or dynamics: elastic or spring",
            [](const Options& of) { return inflates(of) || of.dynamics != Dynamics::projection; }),
       {"time.scheme"}},
      {one_of("prism.tangent", options.prism.tangent, {ElementTangent::exact}), {"wall.wrinkling"}},
      {when("no time.arc_length", [](const Options& of) { return !follows_path(of.time); }),
       {"prism.positive_elements"}},
      {one_of("time.scheme", options.time.scheme, {TimeScheme::implicit_euler, TimeScheme::generalized_alpha}),
       {"prism.inertia", "prism.mass_damping", "prism.stiffness_damping"}},
      {when("contact.self, ablation.loss_mass or ablation.strength",
            [](const Options& of) { return of.contact.self || removes_elements(of); }),
       {"sheet.imbalance_limit"}},
      {when("no chambers", [](const Options& of) { return of.chambers.empty(); }), {"ablation.compact_fraction"}},
      {when("ablation.loss_mass or ablation.strength", removes_elements), {"ablation.compact_fraction"}}};
  for (const auto& [condition, keys] : restrictions) {
    for (const char* key : keys) {
      table.find_key(key)->acts_with(condition);
    }
  }
}

void require_possible(const Options& options) {
  OptionTable table;
  describe_exclusions(table, options);
  table.check_exclusions();
}

ObjectOptions::ObjectOptions(std::string object) : NamedOptions(std::move(object)) {
  describe(table, options);
  describe_exclusions(table, options);
  name_solvers(options, object_prefix(name));
}

}  // namespace pellicle::world
