#pragma once

#include <array>
#include <vector>

#include "parallel/field.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {

/// m' of the local particles as a share of the initial mass, m/m^init - m^loss: the level set whose negative part has
/// burnt away (burning paper, section 6).
/// @param mass [kg], ghosts up to date, (1 x local)
/// @param loss_mass m^loss as a fraction of the initial mass
std::vector<double> level_set(const Sheet& sheet, const Field& mass, double loss_mass);

/// What has become of a spring by the levels of its ends (burning paper, section 6 and Fig. 5). A burnt one is taken
/// out when the triangles that share it are gone.
enum class SpringState { shrunk = 0, partly_burnt = 1, burnt = 2 };
SpringState spring_state(double level_0, double level_1);

/// Takes burnt and torn springs out of a sheet, without a change of its numbering.
///
/// A drawn triangle dies when all three of its points have burnt (m' < 0), the virtual centre with the lattice
/// particle's m', or when a spring that shares it tears; a spring dies when all triangles that share it are dead.
class Ablation {
 public:
  /// The sheet must outlive this object.
  explicit Ablation(const Sheet& sheet) : sheet_(sheet) {}

  /// Triangles and springs that die because of the level set. Collective.
  /// @returns whether a triangle died on any rank
  bool burn_away(Living& living, const std::vector<double>& level);

  /// Triangles and springs that die because springs tear. Collective.
  /// @param torn owned springs of each colour that tear
  /// @returns whether a triangle died on any rank
  bool tear(Living& living, const std::array<std::vector<PetscInt>, 4>& torn);

  /// Springs, and triangles of other ranks' cells, that follow from the triangles of the owned cells. Collective.
  void follow_triangles(Living& living) { spread(living, true); }

  /// Owned particles whose last spring is dead and that still have a mass. Not collective.
  std::vector<PetscInt> bare_particles(const Living& living, const Field& mass) const;

 private:
  /// Tells the other ranks which triangles of this rank's cells live, and then which of its springs.
  /// @param died whether a triangle of this rank's cells has died
  /// @returns whether one has on any rank
  bool spread(Living& living, bool died);

  const Sheet& sheet_;
};

/// Owned cells of which nothing is left: no spring of theirs but blue ones, which neighbours may share, lives. Not
/// collective.
std::vector<bool> empty_cells(const Sheet& sheet, const Living& living);

}  // namespace pellicle
