#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "surface/shell.h"
#include "world/burn.h"
#include "world/object.h"
#include "world/sheet_ledger.h"

namespace pellicle {
inline namespace world {

/// A burning sheet: its chain with state, frames and history. Where cracks separate a sheet without gas its corners are
/// split after the step; cells that have burnt away are removed from it now and then, see `ablation.compact_fraction`.
class BurnRun : public Object {
 public:
  /// Options must outlive it. Collective.
  /// @throws Error on bad textures and other input, or when adaptive steps are asked for
  BurnRun(Sheet sheet, const Options& options, const ObjectOutput& output);
  /// The object from a checkpoint. Collective.
  BurnRun(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output);

  const Sheet& sheet() const { return *sheet_; }

  State& state() override { return *state_; }
  StepResult begin(double h) override;
  Motion& motion() override { return *burn_; }
  StepResult end(const EquilibriumResult& balance) override;
  void spread(const std::vector<double>& load) override;
  const std::vector<Lip>& fresh_lips() const override { return lips_; }
  void follow_start() override { burn_->follow_start(*state_); }
  void accept(double time) override;
  void keep() override;
  void restore() override;
  std::string ended() const override { return ended_; }
  bool is_gone() const override { return state_->pieces.present.empty(); }
  void draw(const FrameSink& write) override;
  void record(double h, int retries) override;
  std::vector<std::string> first_remarks() const override;
  std::vector<std::string> remarks() const override;
  void save(Hdf5File& checkpoint) const override;
  void resume_output(const Hdf5File& checkpoint) override;

 private:
  StepResult result();
  void split();
  void compact();
  void divide();
  void take_over(LoadedSheet loaded);
  void find_end();

  const Options& options_;
  ObjectOutput output_;
  // The sheet, and everything that depends on its numbering.
  std::unique_ptr<Sheet> sheet_;
  std::unique_ptr<Burn> burn_;
  std::unique_ptr<State> state_;
  std::vector<bool> told_open_;  ///< chambers that have been reported, see newly_open
  std::string ended_;            ///< see Object::ended
  std::vector<Lip> lips_;        ///< see Object::fresh_lips
  BurnStep last_;                ///< results of the last step
  std::unique_ptr<State> kept_;  ///< of the present sheet, to be restored
  std::unique_ptr<SheetLedger> ledger_;
};

}  // namespace world
}  // namespace pellicle
