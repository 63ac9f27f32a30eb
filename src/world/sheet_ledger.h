#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "io/history.h"
#include "surface/net_strain.h"
#include "world/burn.h"
#include "world/ledger.h"

namespace pellicle {
inline namespace world {

/// The history of a sheet: that of every object, and with `project.monitor` the curves of Fig. 8 in projection.csv.
class SheetLedger {
 public:
  /// Touches no file; options must outlive it. @throws Error, the same on all ranks, if two columns have the same name
  SheetLedger(const ObjectOutput& output, const Options& options, const Chambers& chambers);
  /// Goes on with the tables of the run that has written a checkpoint, in its folder. Collective. @throws Error
  void resume(const Hdf5File& checkpoint);

  /// Notes in a checkpoint how long the tables are. Collective. @throws Error, on all ranks
  void save(Hdf5File& checkpoint) const;

  /// @param burn whose last step was `step`
  /// @param h length of the step [s]
  /// @param retries how often it was tried again. Collective.
  void add(const Sheet& sheet, const State& state, const Burn& burn, const BurnStep& step, double h, int retries);

  /// A row of pieces.csv for each piece. Collective.
  /// @param masses of the present pieces [kg]
  void add(double time, int step, const Pieces& pieces, const std::vector<double>& masses) {
    ledger_.add_pieces(time, step, pieces, masses);
  }

  /// Collective.
  void add(double time, int step, const std::vector<ProjectionError>& errors);

  /// Lines about the largest strain of the net in any step, and where and when that was (none before the first step),
  /// and about the length of cracks, if there are any.
  std::vector<std::string> remarks() const;

 private:
  /// The largest strain of the net so far.
  struct Record {
    double strain = -1;                               ///< -1: there has been no step
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [m]
    double time = 0;                                  ///< [s]
  };

  const Options& options_;
  bool contact_apart_;  ///< see ObjectOutput
  std::string group_;   ///< of the object in a checkpoint
  Ledger ledger_;
  Record record_;
  std::array<double, 2> cracks_{};  ///< sides of cells that have cracked, and their undeformed length [m]
  std::unique_ptr<History> projection_;
};

/// (d - l)/l of the owned and ghost springs of a colour, d the present and l the target length; 0 of dead ones.
std::vector<double> strains(const SpringSet& springs, const State& state, Colour colour);

}  // namespace world
}  // namespace pellicle
