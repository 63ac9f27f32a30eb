#include "run/body_drawings.h"

namespace pellicle {
inline namespace run {

std::vector<BodyDrawing> drawings_of_bodies(MPI_Comm comm, const std::deque<NamedOptions>& objects) {
  std::vector<BodyDrawing> drawings;
  for (const Body& body : make_bodies(comm, objects.front().options.bodies)) {
    drawings.push_back({{body.name, "bodies." + body.name}, body.shape, body.motion});
  }
  for (const NamedOptions& object : objects) {
    for (const auto& [name, source] : object.options.heat.sources) {
      if (!shape_of(source).has_centre) {
        continue;
      }
      RigidMotion motion;
      motion.start.place = source.centre;
      motion.velocity = source.velocity;
      motion.path = source.path;
      const bool is_named = !object.name.empty();
      drawings.push_back({{"heat_" + (is_named ? object.name + "_" : "") + name,
                           (is_named ? "objects." + object.name + "." : "") + "heat.sources." + name},
                          Sphere{source.radius},
                          motion,
                          source.start_time,
                          source.end_time.value_or(std::numeric_limits<double>::infinity())});
    }
  }
  return drawings;
}

}  // namespace run
}  // namespace pellicle
