#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "constraints/constraints.h"
#include "constraints/point_loads.h"
#include "equilibrium/wall_part.h"
#include "io/texture.h"
#include "prism/prism_elements.h"
#include "prism/volume_preservation.h"
#include "prism/wall_bending.h"
#include "world/surface_motion.h"

namespace pellicle::world {

/// The wall of a membrane. @throws Error on bad materials, textures and regions. Collective.
Wall wall_of(const Membrane& membrane, const Options& options, Textures& textures);

/// The motion of a wall in a step: the implicit step of the balloon paper (Algorithm 1), volume preservation,
/// velocities. By generalized alpha (TimeOptions::scheme) the step starts from accelerations, too, which follow from
/// the forces in the first one.
class WallMotion : public SurfaceMotion {
 public:
  /// All must outlive it. Collective. @throws Error on bad materials, textures, regions and loads
  /// @param gas of its chambers, if there are any
  WallMotion(const Membrane& membrane, const Options& options, State& state, StageClock& clock, Textures& textures,
             Constraints constraints, GasStage& gas);

  void start() override;
  void update_derived() override;
  StageResult begin(Step& step) override;
  StageResult take_balance(Step& step) override;
  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;
  void draw(Picture& picture) const override;
  std::vector<std::string> remarks() const override;

  std::string stage() const override { return "implicit step"; }
  std::vector<bool> constrained() const override;
  const double* mass() const override { return mass_.data(); }
  const std::vector<Eigen::Matrix3d>& stress() override;
  std::string progress(const Step& step) const override;

  const PrismElements& elements() const { return elements_; }

 private:
  void write_end(Field& position) const override;
  /// The data with which the wall's part begins a step. Along a path of equilibria they have no velocity: Newton's
  /// method begins at the start of the step.
  StepStart start_of_step() const {
    return {path_ ? nullptr : &state_.velocity, state_.thickness_ratio, state_.time_of_loads(), h_,
            state_.acceleration};
  }
  void begin_acceleration(const std::vector<bool>& still);
  void add_work();
  void set_pressures(double time);

  const Membrane& membrane_;
  Constraints constraints_;
  Wall wall_;
  PrismElements elements_;
  PointLoads loads_;
  std::optional<WallBending> bending_;   ///< unless the wall has none
  std::unique_ptr<Potential> hold_;      ///< of vertices that have left; null: nothing burns
  std::unique_ptr<Potential> drag_;      ///< of the air; null: there is none
  std::unique_ptr<Potential> buoyancy_;  ///< forces of GasStage::uneven_forces; null: there are none
  std::optional<WallPart> wall_part_;
  std::unique_ptr<VolumePreservation> volume_preservation_;  ///< null: the wall's rule does not ask for it
  std::vector<Eigen::Matrix3d> stress_;
};

}  // namespace pellicle::world
