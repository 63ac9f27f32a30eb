#include "projection/project_options.h"

#include <algorithm>

#include "linear/ksp.h"
#include "options/options.h"

namespace pellicle::projection {

namespace {

constexpr char letters[] = "RGBY";  // of all_colours

}  // namespace

std::vector<std::string> names_of(ColourOrder) {
  std::vector<std::string> names;
  std::array<Colour, 4> order = all_colours;
  do {
    std::string& name = names.emplace_back();
    for (const Colour colour : order) {
      name += letters[colour];
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return names;
}

std::array<Colour, 4> colours_of(const Choice<ColourOrder>& order) {
  std::array<Colour, 4> colours{};
  std::transform(order.name().begin(), order.name().end(), colours.begin(),
                 [](char letter) { return static_cast<Colour>(std::string(letters).find(letter)); });
  return colours;
}

void describe(OptionTable& table, ProjectOptions& options) {
  table.add("project.method", options.method,
            "successive: the colours one after the other, the paper's; joint: all springs in one system, softened by "
            "the shift, whose iterations begin where the last step's ended: no colour wins, and forces go through the "
            "sheet within a step, which one that hangs needs",
            "burning paper, section 7.1");
  table.add("project.max_steps", options.max_steps, Rules().at_least(1),
            "projection steps in a time step; each projects the four colours in turn",
            "burning paper, section 7.1 and Table 2");
  table.add("project.threshold", options.threshold, Rules("m").at_least(0),
            "norm ||C|| over all springs at which the projection stops early", "burning paper, Table 2");
  table.add("project.error_limit", options.error_limit, Rules().more_than(0),
            "||C|| / ||l|| (about twice the rms strain) beyond which a projection has failed and the step is retried");
  table.add("project.order", options.order,
            "order of the colours in a projection step: a permutation of R, G, B and Y; the last wins",
            "burning paper, section 7.1");
  table.add("project.masses", options.masses,
            "true: J M^-1 J^T, light particles give way and momentum is conserved; equal: J J^T, the paper's, all "
            "particles move alike and the momentum of a sheet of uneven mass drifts",
            "burning paper, eq. 16; docs/theory.md: readings");
  table.add("project.pins", options.pins,
            "exact: a pinned particle has no inverse mass; paper: it counts in J J^T although it does not move",
            "docs/theory.md: readings; burning paper, Table 1");
  table.add("project.shift", options.shift, Rules().range(0, 1),
            "diagonal shift of the Gram matrices, relative to their largest diagonal entry; with true masses to the "
            "largest that a spring between particles of half the mean mass can have",
            "docs/theory.md: parameters");
  for (const Colour colour : all_colours) {
    table.add(std::string("project.weight_") + colour_names[colour], options.weight[colour], Rules().range(0, 1),
              std::string("share of the constraint error that a projection corrects, ") + colour_names[colour] +
                  " springs; less is softer",
              "burning paper, eq. 19; docs/theory.md: readings");
  }
  table.add("project.weight_texture", options.weight_texture, Rules().file(),
            "PNG whose brightness at the uv coordinates multiplies the weight of each spring",
            "burning paper, section 7.2");
  table.add("project.mat_type", options.mat_type,
            "Gram matrices: lines: lines of springs in one direction are eliminated, those in the other precondition; "
            "aij: rows, which lines becomes when a pc_type is given; sell: PETSc's sliced ELLPACK; shell: matrix-free",
            "burning paper, section 8.1");
  table.add("project.ksp_rtol", options.ksp_rtol, Rules().more_than(0).at_most(largest_unjudged_rtol),
            "relative tolerance of the linear solves",
            "measured: 1e-3 differs from a direct solve by 6e-7 of the sheet after 5 steps");
  table.add("project.strain_steps", options.strain_steps,
            Rules().at_least(0).acts_with(is_given("project.strain_limit", options.strain_limit)),
            "how many times the net is projected back below project.strain_limit before the step fails");
  table.add("project.monitor", options.monitor,
            "print ||C|| of each colour and of all after each projection step, and write them to projection.csv",
            "burning paper, Fig. 8");
  table.add_solver_prefix("project_", {"red_", "green_", "blue_", "yellow_"});
  table.add_under(one_of("project.method", options.method, {ProjectMethod::joint}),
                  [&] { table.add_solver_prefix("project_joint_"); });
}

void describe_strain_limit(OptionTable& table, ProjectOptions& options) {
  table.add("project.strain_limit", options.strain_limit, Rules().more_than(0),
            "largest strain, a share, of the springs of the net (blue and green) at the end of a step, or the step "
            "fails: what is beyond it is brought back by further solves; springs of an elastic sheet stiffen from 0.8 "
            "of it on; none unless given");
}

}  // namespace pellicle::projection
