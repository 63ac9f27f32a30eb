#include "surface/sheet_options.h"

#include "options/options.h"

namespace pellicle::surface {

void describe(OptionTable& table, SheetOptions& options) {
  table.add("sheet.layers", options.layers, Rules().range(1, 2),
            "2: the body-centred-square shell; 1: a net of the blue springs alone, cloth without any resistance to "
            "bending and shear, whose lattice points are the centres of the cells and leave their mass to the corners",
            "burning paper, section 3.2");
  table.add("sheet.thickness", options.thickness,
            Rules("m").at_least(0).acts_with({"sheet.layers: 2", [&options] { return options.layers == 2; }}),
            "distance of the lattice points from the layer of the corner points; a quarter of a cell gives fine "
            "crumples, a half folds",
            "burning paper, section 3.2; docs/theory.md: parameters");
  table.add("sheet.areal_density", options.areal_density, Rules("kg/m^2").more_than(0),
            "mass per area: half of a cell's mass goes to its lattice point, an eighth to each corner",
            "docs/theory.md: readings; 80 g/m^2 is office paper");
  table.add("sheet.partitioner", options.partitioner, "what splits the cells over the ranks");
  table.add("sheet.perturbation", options.perturbation, Rules().range(0, 0.5),
            "amplitude of the noise added to the initial positions, as a share of the mean cell edge, so that a flat "
            "sheet can buckle; depends on the persistent ids only, never on ranks",
            "docs/theory.md: parameters");
  table.add("sheet.seed", options.seed,
            Rules().at_least(0).acts_with(is_positive("sheet.perturbation", options.perturbation)),
            "seed of the initial noise");
  table.add("sheet.imbalance_limit", options.imbalance_limit, Rules().at_least(1),
            "when burnt cells are removed, the rest is spread over the ranks anew if the largest number of cells of a "
            "rank is more than this times the mean; with the partitioner metis every 50 steps also if that of the "
            "pairs that may touch is, where there are more of them than cells");
}

}  // namespace pellicle::surface
