#include "air/air_options.h"

namespace pellicle::air {

void describe(OptionTable& table, AirOptions& options) {
  table.add("force.air_density", options.density, Rules("kg/m^3").at_least(0),
            "density of the air, whose drag acts on what moves relative to it; 0: no air; at 15 degC: 1.2");
  table.add_under(is_positive("force.air_density", options.density), [&] {
    table.add(
        "force.drag", options.drag, Rules().at_least(0),
        "drag coefficient C_n for flow across the surface: the pressure on a drawn triangle is C_n rho/2 times the "
        "square of the normal part of the velocity relative to the air; a square plate has 1.17, a long strip 2",
        "Hoerner, Fluid-Dynamic Drag (1965), 3-11 and 3-15");
    table.add("force.skin_drag", options.skin_drag, Rules().at_least(0),
              "drag coefficient C_t for flow along the surface, of both sides together, by the square of the "
              "tangential part; smooth cloth has about 0.01",
              "Hoerner, Fluid-Dynamic Drag (1965), 2-5 and 3-11");
    table.add("force.wind.velocity", options.wind.velocity, Rules("s,m/s,m/s,m/s"),
              "key points (time, x, y, z) of the air's mean velocity; linear between key points, constant before and "
              "after them; without any the air is still");
    table.add_under(is_given("force.wind.velocity", options.wind.velocity), [&] {
      table.add("force.wind.turbulence", options.wind.turbulence, Rules().range(0, 2),
                "intensity of the turbulence: rms of each component of the velocity's fluctuations, as a share of the "
                "mean speed; near the ground 0.1 to 0.3");
      const Condition turbulent = is_positive("force.wind.turbulence", options.wind.turbulence);
      table.add("force.wind.turbulence_length", options.wind.length, Rules("m").more_than(0).acts_with(turbulent),
                "longitudinal integral length of the turbulence: eddies are about two to four times as wide");
      table.add("force.wind.seed", options.wind.seed, Rules().at_least(0).acts_with(turbulent),
                "seed of the turbulence, which is the same on any number of ranks");
    });
  });
}

}  // namespace pellicle::air
