#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "contact/body_correction.h"
#include "elastic/mass_part.h"
#include "projection/successive_projection.h"
#include "world/pressure_impulse.h"
#include "world/sheet_motion.h"
#include "world/textures.h"

namespace pellicle {
inline namespace world {

/// The motion of a sheet that is projected (burning paper, section 7.1): it moves by itself, out of bodies and pushed
/// by its gas. A sheet that touches itself or others is projected first, and the balance moves it as masses from there.
class ProjectedMotion : public SheetMotion {
 public:
  /// All must outlive it. Collective. @throws Error on textures, and on a threshold that would stop nothing
  ProjectedMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, Textures& textures,
                  GasStage* gas);

  StepPart* part() override { return masses_.get(); }
  GasFilled* gas() override { return gas_coupling_ ? &*gas_coupling_ : nullptr; }
  void choose_pressures() override;
  StageResult move(bool& is_done) override;
  std::string start_fault() const override {
    return body_contact_ != nullptr ? body_contact_->start_fault() : bodies_.start_fault();
  }
  const std::vector<Eigen::Matrix3d>& stress() override {
    return spring_stress_->find(state_.burning->active, force_, state_.position);
  }
  const std::vector<Body>& bodies() const override {
    return body_contact_ != nullptr ? body_contact_->bodies() : bodies_.bodies();
  }

 protected:
  StageResult begin_balance(Step& step) override;
  StageResult find_positions(Step& step) override;
  Eigen::Matrix3Xd gas_forces() override;
  void add_spring_forces(Eigen::Matrix3Xd& sum) override;
  void leave_bodies(Step& step) override;
  std::string body_fault(const Step& step) const override { return bodies_.fault(step.loads); }

 private:
  bool waits_for_gas() const;
  StageResult project(bool& is_done);
  StageResult project_springs();
  void begin_masses(const Field& positions);
  ContactStep contact_step() const {
    return {sheet_.particles, start_, constrained_, state_.time + h_, h_, mass_, &start_velocity_};
  }

  BodyCorrection bodies_;  ///< none if the forces of bodies are brought into balance
  SuccessiveProjection projection_;
  std::unique_ptr<MassPart> masses_;          ///< null: the sheet touches nothing
  std::optional<GasCoupling> gas_coupling_;   ///< if the sheet has chambers
  std::optional<PressureImpulse> impulse_;    ///< of the gas in the step in progress
  std::array<std::vector<double>, 4> force_;  ///< of the owned springs in the last step, if anything asks for it [N]
  StageResult moved_;                         ///< of all projections of the step, with ||C|| at the end [m]
  int projections_ = 0;                       ///< so often has the sheet been projected again in the step, see move
  PetscInt contacts_ = 0;                     ///< particles of this rank that bodies hold
  Field end_;                                 ///< of a sheet that gas pushes: where it has come to
  Eigen::Matrix3Xd free_position_;            ///< positions without springs, bodies and gas
  Eigen::Matrix3Xd free_velocity_;            ///< velocities without them
  std::optional<Field> spring_force_;         ///< see add_spring_forces; where pins move
};

}  // namespace world
}  // namespace pellicle
