#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "linear/ksp.h"
#include "projection/gram.h"
#include "projection/joint_gram.h"
#include "projection/line_elimination.h"
#include "projection/project_options.h"
#include "surface/active_set.h"

namespace pellicle::projection {

/// Refuses meshes on which the paper's projection may diverge: particles with more than six neighbours by springs of
/// one colour (burning paper, section 8.2), unless `project.shift` is at least 1e-3, which keeps J J^T regular. The
/// system becomes singular where springs form triangles, as yellow ones may, so that there are at least as many springs
/// as coordinates of their particles. Collective.
/// @throws Error on all ranks, which names the vertex with most neighbours, among several that with the least
/// persistent id
void require_shift_at_irregular_vertices(const Sheet& sheet, const ProjectOptions& options);

/// ||C|| of each colour and of all springs together [m], before the first step (step 0, no colour) and after each
/// colour's projection: the curves of Fig. 8.
struct ProjectionError {
  int step = 0;                     ///< full projection step, from 1
  std::optional<Colour> projected;  ///< colour just projected, none before the first step
  std::array<double, 4> colour{};
  double total = 0;
};

/// ||C|| of each colour and of all springs. Collective.
/// @param x positions, ghosts up to date [m] @param target_length of the local springs of each colour [m]
ProjectionError constraint_errors(const Sheet& sheet, const Field& x,
                                  const std::array<std::vector<double>, 4>& target_length, const ActiveSet& active);

/// Data of a projection, besides the positions.
struct ProjectionInput {
  const std::array<std::vector<double>, 4>& target_length;  ///< of the local springs of each colour, > 0 [m]
  const std::vector<double>& mass;              ///< of the local particles, 0 where one has been removed [kg]
  const std::vector<bool>& pinned;              ///< local particles that the projection must not move
  const ActiveSet& active;                      ///< springs that live, ghosts up to date
  std::function<void(Field&)> after_step = {};  ///< applied to the positions after each full step (contact), or empty
  /// Applied to the positions after the last step, or empty. Returns, alike on all ranks, whether anything has moved: a
  /// strain limit is then applied again.
  std::function<bool(Field&)> at_end = {};
  /// Receives the shortening of each owned spring by its own constraint, by colour; negative if it was lengthened [m]:
  /// (w_a + w_b) |grad C| lambda, with the inverse masses w that move its ends, summed over the projection steps.
  std::array<std::vector<double>, 4>* pull = nullptr;
};

/// Converts the shortenings of springs by a projection (ProjectionInput::pull) into the forces with the same effect in
/// a step: F = pull / (h^2 (1/m_a + 1/m_b)), with 1/m = 0 for a pinned end. Not collective.
/// @param pull of the owned springs by colour [m], becomes force [N]
void to_forces(std::array<std::vector<double>, 4>& pull, const Sheet& sheet, const ProjectionInput& input, double h);

/// Successive fast projection (burning paper, section 7.1): the four colours in turn (of a sheet of one layer the blue
/// one alone) are projected onto their target lengths by one Newton step each, until ||C|| is below the threshold or
/// all steps are used.
///
/// With the joint method each step is one Newton step of all colours together (JointGram), starting from the last
/// multipliers.
///
/// With a strain limit, springs of the weave (blue and green) with a strain beyond 0.8 of it are corrected in further
/// steps: Newton's method for J delta = C(d) - C(l (1 +- 0.8 limit)) of these springs and J delta = 0 of the others of
/// their colour, with true masses, without weights and with the least regularisation that a solve needs. The step has
/// failed if a spring stays beyond the limit.
class SuccessiveProjection {
 public:
  /// @param spring_weight factor of each local spring's weight by colour (eq. 19), or empty for 1. Collective.
  /// @throws Error if a vertex has more than six neighbours and the shift is too small
  SuccessiveProjection(const Sheet& sheet, const ProjectOptions& options,
                       std::array<std::vector<double>, 4> spring_weight = {});

  /// Moves `x` (3 x local, ghosts up to date, before and after) towards the target lengths. Collective.
  /// `error` of the result is ||C|| at the end [m].
  StageResult advance(Field& x, const ProjectionInput& input);

  /// Projects one colour by one linear solve. Collective.
  StageResult project(Field& x, Colour colour, const ProjectionInput& input);

  /// ||C|| of each colour and of all springs. Collective.
  ProjectionError errors(const Field& x, const ProjectionInput& input) const {
    return constraint_errors(sheet_, x, input.target_length, input.active);
  }

  /// The errors in the last `advance`, if the options ask for them.
  const std::vector<ProjectionError>& monitored() const { return monitored_; }

 private:
  /// One colour's system.
  struct System {
    std::unique_ptr<Gram> gram;
    std::unique_ptr<LineElimination> lines;  ///< null: the solver works on the Gram matrix
    KspHandle ksp;
    VecHandle lambda;
    VecHandle right_hand_side;
    Linearisation linearisation;
    std::vector<double> weight;  ///< of the owned springs
  };

  void begin(const ProjectionInput& input);
  double length_norm(const ActiveSet& active) const;
  /// Accuracy of the linear solves: a residual below the threshold of ||C|| is small enough.
  LinearNeed need() const { return {largest_unjudged_rtol, options_.threshold}; }
  /// @param limit if given, only springs strained beyond a fraction of it are corrected
  StageResult project_colour(Field& x, Colour colour, const ProjectionInput& input,
                             std::optional<double> limit = std::nullopt);
  StageResult project_jointly(Field& x, const ProjectionInput& input);
  StageResult limit_strain(Field& x, const ProjectionInput& input);
  void move(Field& x);
  /// Adds to ProjectionInput::pull, if it is given. @param lambda of the owned springs of a colour
  void add_pull(const ProjectionInput& input, Colour colour, const double* lambda) const;

  const Sheet& sheet_;
  ProjectOptions options_;
  std::array<System, 4> systems_;
  std::unique_ptr<JointGram> joint_;       ///< of all springs, if the options ask for it
  std::vector<Colour> colours_;            ///< colours that act, in the order of projection
  std::vector<double> joint_error_;        ///< weighted, of all springs in one solve
  std::vector<double> gram_inverse_mass_;  ///< W of J W J^T
  std::vector<double> move_inverse_mass_;  ///< W of the displacement
  Eigen::Matrix3Xd displacement_;
  std::vector<ProjectionError> monitored_;
};

}  // namespace pellicle::projection
