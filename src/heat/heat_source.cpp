#include "heat/heat_source.h"

#include <algorithm>
#include <cmath>

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

double apply_heat_source(Field& temperature, const HeatSource& source, const HeatSourceInput& input) {
  if (input.time < source.start_time || (source.end_time && input.time >= *source.end_time)) {
    return 0;
  }
  const Layout& particles = input.surface.particles;
  const Eigen::Vector3d centre = source.centre_at(input.time);
  const auto fraction = [&](PetscInt i) {
    if (source.shape == SourceShape::texture) {
      return -std::expm1(-source.rate * input.texture[i] * input.time_step);
    }
    const Eigen::Vector3d offset = input.positions.vector(i) - centre;
    const double squared = offset.squaredNorm() / (source.radius * source.radius);
    return squared < 1 ? -std::expm1(-source.rate * input.time_step) * (1 - squared) * (1 - squared) : 0;
  };
  double heat = 0;
  for (PetscInt i = 0; i < particles.local(); ++i) {
    if (input.mass.data()[i] == 0) {
      continue;
    }
    double& value = temperature.data()[i];
    const double before = value;
    value += fraction(i) * std::max(source.temperature - value, 0.0);
    if (i < particles.owned) {
      heat += input.mass.data()[i] * input.capacity * (value - before);
    }
  }
  return heat;
}

}  // namespace pellicle::heat
