#include "simulation/options.h"

#include "base/options.h"

namespace pellicle {

void describe(OptionTable& table, TimeOptions& options) {
  table.add("time.step", options.step).unit("s").more_than(0).help("time step h").source("burning paper, Table 2");
  table.add("time.end", options.end).unit("s").at_least(0).help("the run ends at this time");
  table.add("time.max_steps", options.max_steps).at_least(0).help("or after so many steps; 0: no such limit");
  table.add("time.max_retries", options.max_retries)
      .range(0, 30)
      .help("a step that fails is tried again with half its length, down to time.step halved so many times");
  table.add("time.tolerance", options.tolerance)
      .at_least(0)
      .help(
          "error allowed in a step, as a share of the sheet's size; from it follow the lengths of the steps, the first "
          "of time.step; 0: all of time.step");
  table.add("time.max_step", options.max_step)
      .unit("s")
      .more_than(0)
      .help("longest step, where time.tolerance is not 0; time.step unless given");
}

void describe(OptionTable& table, ForceOptions& options) {
  table.add("force.gravity", options.gravity)
      .unit("m/s^2")
      .help("acceleration of every particle")
      .source("burning paper, eq. 8");
  table.add("force.damping", options.damping)
      .unit("1/s")
      .at_least(0)
      .help("rate c at which velocities of a sheet fade: v exp(-c h); of a balloon: prism.mass_damping")
      .source("README: parameters");
}

void describe(OptionTable& table, Options& options) {
  table.add("chain", options.chain)
      .choices({"burn", "inflate"})
      .help("burn: a sheet of quads that heats, burns and shrinks; inflate: a balloon of triangles");
  describe(table, options.mesh);
  table.add("mesh.only", options.mesh_only)
      .help("read or generate the mesh, check it, write it with its quality and partition, and end");
  describe(table, options.sheet);
  describe(table, options.time);
  table.add("dynamics", options.dynamics)
      .choices({"projection", "spring"})
      .help(
          "what keeps the springs at their target lengths: successive fast projection, or Hooke's law (the mass-spring "
          "baseline)")
      .source("burning paper, section 7 and Fig. 7");
  describe(table, options.heat);
  describe(table, options.combustion);
  describe(table, options.ablation);
  describe(table, options.force);
  describe(table, options.project);
  describe(table, options.spring);
  describe(table, options.prism);
  describe(table, options.wall);
  describe(table, options.volume);
  describe(table, options.gas);
  table.add_objects("chambers", options.chambers, "volumes of gas that the balloon encloses");
  table.add_objects("pins", options.pins, "particles that are held, or led along a path");
  table.add_objects("symmetry", options.symmetry, "planes that the vertices in them do not leave (balloons)");
  table.add_objects("attachments", options.attachments, "vertices tied to moving places by springs (balloons)");
  table.add_objects("forces", options.forces, "forces on parts of a balloon");
  table.add_objects("bodies", options.bodies, "solids that the sheet cannot enter");
  describe(table, options.contact);
  describe(table, options.output);
}

std::vector<std::string> idle_solver_prefixes(const Options& options) {
  return options.chain == "burn" ? std::vector<std::string>{"prism_"}
                                 : std::vector<std::string>{"project_", "heat_", "spring_"};
}

}  // namespace pellicle
