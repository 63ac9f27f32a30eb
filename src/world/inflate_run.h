#pragma once

#include <memory>
#include <optional>

#include "world/balloon_ledger.h"
#include "world/inflate.h"
#include "world/object.h"

namespace pellicle {

/// A balloon: its chain with state, frames and history.
class InflateRun : public Object {
 public:
  /// Options must outlive it. Collective. @throws Error on bad input, see Inflate
  InflateRun(Membrane membrane, const Options& options, const ObjectOutput& output);
  /// The object as a checkpoint has it. Collective.
  InflateRun(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output);

  const Membrane& membrane() const { return *membrane_; }

  BalloonState& state() override { return state_; }
  StepResult advance(double h) override;
  void accept(double time) override { state_.time = time; }
  void keep() override;
  void restore() override;
  void draw(const FrameSink& write) override;
  void record(double h, int retries) override;
  void save(Hdf5File& checkpoint) const override;
  void forget() override { inflate_.forget(); }
  void resume_output(const Hdf5File& checkpoint) override;
  std::vector<std::string> remarks() const override { return ledger_->remarks(); }

 private:
  std::unique_ptr<Membrane> membrane_;
  ObjectOutput output_;
  Inflate inflate_;
  BalloonState state_;
  BalloonState kept_;  ///< to put back
  Drawing surface_;
  InflateStep last_;                       ///< what the last step told
  std::unique_ptr<BalloonLedger> ledger_;  ///< made with the first row, when the first frame has made the folder
};

}  // namespace pellicle
