#include "heat/heat_options.h"

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"

namespace pellicle::heat {

Eigen::Vector3d HeatSource::centre_at(double time) const {
  return path.empty() ? Eigen::Vector3d(centre + time * velocity) : place_on_key_points(path, time);
}

void describe(OptionTable& table, HeatSource& source) {
  table.add("shape", source.shape, "a moving hot ball, or an image on the surface", "burning paper, section 5");
  table.add("temperature", source.temperature, Rules("K").more_than(0), "temperature of the source");
  table.add("rate", source.rate, Rules("1/s").at_least(0), "how fast the surface takes on the source's temperature",
            "docs/theory.md: parameters");
  table.add("start_time", source.start_time, Rules("s"), "when the source begins to heat");
  table.add("end_time", source.end_time, Rules("s"), "when the source stops heating; never unless given");
  const Condition ball = one_of("shape", source.shape, {SourceShape::ball});
  const Condition without_path{"no path", [&source] { return source.path.empty(); }};
  table.add("radius", source.radius, Rules("m").more_than(0).acts_with(ball), "radius of a ball",
            "docs/theory.md: parameters");
  table.add("centre", source.centre, Rules("m").acts_with(ball).acts_with(without_path), "centre of a ball at time 0");
  table.add("velocity", source.velocity, Rules("m/s").acts_with(ball).acts_with(without_path), "velocity of a ball");
  table.add("path", source.path, Rules("s,m,m,m").length(4).acts_with(ball),
            "key points of a ball (time, x, y, z), which replace centre and velocity; linear between key points, at "
            "rest before and after them");
  table.add("file", source.file, Rules().file().acts_with(one_of("shape", source.shape, {SourceShape::texture})),
            "image of a texture: white takes the whole rate, black none");
}

void validate(const std::string& name, const HeatSource& source) {
  const std::string key = "heat.sources." + name;
  if (source.shape == SourceShape::texture && source.file.empty()) {
    throw Error(key + ".file: a source of shape texture needs an image");
  }
  if (source.end_time && !(*source.end_time > source.start_time)) {
    throw Error(key + ".end_time: " + number_text(*source.end_time) + " s, expected later than start_time, " +
                number_text(source.start_time) + " s");
  }
  refuse_fault(key + ".path: ", fault_of_key_points(source.path));
}

void describe(OptionTable& table, HeatOptions& options) {
  table.add("heat.initial_temperature", options.initial_temperature, Rules("K").more_than(0),
            "temperature of every particle at the start");
  table.add("heat.operator", options.operator_name, Rules().solver_setting(),
            "conduction: finite elements on the drawn triangles, which converge to the Laplacian and conserve heat, or "
            "the paper's umbrella over the springs, half of the Laplacian on regular sheets, which makes heat where "
            "masses differ (heat_made in history.csv)",
            "burning paper, eq. 3");
  table.add("heat.diffusivity", options.diffusivity, Rules("m^2/s").at_least(0), "thermal diffusivity alpha",
            "burning paper, eq. 2; docs/theory.md: parameters");
  table.add("heat.diffusivity_texture", options.diffusivity_texture, Rules().file(),
            "image whose brightness at the uv coordinates weights the diffusivity of each particle",
            "burning paper, section 8");
  table.add("heat.diffusivity_range", options.diffusivity_range,
            Rules().length(2).at_least(0).acts_with(is_given("heat.diffusivity_texture", options.diffusivity_texture)),
            "factors on the diffusivity where the image is black and where it is white");
  table.add("heat.burning_heat", options.burning_heat, Rules("K").at_least(0),
            "eta: the rise of temperature per unit of lost mass fraction",
            "burning paper, eq. 1; docs/theory.md: readings");
  table.add("heat.capacity", options.capacity, Rules("J/(kg K)").more_than(0), "specific heat capacity", "dry paper");
  table.add(
      "heat.ambient_temperature", options.ambient_temperature,
      Rules("K").more_than(0).acts_with({"heat.convection or heat.emissivity: more than 0",
                                         [&options] { return options.convection > 0 || options.emissivity > 0; }}),
      "temperature of the surroundings, to which heat is lost");
  table.add("heat.convection", options.convection, Rules("W/(m^2 K)").at_least(0),
            "heat transfer coefficient of each side; 0: no convection; still air: about 10");
  table.add("heat.emissivity", options.emissivity, Rules().range(0, 1),
            "emissivity of each side; 0: no radiation; paper: about 0.9");
  table.add("heat.ksp_rtol", options.ksp_rtol, Rules().more_than(0).at_most(0.1).solver_setting(),
            "relative tolerance of the linear solve of conduction, also of the temperatures' range");
  table.add("heat.mat_type", options.mat_type, Rules().solver_setting(),
            "the matrix of conduction: aij: assembled; shell: matrix-free; auto: shell, or aij for a pc_type that "
            "needs entries, and for save_system, ksp_view_mat and mat_view");
  table.add_objects("heat.sources", options.sources, "external heat sources, by name");
  table.add_solver_prefix("heat_");
}

}  // namespace pellicle::heat
