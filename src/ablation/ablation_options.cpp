#include "ablation/ablation_options.h"

#include "options/options.h"

namespace pellicle::ablation {

void describe(OptionTable& table, AblationOptions& options, const Condition& tears) {
  table.add("ablation.loss_mass", options.loss_mass, Rules().range(0, 1),
            "m^loss: below this fraction of its initial mass a particle has burnt away; 0, or no more than "
            "combustion.min_mass: the sheet wrinkles but stays whole",
            "burning paper, section 6");
  table.add("ablation.spring_rule", options.spring_rule,
            Rules().acts_with(is_positive("ablation.loss_mass", options.loss_mass)),
            "when springs die. surface: with the last triangle that shares them, or the last at one of their ends, so "
            "that no particle is left without a surface, by which it cools; triangles: with the last that shares them, "
            "as in the paper",
            "burning paper, section 6");
  table.add("ablation.compact_fraction", options.compact_fraction, Rules().range(0, 1),
            "cells of which nothing is left are removed, and the rest is numbered anew, when they are more than this "
            "share of those there since the last time; until then they are only left out. 1: never. The answer does "
            "not depend on it");
  table.add("ablation.strength", options.strength, Rules("N/m").more_than(0),
            "force per width at which the unburnt sheet, or a balloon's wall, cracks along sides of its cells; of a "
            "wall wall.strength may stand in its place. Nothing cracks unless given",
            "burning paper, section 8.2; docs/theory.md: readings");
  table.add("ablation.strength_texture", options.strength_texture, Rules().file().acts_with(tears),
            "image whose brightness at the uv coordinates weights the strength");
  table.add("ablation.strength_range", options.strength_range,
            Rules().length(2).at_least(0).acts_with(tears).acts_with(
                is_given("ablation.strength_texture", options.strength_texture)),
            "factors on the strength where the image is black and where it is white");
  table.add("ablation.char_strength", options.char_strength, Rules().range(0, 1).acts_with(tears),
            "share of the strength that is left at the least mass; in between the strength is linear in the mass");
  table.add("ablation.strength_length", options.strength_length, Rules("m").at_least(0).acts_with(tears),
            "length l over which the stress is averaged that is compared with the strength, so that the load which "
            "cracks a sheet at a clamp or a notch does not depend on the mesh where cells are smaller than 1.17 l. A "
            "crack much longer than l grows at a stress intensity of strength sqrt(pi l). 0: the stress of two cells, "
            "whatever their size",
            "docs/burning.md: cracks");
  const Condition scatters = is_positive("ablation.strength_scatter", options.strength_scatter);
  table.add("ablation.strength_scatter", options.strength_scatter, Rules().range(0, 1).acts_with(tears),
            "largest share by which the strength differs at random from place to place: every value up to it is "
            "equally frequent",
            "docs/burning.md: cracks");
  table.add("ablation.scatter_length", options.scatter_length,
            Rules("m").at_least(1e-6).acts_with(tears).acts_with(scatters),
            "length over which the scatter of the strength varies: places twice as far from each other differ "
            "independently. The field depends on the seed and the undeformed place alone, not on the mesh",
            "docs/burning.md: cracks");
  table.add("ablation.seed", options.seed, Rules().at_least(0).acts_with(tears).acts_with(scatters),
            "seed of the scatter of the strength");
  const Condition averages = is_positive("ablation.strength_length", options.strength_length);
  table.add_under(tears, [&] { table.add_under(averages, [&] { table.add_solver_prefix("ablation_"); }); });
}

}  // namespace pellicle::ablation
