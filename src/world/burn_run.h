#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/console.h"
#include "io/frame_writer.h"
#include "world/burn.h"
#include "world/ledger.h"
#include "world/step_control.h"

namespace pellicle {

/// The burning chain with its sheet, state, frames and books, for the step control. Cells that have burnt away are
/// removed from the sheet now and then, see `ablation.compact_fraction`.
class BurnRun : public Chain {
 public:
  /// Options, folder, console and clock must outlive it. Collective.
  /// @throws Error on bad textures and other input, or when adaptive steps are asked for
  BurnRun(Sheet sheet, const Options& options, OutputFolder& folder, Console& console, StageClock& clock);
  /// The run as a checkpoint has it. Collective.
  BurnRun(const Hdf5File& checkpoint, const Options& options, OutputFolder& folder, Console& console,
          StageClock& clock);

  const Sheet& sheet() const { return *sheet_; }

  double time() const override { return state_->time; }
  int step() const override { return state_->step; }
  double& length() override { return state_->next_length; }
  FieldRegistry& state() override { return *state_; }
  StepResult advance(double h) override;
  void accept(double time) override;
  void keep() override;
  void restore() override;
  std::string ended() const override;
  bool frame_due() const override { return writer_.due(state_->time, state_->step); }
  std::optional<double> next_frame_time() const override { return writer_.next_time(state_->time); }
  void draw() override;
  void record(double h, int retries) override;
  void save(Hdf5File& checkpoint) const override;
  void forget() override;
  void resume_output(const Hdf5File& checkpoint) override;

 private:
  void compact(const std::vector<bool>& kept);
  Ledger& ledger();

  const Options& options_;
  OutputFolder& folder_;
  Console& console_;
  StageClock& clock_;
  // The sheet, and what depends on its numbering.
  std::unique_ptr<Sheet> sheet_;
  std::unique_ptr<Burn> burn_;
  std::unique_ptr<State> state_;
  FrameWriter writer_;
  BurnStep last_;                   ///< what the last step told
  std::unique_ptr<State> kept_;     ///< of the present sheet, to put back
  std::unique_ptr<Ledger> ledger_;  ///< made when the first frame has made the folder
};

}  // namespace pellicle
