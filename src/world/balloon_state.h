#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "surface/membrane.h"
#include "world/burning_fields.h"
#include "world/object_state.h"

namespace pellicle {
inline namespace world {

/// All that changes in a balloon from step to step, and what its vertices and elements keep when cracks separate it.
struct BalloonState : ObjectState {
  /// At rest in the undeformed shape. The membrane must outlive the state. Collective.
  /// @param burns whether it has BurningFields; then the membrane must be burnable (set_burnable)
  BalloonState(const Membrane& membrane, int chambers, bool burns = false)
      : ObjectState(membrane.particles, {membrane.elements.owned, membrane.elements.local()}),
        pressure(add<Eigen::VectorXd>({"pressure", "Pa", Item::object}, chambers)) {
    position.values() = membrane.rest;
    thickness_ratio.assign(thickness_ratio.size(), 1.0);
    if (burns) {
      burning.emplace(*this, membrane);
    }
  }
  /// To be called if attachments and forces act on its vertices. Not collective. @param count of them
  void add_loads(int count) { loads = &add<std::vector<bool>>({"loads", "", Item::particle}, count); }
  /// To be called if its steps continue with accelerations (TimeIntegrator::is_second_order). Collective.
  void add_acceleration() { acceleration = &add<Field>({"acceleration", "m/s^2", Item::particle}, 3); }
  /// To be called if its steps follow arc length (TimeIntegrator::arc_length). Collective.
  void add_path() {
    load_time = &add<double>({"load_time", "s", Item::object});
    direction = &add<Field>({"path_direction", "", Item::particle}, 3);
  }
  BalloonState(BalloonState&&) = default;
  BalloonState& operator=(const BalloonState& other) {
    ObjectState::operator=(other);
    return *this;
  }

  /// Number of the pin that holds each local vertex, -1: none (Pins).
  std::vector<PetscInt>& pin = add<std::vector<PetscInt>>({"pin", "", Item::particle});
  /// Number of the chamber that each local element bounds, -1: none (Chambers).
  std::vector<PetscInt>& chamber = add<std::vector<PetscInt>>({"chamber", "", Item::cell});
  /// h/h0 of the local elements.
  std::vector<double>& thickness_ratio = add<std::vector<double>>({"thickness_ratio", "", Item::cell, Drawn::yes});
  Eigen::VectorXd& pressure;  ///< across the wall, of each chamber, the same on every rank
  std::optional<BurningFields> burning;
  std::vector<bool>* loads = nullptr;  ///< whether each acts on each local vertex (PointLoads::chosen)
  Field* acceleration = nullptr;       ///< of generalized alpha, which is not exactly that of this moment [m/s^2]
  double* load_time = nullptr;         ///< by arc length: time of the loads [s]
  Field* direction = nullptr;          ///< by arc length: of the last step, see StepPotential::write_direction

  /// Time at which pressures, places of pins and other loads are taken [s].
  double time_of_loads() const { return load_time != nullptr ? *load_time : time; }
};

}  // namespace world
}  // namespace pellicle
