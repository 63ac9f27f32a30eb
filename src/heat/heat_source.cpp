#include "heat/heat_source.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"

namespace pellicle::heat {

namespace {

double fraction_of_ball(const HeatSource& source, const Eigen::Vector3d& offset, double /*texture*/, double h) {
  const double squared = offset.squaredNorm() / (source.radius * source.radius);
  return squared < 1 ? -std::expm1(-source.rate * h) * (1 - squared) * (1 - squared) : 0;
}

double fraction_of_texture(const HeatSource& source, const Eigen::Vector3d& /*offset*/, double texture, double h) {
  return -std::expm1(-source.rate * texture * h);
}

/// The condition that a source has one of the shapes with a property.
Condition of_shapes(const HeatSource& source, bool HeatSourceShape::*property) {
  std::vector<SourceShape> shapes;
  for (std::size_t number = 0; number < heat_source_shapes().size(); ++number) {
    if (heat_source_shapes()[number].*property) {
      shapes.push_back(static_cast<SourceShape>(number));
    }
  }
  return one_of("shape", source.shape, shapes);
}

}  // namespace

const std::vector<HeatSourceShape>& heat_source_shapes() {
  static const std::vector<HeatSourceShape> shapes{{"ball", true, false, fraction_of_ball},
                                                   {"texture", false, true, fraction_of_texture}};
  return shapes;
}

std::vector<std::string> names_of(SourceShape) { return names_in(heat_source_shapes()); }

const HeatSourceShape& shape_of(const HeatSource& source) {
  return heat_source_shapes()[static_cast<std::size_t>(static_cast<SourceShape>(source.shape))];
}

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
  const Condition ball = of_shapes(source, &HeatSourceShape::has_centre);
  const Condition without_path{"no path", [&source] { return source.path.empty(); }};
  table.add("radius", source.radius, Rules("m").more_than(0).acts_with(ball), "radius of a ball",
            "docs/theory.md: parameters");
  table.add("centre", source.centre, Rules("m").acts_with(ball).acts_with(without_path), "centre of a ball at time 0");
  table.add("velocity", source.velocity, Rules("m/s").acts_with(ball).acts_with(without_path), "velocity of a ball");
  table.add("path", source.path, Rules("s,m,m,m").length(4).acts_with(ball),
            "key points of a ball (time, x, y, z), which replace centre and velocity; linear between key points, at "
            "rest before and after them");
  table.add("file", source.file, Rules().file().acts_with(of_shapes(source, &HeatSourceShape::has_image)),
            "image of a texture: white takes the whole rate, black none");
}

void validate(const std::string& name, const HeatSource& source) {
  const std::string key = "heat.sources." + name;
  if (shape_of(source).has_image && source.file.empty()) {
    throw Error(key + ".file: a source of shape " + shape_of(source).name + " needs an image");
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
  const HeatSourceShape& shape = shape_of(source);
  const Eigen::Vector3d centre = source.centre_at(input.time);
  double heat = 0;
  for (PetscInt i = 0; i < particles.local(); ++i) {
    if (input.mass.data()[i] == 0) {
      continue;
    }
    const double texture = shape.has_image ? input.texture[i] : 0;
    const double fraction = shape.fraction(source, input.positions.vector(i) - centre, texture, input.time_step);
    double& value = temperature.data()[i];
    const double before = value;
    value += fraction * std::max(source.temperature - value, 0.0);
    if (i < particles.owned) {
      heat += input.mass.data()[i] * input.capacity * (value - before);
    }
  }
  return heat;
}

}  // namespace pellicle::heat
