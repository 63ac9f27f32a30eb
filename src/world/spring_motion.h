#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "elastic/spring_sheet.h"
#include "equilibrium/gas_filled_part.h"
#include "world/sheet_motion.h"
#include "world/textures.h"

namespace pellicle {
inline namespace world {

/// The motion of a sheet of Hooke springs: springs, bodies, drag of the air and gas are brought into balance. By
/// statics (TimeOptions::scheme) each step ends at rest; by generalized alpha forces are in balance within the
/// step, which starts from accelerations, too (TimeIntegrator).
class SpringMotion : public SheetMotion {
 public:
  /// All must outlive it. Collective.
  SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas);

  void update_derived() override;
  void report(Report& report, const Step& step) const override;

  StepPart* part() override { return filled_ ? static_cast<StepPart*>(&*filled_) : springs_.get(); }
  GasFilled* gas() override { return filled_ ? &*filled_ : nullptr; }
  std::string start_fault() const override { return body_contact_ != nullptr ? body_contact_->start_fault() : ""; }
  std::string passed_limit() const override;
  const std::vector<Eigen::Matrix3d>& stress() override;
  const std::vector<Body>& bodies() const override;

 protected:
  /// @param contact_stiffness see SheetMotion; `set_springs` must follow
  SpringMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, GasStage* gas,
               double contact_stiffness);
  void set_springs(std::unique_ptr<SpringSheet> springs);
  /// What acts on the particles' positions beside the springs.
  std::vector<Potential*> others() const;

  StageResult begin_balance(Step& step) override;
  StageResult find_positions(Step& step) override;
  Eigen::Matrix3Xd gas_forces() override { return filled_->pressure_forces(); }
  void add_spring_forces(Eigen::Matrix3Xd& sum) override;
  double viscous_work() const override;
  void leave_bodies(Step& step) override;
  std::string body_fault(const Step& /*step*/) const override { return ""; }
  bool is_static() const override { return integrator_.is_static(); }
  void move_freely() override;
  double fraction_of_balance() const override { return integrator_.fraction(); }
  Eigen::Vector3d velocity_of_balance(PetscInt i) const override;
  void move_to_end() override;
  void find_velocities(Step& step) override;

  std::unique_ptr<SpringSheet> springs_;

 private:
  SheetInput input(double h) const;
  void set_stiffness_factors();
  Kinematics motion(PetscInt i) const { return {start_velocity_.vector(i), state_.acceleration->vector(i)}; }
  void begin_acceleration();
  void set_drag(double fraction);
  void write_end(Field& position) const;

  TimeIntegrator integrator_;
  Field y_v_;        ///< of generalized alpha (TimeIntegrator)
  double pull_ = 0;  ///< of generalized alpha: inertia and damping pull by mass times this [1/s^2]

  std::unique_ptr<Potential> weight_;    ///< in a step of statics; else null
  std::unique_ptr<Potential> drag_;      ///< null: there is no air
  std::optional<GasFilledPart> filled_;  ///< if the sheet has chambers
  std::vector<double> holding_;          ///< of statics, in place of masses [kg]
  std::vector<double> stiffness_factor_;
};

/// The motion of a sheet as a material (ElasticSheet).
class ElasticMotion : public SpringMotion {
 public:
  /// All must outlive it. Collective. @throws Error on textures that cannot be read
  ElasticMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, Textures& textures,
                GasStage* gas);

  std::vector<std::string> first_remarks() const override;

  void set_lengths() override;
  WeaveStrain weave_strain() const override;

 protected:
  StageResult begin_balance(Step& step) override;

 private:
  double largest_excess_;  ///< see SpringSheet::largest_excess
};

}  // namespace world
}  // namespace pellicle
