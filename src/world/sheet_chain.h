#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/chain.h"

namespace pellicle {
inline namespace world {

/// The chain of the burning paper: a sheet of quads heats, burns, shrinks and is cut, moves and cracks; it may enclose
/// gas. Elements that have burnt away are removed from it now and then, see `ablation.compact_fraction`.
class SheetChain : public Chain {
 public:
  explicit SheetChain(const Options& options) : options_(options) {}

  std::vector<std::string> clock_names() const override;
  std::string renumbering() const override { return "compaction"; }
  std::string words_of_end() const override { return "the sheet has burnt away"; }
  std::vector<std::string> lines(const Surface& surface) const override;
  std::shared_ptr<const Surface> make_surface(MPI_Comm comm, MeshRows rows) const override;
  std::string group() const override { return "sheet"; }
  std::shared_ptr<const Surface> read_surface(const Hdf5File& checkpoint, const std::string& group) const override;
  void write_surface(Hdf5File& checkpoint, const std::string& group, const Surface& surface) const override;
  std::vector<PetscInt> element_ids(const Surface& surface) const override;
  MovedSurface split(const Surface& surface, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements) const override;
  std::optional<MovedSurface> compact(const Surface& surface, const State& state) const override;
  std::optional<MovedSurface> spread(const Surface& surface, const State& state,
                                     const std::vector<double>& load) const override;
  std::unique_ptr<State> make_state(const Surface& surface, int chambers) const override;
  std::unique_ptr<State> initial_state(const Surface& surface) const override;
  Stages make_stages(const Surface& surface, State& state, StageClock& clock, Textures& textures) const override;

 private:
  const Options& options_;
};

}  // namespace world
}  // namespace pellicle
