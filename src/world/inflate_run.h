#pragma once

#include <memory>
#include <optional>

#include "io/frame_writer.h"
#include "world/balloon_ledger.h"
#include "world/inflate.h"
#include "world/step_control.h"

namespace pellicle {

/// The balloon with its state, frames and books, for the step control.
class InflateRun : public Chain {
 public:
  /// Options, folder and clock must outlive it. Collective. @throws Error on bad input, see Inflate
  InflateRun(Membrane membrane, const Options& options, OutputFolder& folder, StageClock& clock);
  /// The run as a checkpoint has it. Collective.
  InflateRun(const Hdf5File& checkpoint, const Options& options, OutputFolder& folder, StageClock& clock);

  const Membrane& membrane() const { return *membrane_; }

  double time() const override { return state_.time; }
  int step() const override { return state_.step; }
  double& length() override { return state_.next_length; }
  FieldRegistry& state() override { return state_; }
  StepResult advance(double h) override;
  void accept(double time) override { state_.time = time; }
  void keep() override;
  void restore() override;
  bool frame_due() const override { return writer_.due(state_.time, state_.step); }
  std::optional<double> next_frame_time() const override { return writer_.next_time(state_.time); }
  void draw() override;
  void record(double h, int retries) override;
  void save(Hdf5File& checkpoint) const override;
  void forget() override { inflate_.forget(); }
  void resume_output(const Hdf5File& checkpoint) override;
  std::vector<std::string> remarks() const override { return ledger_->remarks(); }

 private:
  std::unique_ptr<Membrane> membrane_;
  OutputFolder& folder_;
  StageClock& clock_;
  Inflate inflate_;
  BalloonState state_;
  BalloonState kept_;  ///< to put back
  Drawing surface_;
  FrameWriter writer_;
  InflateStep last_;                       ///< what the last step told
  std::unique_ptr<BalloonLedger> ledger_;  ///< made with the first row, when the first frame has made the folder
};

}  // namespace pellicle
