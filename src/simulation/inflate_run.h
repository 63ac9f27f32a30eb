#pragma once

#include <memory>
#include <optional>

#include "io/frame_writer.h"
#include "simulation/balloon_ledger.h"
#include "simulation/inflate.h"
#include "simulation/step_control.h"

namespace pellicle {

/// The balloon with its state, frames and books, for the step control.
class InflateRun : public Chain {
 public:
  /// Membrane, options and clock must outlive it. Collective. @throws Error on bad input, see Inflate
  InflateRun(const Membrane& membrane, const Options& options, StageClock& clock);

  double time() const override { return state_.time; }
  int step() const override { return state_.step; }
  StepResult advance(double h) override;
  void accept(double time) override { state_.time = time; }
  void keep() override;
  void restore() override;
  bool frame_due() const override { return writer_.due(state_.time, state_.step); }
  std::optional<double> next_frame_time() const override { return writer_.next_time(state_.time); }
  void draw() override;
  void record(double h, int retries) override;

 private:
  struct Kept {
    Eigen::MatrixXd position;
    Eigen::MatrixXd velocity;
    std::vector<double> thickness_ratio;
    Eigen::VectorXd pressure;
  };

  const Membrane& membrane_;
  const Options& options_;
  StageClock& clock_;
  Inflate inflate_;
  BalloonState state_;
  Drawing surface_;
  FrameWriter writer_;
  InflateStep last_;  ///< what the last step told
  Kept kept_;
  std::unique_ptr<BalloonLedger> ledger_;  ///< made with the first row, when the first frame has made the folder
};

}  // namespace pellicle
