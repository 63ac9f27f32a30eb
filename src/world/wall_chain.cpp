#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "constraints/point_loads.h"
#include "state/mesh_tables.h"
#include "surface/membrane.h"
#include "world/chain.h"
#include "world/fire_stages.h"
#include "world/load_mesh.h"
#include "world/wall_motion.h"

namespace pellicle::world {

namespace {

const Membrane& membrane_of(const Surface& surface) { return static_cast<const Membrane&>(surface); }

/// The membrane with the masses of its wall and its edges, if it burns. Collective.
std::shared_ptr<const Surface> burnable(Membrane membrane, const Options& options) {
  auto made = std::make_shared<Membrane>(std::move(membrane));
  if (balloon_burns(options)) {
    Textures textures(made->comm());
    const Wall wall = wall_of(*made, options, textures);
    std::vector<double> mass;
    for (std::size_t e = 0; e < wall.rest.size(); ++e) {
      mass.push_back(wall.density[e] * wall.rest[e].volume);
    }
    set_burnable(*made, std::move(mass));
  }
  return made;
}

/// See make_wall_chain.
class WallChain : public Chain {
 public:
  explicit WallChain(const Options& options)
      : Chain(options,
              {balloon_burns(options)
                   ? std::vector<std::string>{"heat", "combustion", "ablation", "implicit step", "velocity", "output"}
                   : std::vector<std::string>{"implicit step", "volume preservation", "velocity", "output"},
               "ablation", "the wall has burnt away", "balloon"}) {}

  std::vector<std::string> lines(const Surface& surface) const override { return {partition_line(surface)}; }

  std::shared_ptr<const Surface> make_surface(MPI_Comm comm, MeshRows rows) const override {
    return burnable(make_membrane(comm, std::move(rows), options_.sheet).membrane, options_);
  }

  std::shared_ptr<const Surface> read_surface(const Hdf5File& checkpoint, const std::string& group) const override {
    return make_surface(checkpoint.comm(), read_mesh(checkpoint, group + "/mesh"));
  }

  void write_surface(Hdf5File& checkpoint, const std::string& group, const Surface& surface) const override {
    write_mesh(checkpoint, group + "/mesh", rows_of(membrane_of(surface), {}, {}));
  }

  MovedSurface split(const Surface& surface, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements) const override {
    LoadedMembrane loaded = pellicle::split(membrane_of(surface), corners, particles, copies, elements, options_.sheet);
    return {burnable(std::move(loaded.membrane), options_), std::move(loaded.particles), std::move(loaded.elements)};
  }

  std::unique_ptr<State> initial_state(const Surface& surface) const override {
    const Membrane& membrane = membrane_of(surface);
    const Pins pins(membrane, options_.pins);
    const Constraints constraints(membrane, options_.symmetry, pins);
    const Projectors& projectors = constraints.projectors;
    const Chambers chambers(membrane, options_.gas, options_.chambers, constraints.origin, constraints.planes,
                            projectors);
    auto state = std::make_unique<State>(surface, options_, chambers.count());
    const Eigen::Matrix3Xd noise = perturbed_positions(membrane, options_.sheet) - membrane.rest;
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      state->position.vector(i) += projectors[i] * noise.col(i);
    }
    pins.impose(state->position, 0);
    state->pin = pins.numbers();
    state->chamber = chambers.numbers();
    if (state->gas != nullptr) {
      *state->gas = chambers.first_exchange(chambers.volumes(state->position));
    }
    if (state->loads != nullptr) {
      *state->loads = PointLoads(membrane, vertex_areas(membrane), options_.attachments, options_.forces).chosen();
    }
    return state;
  }

  Stages make_stages(const Surface& surface, State& state, StageClock& clock, Textures& textures) const override {
    const Membrane& membrane = membrane_of(surface);
    Constraints constraints(membrane, options_.symmetry, Pins(membrane, options_.pins, state.pin));
    Stages stages;
    if (state.burning) {
      stages.add<HeatStage>(surface, options_, state, clock, textures);
      stages.add<CombustionStage>(surface, options_, state, clock, textures);
      stages.add<AblationStage>(surface, options_, state, clock);
    }
    stages.gas = &stages.add<GasStage>(surface, options_, state, integrator_of(options_.time), constraints.origin,
                                       constraints.planes);
    stages.motion =
        &stages.add<WallMotion>(membrane, options_, state, clock, textures, std::move(constraints), *stages.gas);
    if (state.burning) {
      if (cracks_of(options_).strength) {
        stages.add<CrackStage>(surface, options_, state, clock, textures, *stages.motion);
      }
      stages.add<HeatBalanceStage>(surface, options_, state, clock);
    }
    return stages;
  }
};

}  // namespace

std::unique_ptr<Chain> make_wall_chain(const Options& options) { return std::make_unique<WallChain>(options); }

}  // namespace pellicle::world
