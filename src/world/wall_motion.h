#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "air/drag_potential.h"
#include "base/stage_clock.h"
#include "constraints/constraints.h"
#include "constraints/pins.h"
#include "constraints/point_loads.h"
#include "contact/body_contact.h"
#include "equilibrium/gas_filled_part.h"
#include "equilibrium/path_part.h"
#include "equilibrium/wall_part.h"
#include "io/texture.h"
#include "prism/prism_elements.h"
#include "prism/volume_preservation.h"
#include "prism/wall_bending.h"
#include "world/gas_stage.h"
#include "world/options.h"
#include "world/stage.h"
#include "world/state.h"

namespace pellicle {
inline namespace world {

/// The supports of a wall: pins and planes of symmetry.
struct WallSupports {
  /// @param state says what is pinned; null: the options do. Collective. @throws Error on bad pins and planes
  WallSupports(const Membrane& membrane, const Options& options, const State* state);
  Pins pins;
  Constraints constraints;
};

/// The wall of a membrane. @throws Error on bad materials, textures and regions. Collective.
Wall wall_of(const Membrane& membrane, const Options& options, Textures& textures);

/// The motion of a wall in a step: the implicit step of the balloon paper (Algorithm 1), volume preservation,
/// velocities. By generalized alpha (TimeOptions::scheme) the step starts from accelerations, too, which follow from
/// the forces in the first one.
class WallMotion : public MotionStage {
 public:
  /// All must outlive it. Collective. @throws Error on bad materials, textures, regions and loads
  /// @param supports of the wall @param gas of its chambers, if there are any
  WallMotion(const Membrane& membrane, const Options& options, State& state, StageClock& clock, Textures& textures,
             WallSupports& supports, GasStage& gas);

  void start() override;
  void update_derived() override;
  StageResult begin(Step& step) override;
  StageResult take_balance(Step& step) override;
  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;
  void draw(Picture& picture) const override;
  std::vector<std::string> remarks() const override;

  StepPart* part() override { return part_; }
  std::string stage() const override { return "implicit step"; }
  GasFilled* gas() override { return filled_ ? &*filled_ : nullptr; }
  std::string start_fault() const override { return bodies_.start_fault(); }
  ContactSurface::Part contact_part() const override {
    return {&membrane_, options_.contact.thickness, options_.contact.stiffness.value_or(usual_stiffness_)};
  }
  const std::vector<bool>* active() const override { return state_.active_triangles(); }
  std::vector<bool> constrained() const override;
  const double* mass() const override { return mass_.data(); }
  const std::vector<bool>& pinned() const override { return supports_.pins.pinned(); }
  const std::vector<Eigen::Matrix3d>& stress() override;
  const std::vector<Body>& bodies() const override { return bodies_.bodies(); }
  std::string progress(const Step& step) const override;

  const PrismElements& elements() const { return elements_; }

 private:
  StepStart start_of_step() const;
  void set_burnt();
  void begin_acceleration();
  void set_drag(double fraction);
  void add_work();
  double find_velocities();
  void set_pressures(double time);
  bool has_left(PetscInt i) const { return state_.burning && state_.burning->mass.data()[i] == 0; }

  const Membrane& membrane_;
  const Options& options_;
  State& state_;
  StageClock& clock_;
  WallSupports& supports_;
  GasStage& gas_;
  Wall wall_;
  std::vector<double> mass_;  ///< of the owned vertices at present [kg]
  PrismElements elements_;
  TimeIntegrator integrator_;
  PointLoads loads_;
  double usual_stiffness_;  ///< of contact [Pa/m]
  BodyContact bodies_;
  std::optional<WallBending> bending_;   ///< unless the wall has none
  std::unique_ptr<Potential> hold_;      ///< of vertices that have left; null: nothing burns
  std::optional<AirDrag> air_;           ///< if there is air
  std::unique_ptr<Potential> drag_;      ///< of the air; null: there is none
  std::unique_ptr<Potential> buoyancy_;  ///< forces of GasStage::uneven_forces; null: there are none
  std::optional<WallPart> wall_part_;
  std::optional<GasFilledPart> filled_;                      ///< if there are chambers
  std::optional<PathPart> path_;                             ///< by arc length
  StepPart* part_ = nullptr;                                 ///< the wall, with gas and along the path
  std::unique_ptr<VolumePreservation> volume_preservation_;  ///< null: the wall's rule does not ask for it
  double rubber_volume_ = 0;                                 ///< undeformed, of all ranks [m^3]
  std::vector<Eigen::Matrix3d> stress_;
  double h_ = 0;          ///< length of the step [s]
  Field start_;           ///< positions at the beginning of the step
  Field start_velocity_;  ///< velocities then
};

}  // namespace world
}  // namespace pellicle
