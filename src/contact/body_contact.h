#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "contact/body_sweep.h"
#include "contact/contact_laws.h"
#include "contact/contact_surface.h"
#include "energies/potential.h"
#include "energies/vertex_potential.h"
#include "geometry/deepest_point.h"
#include "surface/surface.h"

namespace pellicle::contact {

/// Bodies that press on an elastic sheet or a balloon: a Barrier, cubic in the outermost twentieth, of the gap between
/// a body's surface, with its margin, and
///
/// - each particle, which has its fraction of the undeformed area;
/// - samples of each element (the middles of its sides and of a quad), where the body is so round that these come
///   nearer than the particles by a tenth of the thickness;
/// - each surface triangle, in the points where its face and its sides are deepest, if these are nearer than all of the
///   above. They are found at the start of a step and where Newton's method begins, and again where it has ended if a
///   triangle is then in a body by a twentieth of the thickness: Newton's method goes on then (`refresh`). It also goes
///   on where a point is that deep, and that point becomes stiffer.
///
/// A point that is nearer to a body than the thickness when undeformed presses only when it comes nearer than it was.
///
/// So no surface triangle ends deeper in a body than BodySweep::tolerance of the thickness; otherwise the step has
/// failed (BodySweep::fault). The positive Hessian leaves out the curvature of the body.
///
/// Friction is mu N s(|u|) at these points, with the slip u along the surface relative to the body over the step. As in
/// incremental potential contact (Li et al. 2020, section 5) normal force N and surface are those of the step's start,
/// and s is smooth up to the slip of `slip_speed` in a step (SmoothSlip). So contacts that friction could hold still
/// creep, slower than slip_speed. The Hessian is that of SlipTangent.
///
/// Nothing passes through a body: where Newton's method begins, triangles on their way from the start are stopped at
/// the surface, relative to the moving body, and its steps are shortened where they could lead beyond the middle of a
/// body.
class BodyContact : public Potential {
 public:
  static constexpr double onset = 0.05;  ///< of the Barrier, so short that Newton's method finds the balance at once

  /// Collective. Surface must outlive it. @throws Error as make_bodies does
  /// @param usual_stiffness [Pa/m], unless the options give one
  BodyContact(const Surface& surface, const std::map<std::string, BodyOptions>& bodies, const ContactOptions& options,
              double usual_stiffness);

  /// Sets the stiffness of the contact with bodies from the next step on [Pa/m]. Not collective.
  void set_stiffness(double stiffness) { stiffness_ = stiffness; }

  // The arguments of the three functions below are those of the functions of the same names of BodySweep.
  void set_surface(const std::vector<bool>& constrained, const std::vector<bool>* active) {
    sweep_.set_surface(constrained, active);
  }
  /// Collective. @param time_end at which forces are in balance [s] @param h length of the step until then [s]
  void begin_step(const Field& start, double time_end, double h);
  void set_time(double time_end, double h);

  const std::vector<Body>& bodies() const { return sweep_.bodies(); }
  double thickness() const { return sweep_.thickness(); }  ///< gap from which on bodies press [m]

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  PetscInt pattern_version() const override { return version_; }
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  void start_from(const Field& start, Field& x, double h) override;
  bool refresh(const Field& x) override;
  bool limits() const override { return true; }
  bool limit(const Field& x, StepLimit how, Eigen::Ref<Eigen::Matrix3Xd> step) override;

  /// The bodies in the present step.
  const BodySweep& sweep() const { return sweep_; }
  /// Applies the restitution of bodies to the velocities of particles that have come to touch a body in the step, and
  /// then to points of elements that still leave the body too slowly. Collective.
  /// @param before velocities at the beginning of the step [m/s] @param mass of the local particles [kg]
  /// @param velocity at its end [m/s]; ghosts up to date @param loads get the forces of the impacts
  void rebound(const Field& x, const Field& before, const std::vector<double>& mass, Field& velocity,
               std::vector<BodyLoad>& loads) const;
  bool rebounds() const {
    return std::any_of(bodies().begin(), bodies().end(), [](const Body& body) { return body.restitution > 0; });
  }
  /// Loads on the bodies at the end of a step. Collective.
  std::vector<BodyLoad> loads(const Field& x) const;
  /// Number of this rank's particles that bodies press on. Not collective.
  PetscInt contacts(const Field& x) const;

 private:
  /// Friction of a point on a body.
  struct Friction {
    double force = 0;  ///< mu N [N]
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    SlipTangent tangent{};
  };
  /// A particle, or a point of an element, that a body may press on in the step.
  struct Pressed {
    double stiffness = 0;  ///< [N/m]
    double nearer = 0;     ///< reduction of the thickness, see BodyContact::nearer [m]
    Friction friction;
  };
  /// A point of a drawn element that a body presses on.
  struct ElementPoint : PointWeights, Pressed {
    std::size_t body = 0;
    PetscInt element = 0;
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  };

  void find_friction();
  bool may_touch(std::size_t body, PetscInt particle, const Eigen::Vector3d& x) const;
  double nearer(std::size_t body, const Eigen::Vector3d& rest) const;
  Friction friction_of(std::size_t body, double stiffness, double nearer, const Eigen::Vector3d& start) const;
  PointPotential press(std::size_t body, const Pressed& pressed, const Eigen::Vector3d& start,
                       const Eigen::Vector3d& x) const;
  PointPotential press(const ElementPoint& point, const Field& x) const;
  template <class Take>
  void for_each_vertex(const Field& x, const Take& take) const;
  Eigen::Vector3d carried_place(const ElementPoint& point) const;
  bool counts(PetscInt element) const { return element < surface_.elements.owned; }
  ElementPoint point_of(std::size_t body, std::size_t triangle) const;
  std::vector<ElementPoint> find_points(const Field& x, bool at_start) const;
  void add_deepest(bool at_start, double below, std::size_t triangle, const std::array<Eigen::Vector3d, 3>& at,
                   const DeepestPoint& face, ElementPoint point, std::vector<ElementPoint>& points) const;
  bool add_points(const std::vector<ElementPoint>& found);

  const Surface& surface_;
  double slip_speed_;  ///< [m/s]
  BodySweep sweep_;
  double stiffness_;                         ///< [Pa/m]
  std::vector<std::vector<double>> nearer_;  ///< of each body, for the owned particles: result of nearer() [m]
  std::vector<bool> is_sampled_;             ///< for each body: whether samples can come nearer to it than particles
  std::vector<double> area_;                 ///< undeformed, round the owned particles [m^2]
  std::vector<double> element_area_;         ///< of the local elements [m^2]

  // The step.
  SmoothSlip slip_;                            ///< of the step
  std::vector<std::vector<Pressed>> pressed_;  ///< of each body, the owned particles; empty before the first step
  std::vector<ElementPoint> points_;
  std::vector<Eigen::Matrix3d> hessian_;  ///< of the owned particles [N/m]
  PetscInt version_ = 0;
  int rounds_ = 0;                  ///< how often Newton's method has gone on in the step
  double gap_curvature_share_ = 0;  ///< fraction of the bodies' curvature in the Hessian
};

}  // namespace pellicle::contact
