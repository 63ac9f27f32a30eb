#pragma once

#include <memory>
#include <optional>
#include <string>

#include "world/balloon_ledger.h"
#include "world/inflate.h"
#include "world/object.h"

namespace pellicle {
inline namespace world {

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
  void accept(double time) override;
  void keep() override;
  void restore() override;
  std::string ended() const override { return ended_; }
  bool is_gone() const override { return state_.burning && state_.burning->pieces.present.empty(); }
  void draw(const FrameSink& write) override;
  void record(double h, int retries) override;
  void save(Hdf5File& checkpoint) const override;
  void forget() override { inflate_.forget(state_); }
  void resume_output(const Hdf5File& checkpoint) override;
  std::vector<std::string> remarks() const override { return ledger_->remarks(); }

 private:
  void draw_burnt(Frame& frame, const FrameSink& write);
  void find_end();
  BalloonLedger& ledger();

  std::unique_ptr<Membrane> membrane_;
  ObjectOutput output_;
  Inflate inflate_;
  BalloonState state_;
  BalloonState kept_;                      ///< to put back
  Drawing surface_;                        ///< of the last frame; where nothing burns, of all
  std::string ended_;                      ///< see Object::ended
  InflateStep last_;                       ///< what the last step told
  std::unique_ptr<BalloonLedger> ledger_;  ///< made with the first row, when the first frame has made the folder
};

}  // namespace world
}  // namespace pellicle
