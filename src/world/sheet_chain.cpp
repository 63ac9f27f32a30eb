#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "ablation/ablation.h"
#include "parallel/collective.h"
#include "state/mesh_tables.h"
#include "surface/shell.h"
#include "world/chain.h"
#include "world/fire_stages.h"
#include "world/load_mesh.h"
#include "world/sheet_motion.h"

namespace pellicle::world {

namespace {

const Sheet& sheet_of(const Surface& surface) { return static_cast<const Sheet&>(surface); }

MovedSurface moved(LoadedSheet loaded) {
  return {std::make_shared<Sheet>(std::move(loaded.sheet)), std::move(loaded.particles), std::move(loaded.cells)};
}

/// The table of the ids of a sheet in its group of a checkpoint.
std::string ids_of(const std::string& group) { return group + "/mesh/first_lattice_id_and_end"; }

/// See make_sheet_chain.
class SheetChain : public Chain {
 public:
  explicit SheetChain(const Options& options)
      : Chain(options,
              {{"heat", "combustion", "ablation", "external force", "projection", "velocity", "compaction", "output"},
               "compaction",
               "the sheet has burnt away",
               "sheet"}) {}

  std::vector<std::string> lines(const Surface& surface) const override {
    const Sheet& sheet = sheet_of(surface);
    std::string springs = "springs:";
    for (const Colour colour : all_colours) {
      if (sheet.acts(colour)) {
        springs += std::string(" ") + colour_names[static_cast<std::size_t>(colour)] + " " +
                   std::to_string(sheet.of(colour).layout.global);
      }
    }
    return {springs, partition_line(surface)};
  }

  std::shared_ptr<const Surface> make_surface(MPI_Comm comm, MeshRows rows) const override {
    return std::make_shared<Sheet>(make_sheet(comm, std::move(rows), shell_options(options_)));
  }

  std::shared_ptr<const Surface> read_surface(const Hdf5File& checkpoint, const std::string& group) const override {
    const std::vector<PetscInt> ids = checkpoint.read_all<PetscInt>(ids_of(group));
    return std::make_shared<Sheet>(make_sheet(checkpoint.comm(), read_mesh(checkpoint, group + "/mesh"),
                                              SheetIds{ids.at(0), ids.at(1)}, shell_options(options_))
                                       .sheet);
  }

  void write_surface(Hdf5File& checkpoint, const std::string& group, const Surface& surface) const override {
    const Sheet& sheet = sheet_of(surface);
    const std::vector<bool> all(static_cast<std::size_t>(sheet.elements.owned), true);
    write_mesh(checkpoint, group + "/mesh", rows_of(sheet, all, {}, {}));
    checkpoint.write_once<PetscInt>(ids_of(group), {sheet.first_lattice_id, sheet.id_end});
  }

  MovedSurface split(const Surface& surface, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements) const override {
    return moved(pellicle::split(sheet_of(surface), corners, particles, copies, elements, shell_options(options_)));
  }

  std::optional<MovedSurface> compact(const Surface& surface, const State& state) const override {
    std::vector<bool> kept = empty_cells(sheet_of(surface), state.burning->active);
    kept.flip();
    const auto left = sum_over_ranks(surface.comm(), static_cast<PetscInt>(std::count(kept.begin(), kept.end(), true)));
    const PetscInt before = surface.elements.global;
    if (static_cast<double>(before - left) <= options_.ablation.compact_fraction * static_cast<double>(before)) {
      return {};
    }
    return moved(pellicle::compact(sheet_of(surface), kept, state.packed(Item::particle), state.packed(Item::cell),
                                   shell_options(options_)));
  }

  std::optional<MovedSurface> spread(const Surface& surface, const State& state,
                                     const std::vector<double>& load) const override {
    constexpr int interval = 50;  // steps
    if (ranks_of(surface.comm()) == 1 || options_.sheet.partitioner != Partitioner::metis ||
        state.step % interval != 0) {
      return {};
    }
    const RankShares shares = shares_of_ranks(surface.comm(), std::accumulate(load.begin(), load.end(), 0.0));
    if (shares.sum <= surface.elements.global || shares.imbalance <= options_.sheet.imbalance_limit) {
      return {};
    }
    return moved(pellicle::spread(sheet_of(surface), load, state.packed(Item::particle), state.packed(Item::cell),
                                  shell_options(options_)));
  }

  std::unique_ptr<State> initial_state(const Surface& surface) const override {
    const Chambers chambers(surface, options_.gas, options_.chambers);
    auto state = std::make_unique<State>(surface, options_, chambers.count());
    state->position.values() = perturbed_positions(sheet_of(surface), options_.sheet);
    const Pins pins(surface, options_.pins);
    pins.impose(state->position, 0);
    state->pin = pins.numbers();
    state->chamber = chambers.numbers();
    if (state->gas != nullptr) {
      *state->gas = chambers.first_exchange(chambers.volumes(state->position));
    }
    return state;
  }

  Stages make_stages(const Surface& surface, State& state, StageClock& clock, Textures& textures) const override {
    Stages stages;
    if (!options_.chambers.empty()) {
      const bool is_projected = options_.dynamics == Dynamics::projection;
      stages.gas = &stages.add<GasStage>(surface, options_, state,
                                         is_projected ? TimeIntegrator() : integrator_of(options_.time));
    }
    SheetMotion& motion =
        stages.add(make_sheet_motion(sheet_of(surface), options_, state, clock, textures, stages.gas));
    stages.motion = &motion;
    stages.add_before_motion(std::make_unique<HeatStage>(surface, options_, state, clock, textures));
    stages.add_before_motion(std::make_unique<CombustionStage>(surface, options_, state, clock, textures));
    stages.add_before_motion(std::make_unique<ShrinkageStage>(motion, clock));
    stages.add_before_motion(std::make_unique<AblationStage>(surface, options_, state, clock));
    if (cracks_of(options_).strength) {
      stages.add<CrackStage>(surface, options_, state, clock, textures, motion);
    }
    stages.add<StrainStage>(state, motion);
    stages.add<HeatBalanceStage>(surface, options_, state, clock);
    return stages;
  }
};

}  // namespace

std::unique_ptr<Chain> make_sheet_chain(const Options& options) { return std::make_unique<SheetChain>(options); }

}  // namespace pellicle::world
