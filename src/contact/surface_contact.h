#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "contact/contact_laws.h"
#include "contact/contact_pairs.h"
#include "contact/contact_surface.h"
#include "energies/potential.h"

namespace pellicle::contact {

/// State of the contact between drawn surfaces, for output.
struct ContactFigures {
  PetscInt contacts = 0;    ///< pairs of features that press on each other
  double smallest_gap = 0;  ///< of the contacts; the thickness if there are none [m]
  double energy = 0;        ///< of the barriers [J]
  int searches = 0;         ///< searches for pairs in the last step
  double room_used = 0;     ///< in the last step: largest fraction of two features' clearance, at most 1
};

/// Work that contact does on a part in a step.
struct ContactWork {
  double pressing = 0;  ///< [J]
  double friction = 0;  ///< below 0 where friction brakes [J]
};

/// Contact of drawn surfaces with themselves and with each other: a Barrier, cubic and steep at its end, of the
/// distance between every point and triangle, and every two edges, that have no common point, with Coulomb friction.
///
/// Nothing passes through anything, whatever the forces: a pair of features is kept apart by the plane half way between
/// their nearest points, along whose normal their points come nearer to each other by at most 0.9 of the distance.
/// Where a step would take them further, each of these points goes a part of its way (much as "divide and truncate",
/// Chen et al. 2025), and a sheet's lattice points, which are not drawn, are constrained back with their cells'
/// corners. Pairs are sought within the expected movement of the particles, and again where a step of Newton's method
/// leaves that range, or where a pair has used up its clearance.
///
/// Friction is mu N s(|u|), with the slip u since the step's start; the normal force N, the normal and the places of
/// contact are those of the step's start, and s is smooth up to the slip of `slip_speed` in a step (SmoothSlip). The
/// Hessian of friction is that of SlipTangent.
class SurfaceContact : public Potential {
 public:
  /// The parts must outlive this object. Positions are on the joined layout of the parts (JoinedLayout); if there is
  /// one part, on its layout. Collective.
  /// @param is_free whether all particles may move alike because none is constrained
  SurfaceContact(const std::vector<ContactSurface::Part>& parts, const ContactOptions& options, bool is_free);
  SurfaceContact(const SurfaceContact&) = delete;  // Its mesh points to its surface.
  SurfaceContact& operator=(const SurfaceContact&) = delete;

  /// Sets the stiffness of a part's contact with itself from the next step on [Pa/m]. Not collective.
  void set_stiffness(double stiffness, std::size_t part = 0) { surface_.set_stiffness(part, stiffness); }
  /// Sets which particles of a part are constrained and which triangles live from the next step on. Not collective.
  /// @param constrained local particles that stay or whose motion is given
  /// @param active surface triangles that are active; null: all
  void set_surface(const std::vector<bool>& constrained, const std::vector<bool>* active, std::size_t part = 0);
  const JoinedLayout& joined() const { return surface_.joined(); }

  void start_from(const Field& start, Field& x, double h) override;
  void update_pattern(const Field& x) override;
  bool limits() const override { return true; }
  bool limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) override;

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override { return pattern_; }
  PetscInt pattern_version() const override { return version_; }
  /// Takes the Hessian at the last `update_pattern` of Newton's method. The positive Hessian leaves out the curvature
  /// of gaps.
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;

  /// Moves features apart, each sweep as far as there is clearance, until the nearest are at nine tenths of the gap at
  /// which they begin to press, or 100 sweeps are over. In a sweep gaps that are less than their thickness are
  /// compliant constraints of stiffness 4 k between particles of the mass 1, all at once. Collective.
  /// @param x positions, ghosts up to date before and after; constrained particles stay
  void push_apart(Field& x);

  /// Figures of contact at the end of a step. Collective.
  ContactFigures figures(const Field& x) const;
  /// Whether features have touched in the step on any rank, so that contact may let them pass through each other
  /// (renew_contact_pairs). Collective.
  bool anything_touched() const;
  /// Work on each part of the forces at the end of a step over the displacements of the step. Collective.
  std::vector<ContactWork> work(const Field& x) const;
  /// Amount of work for each of a part's owned particles in the last step: each pair that the first search found counts
  /// a half at one particle of either feature; 0 on a single rank. Not collective.
  std::vector<double> load(std::size_t part = 0) const;
  /// Share of the thickness that is the least gap of a pair at a step's start: nearer features count as touching.
  static constexpr double least_gap = 1e-6;
  /// Gap at which two surfaces begin to press [m].
  double thickness() const { return surface_.largest_thickness(); }

 private:
  /// Particles and weights whose sum is the vector between two features.
  struct Stencil {
    std::array<PetscInt, 16> particles;  ///< in reach
    std::array<double, 16> weights;      ///< none of them 0
    std::size_t count = 0;
    void add(PetscInt particle, double weight);
    /// The place of a particle, or `count`.
    std::size_t find(PetscInt particle) const {
      return std::find(particles.begin(), particles.begin() + count, particle) - particles.begin();
    }
    /// Adds the effect of a force between two features on their particles (3 x owned).
    void spread(const Eigen::Vector3d& force, Eigen::Matrix3Xd& sum) const;
  };
  /// A pair that presses.
  struct Contact {
    const ContactPair* pair;
    Stencil stencil;         ///< of the vector between the nearest points
    double gap;              ///< length of that vector [m]
    Eigen::Vector3d normal;  ///< towards the first feature; 0 where there is no gap
  };
  /// A contact with friction in a step.
  struct Rubbing {
    Stencil stencil;  ///< in the present reach
    Stencil global;   ///< the same with global numbers
    Eigen::Vector3d normal;
    Eigen::Vector3d start;  ///< the weighted sum at the step's start [m]
    double force = 0;       ///< largest force of friction [N]
    bool counts = false;    ///< whether this rank adds the contact to sums over all ranks
    SlipTangent tangent{};
  };

  void prepare(const Field& start, const Field& begin, const Field& to, double h);
  void search(const Field& x, const Field& to);
  bool leaves_room(const Field& x) const;
  double room_used(const Field& x) const;
  void shorten(const std::vector<double>& shares, Eigen::Ref<Eigen::Matrix3Xd> step);
  double add_pressing(const Field& x, Eigen::Matrix3Xd& gradient) const;
  void add_friction(Eigen::Matrix3Xd& gradient) const;
  const std::vector<Contact>& pressing(const Field& x) const;
  void note_rubbing(const Field& x);
  double friction_energy() const;
  void add_places(const Stencil& stencil, std::vector<std::size_t>& places);
  Stencil stencil(const ContactPair& pair, const std::array<double, 4>& weights) const;
  /// Lower triangle of a symmetric matrix of 3 x 3 blocks between the particles of a stencil.
  using LowerBlocks = std::array<Eigen::Matrix3d, 16 * 17 / 2>;
  void add_curvature(const Contact& contact, LowerBlocks& lower) const;
  bool counts(const ContactPair& pair) const;
  Eigen::Vector3d slip_of(const Rubbing& rubbing) const;

  ContactSurface surface_;
  ContactOptions options_;
  bool is_free_;
  ContactMesh mesh_;
  std::vector<bool> constrained_;    ///< of the local particles
  Field start_;                      ///< of the step
  mutable Eigen::Matrix3Xd places_;  ///< places of the mesh's points, as last computed
  std::vector<Rubbing> rubbing_;

  // Data of the last search for pairs.
  Field origin_;      ///< places of the particles
  Field low_, high_;  ///< bounds of the displacements from there for which pairs are known, component by component
  Eigen::Matrix3Xd reference_;     ///< places of the mesh's points when distances were last measured [m]
  std::vector<ContactPair> near_;  ///< all pairs that were found
  std::ptrdiff_t may_press_ = 0;   ///< number of those that may press; they come first
  Field trial_;                    ///< scratch: positions to be tried, or their correction
  bool any_touched_ = false;       ///< whether features have touched in the step, on this rank
  bool any_held_ = false;          ///< a particle was constrained back since the search, on any rank
  std::vector<double> load_;       ///< of the owned particles, as `load` returns it
  int searches_ = 0;
  double room_used_ = 0;  ///< ContactFigures::room_used before the last search, on this rank

  // The contacts at the positions for which they were last computed.
  mutable std::vector<Contact> pressing_;
  mutable Eigen::Matrix3Xd pressing_at_;  ///< places of the mesh's points
  mutable bool is_pressing_known_ = false;

  // The contacts at the present iterate of Newton's method.
  std::vector<Contact> curved_;
  std::vector<std::size_t> places_of_curved_;   ///< from add_places, one contact after the other
  std::vector<std::size_t> places_of_rubbing_;  ///< of the stencils of the step's friction, one after the other
  Eigen::Matrix3Xd curved_at_;                  ///< places of the mesh's points for the exact Hessian
  double kept_curvature_ = 0;                   ///< fraction of the curvature of gaps in the second derivative
  /// Pairs (i, j) and (j, i), one after the other. Pairs of past contacts stay, which costs less than a new pattern.
  std::vector<VertexPair> pattern_;
  std::unordered_map<std::uint64_t, std::size_t> number_;  ///< in pattern_, by the global numbers of i < j
  std::size_t told_ = 0;                                   ///< size of the pattern when it last got a version
  PetscInt version_ = 0;
  SmoothSlip slip_;  ///< of the step
};

}  // namespace pellicle::contact
