#pragma once

#include <memory>
#include <optional>

#include "io/frame_writer.h"
#include "simulation/burn.h"
#include "simulation/ledger.h"
#include "simulation/step_control.h"

namespace pellicle {

/// The burning chain with its state, frames and books, for the step control.
class BurnRun : public Chain {
 public:
  /// Sheet, options and clock must outlive it. Collective.
  /// @throws Error on bad textures and other input, or when adaptive steps are asked for
  BurnRun(const Sheet& sheet, const Options& options, StageClock& clock);

  double time() const override { return state_.time; }
  int step() const override { return state_.step; }
  StepResult advance(double h) override;
  void set_time(double time) override { state_.time = time; }
  void keep() override { kept_.emplace(state_); }
  void restore() override { kept_->restore(state_); }
  bool frame_due() const override { return writer_.due(state_.time, state_.step); }
  std::optional<double> next_frame_time() const override { return writer_.next_time(state_.time); }
  void draw() override;
  void record(double h, int retries) override;

 private:
  const Sheet& sheet_;
  const Options& options_;
  StageClock& clock_;
  Burn burn_;
  State state_;
  FrameWriter writer_;
  BurnStep last_;  ///< what the last step told
  std::optional<Snapshot> kept_;
  std::unique_ptr<Ledger> ledger_;  ///< made with the first row, when the first frame has made the folder
};

}  // namespace pellicle
