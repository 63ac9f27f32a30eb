#pragma once

#include <memory>
#include <optional>
#include <string>

#include "world/balloon_ledger.h"
#include "world/inflate.h"
#include "world/object.h"

namespace pellicle {
inline namespace world {

/// A balloon: its chain with state, frames and history. Where cracks separate its wall the vertices are split after the
/// step, unless that opens a chamber which needs a closed wall, and so ends the run.
class InflateRun : public Object {
 public:
  /// Options must outlive it. Collective. @throws Error on bad input, see Inflate
  InflateRun(Membrane membrane, const Options& options, const ObjectOutput& output);
  /// The object from a checkpoint. Collective.
  InflateRun(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output);

  const Membrane& membrane() const { return *membrane_; }

  BalloonState& state() override { return *state_; }
  StepResult begin(double h) override;
  Motion& motion() override { return *inflate_; }
  StepResult end(const EquilibriumResult& balance) override;
  const std::vector<Lip>& fresh_lips() const override { return lips_; }
  void follow_start() override { inflate_->follow_start(*state_); }
  void accept(double time) override;
  void keep() override;
  void restore() override;
  std::string ended() const override { return ended_; }
  bool is_gone() const override { return state_->burning && state_->burning->pieces.present.empty(); }
  void draw(const FrameSink& write) override;
  void record(double h, int retries) override;
  void save(Hdf5File& checkpoint) const override;
  void resume_output(const Hdf5File& checkpoint) override;
  std::vector<std::string> first_remarks() const override;
  std::vector<std::string> remarks() const override;

 private:
  StepResult result();
  void split();
  void divide();
  void draw_burnt(Frame& frame, const FrameSink& write);
  void find_end();

  const Options& options_;
  ObjectOutput output_;
  // The wall, and everything that depends on its numbering.
  std::unique_ptr<Membrane> membrane_;
  std::unique_ptr<Inflate> inflate_;
  std::unique_ptr<BalloonState> state_;
  std::unique_ptr<BalloonState> kept_;  ///< of the present wall, to be restored
  Drawing surface_;                     ///< of the last frame; where nothing burns, of all frames
  std::vector<bool> told_open_;         ///< chambers that have been reported, see newly_open
  std::string ended_;                   ///< see Object::ended
  std::vector<Lip> lips_;               ///< see Object::fresh_lips
  InflateStep last_;                    ///< results of the last step
  int factorised_steps_ = 0;            ///< of this process
  std::unique_ptr<BalloonLedger> ledger_;
};

}  // namespace world
}  // namespace pellicle
