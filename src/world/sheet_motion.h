#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ablation/spring_stress.h"
#include "io/texture.h"
#include "surface/sheet.h"
#include "surface/weave_strain.h"
#include "world/surface_motion.h"

namespace pellicle::world {

/// The motion of a sheet in a step of implicit Euler: external force (burning paper, eq. 8 and 9), then springs, bodies
/// and gas by a balance or a projection, then velocities (eq. 13 and 15). Masses and target lengths follow the
/// burnt fraction.
class SheetMotion : public SurfaceMotion {
 public:
  void update_derived() override { set_lengths(); }
  StageResult begin(Step& step) override;
  StageResult take_balance(Step& step) override;
  StageResult end(Step& step) override {
    find_velocities(step);
    return result_of(body_fault(step));
  }
  void report(Report& report, const Step& step) const override;
  void draw(Picture& picture) const override;

  /// Sets the target lengths from the burnt fractions (burning paper, eq. 5 and 6). Not collective.
  virtual void set_lengths();
  /// Strains of the sheet as it is now. Collective.
  virtual WeaveStrain weave_strain() const {
    return surface::weave_strain(sheet_, state_.position, state_.target_length, state_.burning->active);
  }
  std::string stage() const override { return "projection"; }
  const double* mass() const override { return state_.burning->mass.data(); }
  std::string progress(const Step& step) const override;
  std::vector<bool> constrained() const override { return constrained_; }

 protected:
  /// @param contact_stiffness of contact in steps of the deck's length, unless the deck has one [Pa/m]
  /// @param gas of the sheet; null: it has no chambers
  SheetMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
              double contact_stiffness, const TimeIntegrator& integrator = {});

  /// Begins the balance or the projection from the free positions in the state.
  virtual StageResult begin_balance(Step& step) = 0;
  /// Takes positions and figures from the balance or the projection.
  virtual StageResult find_positions(Step& step) = 0;
  /// Forces of gas at the end of the step on the owned particles [N]; empty: there are none.
  virtual Eigen::Matrix3Xd gas_forces() = 0;
  /// Adds forces of the springs on the owned particles [N].
  virtual void add_spring_forces(Eigen::Matrix3Xd& sum) = 0;
  /// Work of viscosity in the step [J].
  virtual double viscous_work() const { return 0; }
  /// Sets the velocities of particles that leave bodies, and the loads on the bodies.
  virtual void leave_bodies(Step& step);
  /// Names a body that the sheet is too deep in; empty: there is none.
  virtual std::string body_fault(const Step& /*step*/) const { return ""; }
  /// Whether each step ends at rest.
  bool is_static() const { return integrator_.is_static(); }
  /// Moves the particles by their velocities without springs, bodies and gas (burning paper, eq. 8 and 9).
  virtual void move_freely();
  bool is_carried(PetscInt i) const override { return carried_[i]; }
  /// Velocity of an owned particle where forces are in balance [m/s]. Not collective.
  virtual Eigen::Vector3d velocity_of_balance(PetscInt i) const {
    return is_static() ? Eigen::Vector3d::Zero() : Eigen::Vector3d((state_.position.vector(i) - start_.vector(i)) / h_);
  }
  /// Moves the sheet from where forces are in balance to the end of the step.
  virtual void move_to_end() {}
  /// Finds velocities from the positions at the end of the step (eq. 13 and 15), and the loads on bodies.
  virtual void find_velocities(Step& step);

  StageResult take_positions(const StepPart& part, Step& step);
  /// Forces of a potential on the owned particles, kept until the next call [N].
  const Eigen::Matrix3Xd& forces_of(const Potential& potential);

  const Sheet& sheet_;
  bool pins_move_;                             ///< some are led along paths
  std::optional<SpringStress> spring_stress_;  ///< if the sheet can crack
  double usual_stiffness_;                     ///< of contact in steps of the deck's length [Pa/m]
  // Data of the present step, of the local particles unless stated otherwise.
  Eigen::Matrix3Xd unconstrained_;    ///< positions without springs and bodies [m]
  std::vector<bool> constrained_;     ///< those that are pinned or have left
  std::vector<bool> carried_;         ///< those of them that have left and go with their quads (carry_removed_corners)
  std::vector<double> volume_ratio_;  ///< see set_volume_ratios
  double fading_ = 0;                 ///< c h of velocities, see move_freely
  double damping_ = 0;                ///< c of velocities, where damping is a force [1/s]
  Eigen::Matrix3Xd uneven_;           ///< forces of the weights of gas and air, and of jets, if there are any [N]
  double size_;                       ///< square root of the undeformed area, with time.tolerance [m]

 private:
  void push_by_weights_of_gas();
  void add_work();

  /// Arrays over the owned particles that add_work uses. They are kept so that a step allocates nothing.
  struct {
    Eigen::Matrix3Xd forces;  ///< of a potential [N]
    Eigen::Matrix3Xd all;     ///< the sum of all forces, where pins move [N]
    Eigen::VectorXd works;    ///< on this rank, then on all [J]
  } work_;
};

/// Shrinkage of a sheet where it has lost mass, before anything is removed from it.
class ShrinkageStage : public Stage {
 public:
  /// Motion and clock must outlive it.
  ShrinkageStage(SheetMotion& motion, StageClock& clock) : motion_(motion), clock_(clock) {}

  StageResult begin(Step& /*step*/) override {
    const auto timer = clock_.time("combustion");
    motion_.set_lengths();
    return {};
  }

 private:
  SheetMotion& motion_;
  StageClock& clock_;
};

/// The strains of a sheet at the end of each step, when cracks have been made, and the largest of all steps.
class StrainStage : public Stage {
 public:
  /// State and motion must outlive it.
  StrainStage(State& state, const SheetMotion& motion) : state_(state), motion_(motion) {}

  StageResult end(Step& step) override;
  void report(Report& report, const Step& step) const override;
  std::vector<std::string> remarks() const override;

 private:
  State& state_;
  const SheetMotion& motion_;
};

// The motions of sheets. All must outlive them. Collective. @throws Error on textures and other input

/// A sheet that is projected (burning paper, section 7.1).
std::unique_ptr<SheetMotion> make_projected_motion(const Sheet& sheet, const Options& options, State& state,
                                                   StageClock& clock, Textures& textures, GasStage* gas);
/// The motion that `dynamics` asks for: of a projected sheet, of one of Hooke springs, or as a material (ElasticSheet).
std::unique_ptr<SheetMotion> make_sheet_motion(const Sheet& sheet, const Options& options, State& state,
                                               StageClock& clock, Textures& textures, GasStage* gas);

}  // namespace pellicle::world
