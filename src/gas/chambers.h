#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gas/gas_network.h"
#include "gas/gas_options.h"
#include "gas/rims.h"
#include "geometry/projectors.h"
#include "parallel/field.h"
#include "surface/living.h"
#include "surface/symmetry_planes.h"

namespace pellicle {
inline namespace gas {

/// The gas of a chamber at a moment. What the law does not determine is 0: amount and temperature for the laws
/// relative, pressure and volume; everything except the volume for the law volume, whose pressure the solver finds.
struct GasState {
  double volume = 0;             ///< V [m^3]
  double pressure = 0;           ///< across the wall, inside minus outside [Pa]
  double pressure_slope = 0;     ///< dp/dV at constant amount [Pa/m^3]; 0 where the pressure is prescribed
  double absolute_pressure = 0;  ///< inside [Pa]
  double amount = 0;             ///< n [mol]
  double temperature = 0;        ///< T [K]
  double potential = 0;          ///< W with dW/dV = -p: what the gas and the surroundings can still do [J]
};

/// What links and walls have brought into the chambers of an object, since time 0.
struct GasExchange {
  /// Nothing yet.
  GasExchange(int chambers, int links)
      : amount(Eigen::VectorXd::Zero(chambers)),
        heat(Eigen::VectorXd::Zero(chambers)),
        open(Eigen::VectorXd::Zero(chambers)),
        leak_amount(Eigen::VectorXd::Zero(chambers)),
        leak_enthalpy(Eigen::VectorXd::Zero(chambers)),
        wall_heat(Eigen::VectorXd::Zero(chambers)),
        work(Eigen::VectorXd::Zero(chambers)),
        link_amount(Eigen::VectorXd::Zero(links)),
        link_enthalpy(Eigen::VectorXd::Zero(links)),
        first_energy(Eigen::VectorXd::Zero(chambers)),
        volume(Eigen::VectorXd::Zero(chambers)),
        inside(Eigen::VectorXd::LinSpaced(chambers, 0, chambers - 1)),
        outside(Eigen::VectorXd::Constant(chambers, -1)),
        parent(Eigen::VectorXd::Constant(chambers, -1)),
        reference_volume(Eigen::VectorXd::Zero(chambers)) {}

  Eigen::VectorXd amount;         ///< into each chamber [mol]
  Eigen::VectorXd heat;           ///< likewise, see VesselGas [mol K]
  Eigen::VectorXd open;           ///< 1: permanently, its pressure is that outside; 0: not
  Eigen::VectorXd leak_amount;    ///< out through each wall, or in through walls that it lies round [mol]
  Eigen::VectorXd leak_enthalpy;  ///< that it carried, and what moving caps of holes pushed away beyond them [J]
  Eigen::VectorXd wall_heat;      ///< that walls have given to each gas [J]
  Eigen::VectorXd work;           ///< on walls, of the gas of each chamber that links or heat join to anything [J]
  Eigen::VectorXd link_amount;    ///< through each link, in the order of their names [mol]
  Eigen::VectorXd link_enthalpy;  ///< enthalpy that the links carried [J]
  Eigen::VectorXd first_energy;   ///< of the gas in each chamber at time 0 [J]
  /// Of each chamber at the end of the last step, up to which work is counted; of one that is open at which it opened,
  /// which stands for what is left of it [m^3].
  Eigen::VectorXd volume;

  // What gas is on both sides of the wall of each chamber.
  Eigen::VectorXd inside;   ///< number of the chamber: its own, or that of which it has become a part
  Eigen::VectorXd outside;  ///< number of the chamber round it; -1: the ambient air

  // Of chambers that have been cut in two.
  Eigen::VectorXd parent;            ///< number of the chamber that each was a part of; -1: it was there at first
  Eigen::VectorXd reference_volume;  ///< V0 of each; of a part that of its parent [m^3]
  /// One chamber more, without gas: a part of another.
  void add_part(int chamber);
};

/// Properties of the walls of the chambers for their gas in a step.
struct ChamberWalls {
  Eigen::VectorXd area;                 ///< [m^2]
  Eigen::VectorXd hole_area;            ///< of the caps [m^2]
  std::vector<GasNetwork::Leak> leaks;  ///< through which gas gets out and in; its ends are chambers
  Eigen::VectorXd conductance;          ///< for heat into each chamber, of its wall and those within it [W/K]
  Eigen::VectorXd temperature;          ///< [K]
};

/// The chambers of a balloon or of a sheet: volumes enclosed by closed pieces of the surface (balloon paper, section
/// 5), or by a piece and the symmetry planes that its boundary lies in. The volume is that within the surface's
/// triangles; of a sheet of quads they join corners and lattice points, so that both layers feel the pressure.
///
/// A chamber may lie inside another one, whose gas then is round its wall. What follows from the shape of a wall refers
/// to all that it encloses, the chambers inside it included: W, and dW/dx, by which the pressure across it acts. The
/// volume V of a chamber's gas is that of its wall less those of the walls inside it.
///
/// The gas of chambers changes by what FlowingGas finds.
class Chambers {
 public:
  /// Chambers in the order of their names; a chamber without a vertex gets every piece that no other chamber names, as
  /// NAME, NAME_2, ... Collective. The surface must outlive the chambers.
  /// @param origin a point of all symmetry planes, about which volumes are taken; any point for closed pieces [m]
  /// @param projectors of the local vertices on the directions in which they may move (Constraints::projectors); asked
  /// for with symmetry planes alone
  /// @throws Error that names the chamber and the key, the same on all ranks: keys that the law lacks or does not know,
  /// a vertex that the mesh lacks, a piece in two chambers, a chamber inside none that is there, and, unless the law is
  /// pressure, a piece that is neither closed nor closed by symmetry planes, or that encloses no volume above 0
  Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin = Eigen::Vector3d::Zero(), const SymmetryPlanes& planes = {},
           const Projectors& projectors = {});

  /// Chambers of triangles that have been chosen before, whatever has happened to the surface since. Collective. The
  /// surface must outlive the chambers.
  /// @param numbers chamber of each local element, see numbers
  /// @param exchange of a state that has one, which knows of chambers that have been cut in two
  /// @throws Error on keys that the law lacks or does not know
  Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers, const GasExchange* exchange,
           const SymmetryPlanes& planes = {});

  int count() const { return static_cast<int>(chambers_.size()); }
  const Surface& surface() const { return *surface_; }
  /// Number of the chamber whose wall each local element is of, -1: none.
  const std::vector<PetscInt>& numbers() const { return chamber_of_element_; }
  const std::string& name(int chamber) const { return of(chamber).name; }
  /// Whether it was there at first; others are parts of a chamber that has been cut in two.
  bool was_there_at_first(int chamber) const { return of(chamber).parent < 0; }
  /// Chamber of a triangle of the local elements, -1 if it bounds none.
  int of_triangle(PetscInt triangle) const { return chamber_of_triangle_[triangle]; }

  /// Number of the chamber whose gas is inside the wall of a chamber: its own, or that of which it has become a part.
  int inside(int chamber) const { return static_cast<int>(exchange_.inside[chamber]); }
  /// Of the gas round it; GasNetwork::ambient.
  int outside(int chamber) const;

  /// Whether its law asks for the volume.
  bool needs_volume(int chamber) const { return of(chamber).law != GasLaw::pressure; }
  /// Whether gas flows through holes of its wall, which caps close for its volume (Rims).
  bool vents(int chamber) const { return of(chamber).options.hole_discharge.has_value(); }
  /// Whether it can have no hole.
  bool needs_closed_wall(int chamber) const { return needs_volume(chamber) && !vents(chamber); }
  /// The rims of chambers that vent.
  const Rims& rims() const { return rims_; }
  /// Says which triangles of the local elements there are: the pressure of a chamber that needs no closed wall acts on
  /// no others. Collective.
  void set_living(const Living& living);
  /// What happens to chambers that vent and whose wall has come apart. Each piece that encloses a hundredth of the
  /// chamber's volume bounds a chamber, with gas of the same state in proportion to its volume; the oldest of them
  /// continues as the old chamber, with its links. Smaller pieces bound none. The rest of the gas has leaked. A chamber
  /// inside it is inside the piece round it. Nothing if no wall has come apart. Collective.
  struct Division {
    std::vector<PetscInt> numbers;   ///< see numbers
    GasExchange exchange;            ///< of all chambers, the new ones last
    std::vector<std::string> lines;  ///< which chambers have been cut, and into what
  };
  /// @param piece of each local particle (Pieces) @param exchange between steps
  std::optional<Division> divided(const std::vector<PetscInt>& piece, const GasExchange& exchange,
                                  const Field& positions, double time) const;
  /// After a division that has left as many chambers as there were; set_living is to follow.
  void set_numbers(const std::vector<PetscInt>& numbers) { chamber_of_element_ = numbers; }
  /// Whether triangles are missing on which the given pressure of a chamber would act, or its wall has cracked. Then V
  /// is no volume, and dV/dx, by which the pressure acts, is not its gradient.
  bool has_hole(int chamber) const { return has_hole_[chamber] != 0; }

  /// V0, from the undeformed positions, the same on every rank [m^3].
  double initial_volume(int chamber) const { return of(chamber).initial_volume; }
  /// W of all chambers (eq. 13), summed over the ranks [m^3]. Collective.
  /// @param positions [m], ghosts up to date
  Eigen::VectorXd volumes(const Field& positions) const;
  /// V of all chambers: W less what walls inside them enclose. @param walls W [m^3]
  Eigen::VectorXd gas_volumes(const Eigen::VectorXd& walls) const;
  /// W of all chambers at the end of the last step; of one that is open at which it opened [m^3].
  Eigen::VectorXd last_volumes() const;
  /// Forces of the weights of gas and air, and of jets through holes, on walls, in addition to even pressures. The
  /// pressure at x is (rho - rho_outside) g.(x - x_0), with the middle x_0 of the wall; its sum is minus the lift, (rho
  /// - rho_outside) V g. Jets push the rims (jet_thrust), except for the part that the pressure on a wall with holes
  /// contributes already. Of the owned particles (3 x owned) [N]. Collective.
  /// @param gravity g [m/s^2]; 0: gas and air weigh nothing
  Eigen::Matrix3Xd uneven_forces(const Field& positions, const Eigen::Vector3d& gravity, double time) const;
  /// dW/dx = A n / 3 (eq. 15 without p) by the owned particles, a column a chamber, (3 owned x count) [m^2].
  Eigen::SparseMatrix<double> volume_gradients(const Field& positions) const;
  /// Of one chamber, (3 x owned) [m^2].
  Eigen::Matrix3Xd volume_gradient(int chamber, const Field& positions) const;

  /// The gas by its law at a volume V [m^3] and time [s], with what has come in by the beginning of the step, and its
  /// pressure against that of the ambient air. Not finite where the law needs a volume above 0 and there is none.
  GasState state(int chamber, double volume, double time) const;
  /// The same of all chambers, with the pressures across their walls. What has become a part of another is empty.
  /// @param walls W [m^3]
  std::vector<GasState> states(const Eigen::VectorXd& walls, double time) const;
  /// Makes of pressures against the ambient air, of the states of all chambers, those across their walls.
  void put_across_walls(std::vector<GasState>& states) const;
  const GasOptions& gas_options() const { return gas_; }

  // Chambers whose gas changes: links, holes, leaks or heat join it to something, or it lies inside another or round
  // one. Their laws are isothermal or adiabatic. Those that have not become a part of another are vessels of a network.

  bool has_network() const { return !joined_.empty(); }
  /// Ascending.
  const std::vector<int>& joined() const { return joined_; }
  bool is_joined(int chamber) const { return vessel_of_[chamber] >= 0; }
  /// Chamber of each vessel, ascending.
  const std::vector<int>& vessels() const { return vessels_; }
  /// Number of the vessel whose gas is inside a joined chamber's wall.
  int vessel_of(int chamber) const { return vessel_of_[chamber]; }
  /// Of the gas round its wall; GasNetwork::ambient.
  int vessel_outside(int chamber) const {
    return outside(chamber) < 0 ? GasNetwork::ambient : vessel_of(outside(chamber));
  }
  GasNetwork::Vessel vessel(int number) const;
  /// c_v of a mole of a joined chamber's gas [J/(mol K)].
  double heat_capacity(int chamber) const { return gas_constant / (of(chamber).gamma - 1); }
  /// Permanently open: its pressure is that outside.
  bool is_open(int chamber) const { return is_open(exchange_, chamber); }

  /// A link with an end in one of these chambers, or between them.
  struct Link {
    std::string name;
    int from = GasNetwork::ambient;  ///< number of a chamber
    int to = GasNetwork::ambient;
    LinkOptions options;
  };
  static constexpr int elsewhere = -2;  ///< an end in a chamber of another object, which the options name
  const std::vector<Link>& links() const { return links_; }
  bool has_links_elsewhere() const {
    return std::any_of(links_.begin(), links_.end(),
                       [](const Link& link) { return link.from == elsewhere || link.to == elsewhere; });
  }

  /// From here on gas is that of a step that begins with what has come in so far; h = 0: of the moment between steps.
  /// @param h length of the step [s]
  /// @param walls then
  void begin_step(const GasExchange& exchange, double h, const ChamberWalls& walls = {});
  /// The step that has begun is of another length [s].
  void set_step_length(double h) { h_ = h; }
  /// The walls at positions, with the temperatures that the options give. Collective.
  /// @param gravity as of uneven_forces: the pressure at a hole is that at its height
  ChamberWalls walls(const Field& positions, const Eigen::Vector3d& gravity, double time) const;
  double heat_transfer(int chamber) const { return of(chamber).options.heat_transfer; }  ///< [W/(m^2 K)]
  /// What is known of the step of the vessels, of these chambers alone. @param walls W at its end [m^3]
  GasNetwork::Step network_step(const Eigen::VectorXd& walls, double time) const;
  /// What has come in at the end of the step. A chamber is open from here on if its holes are larger than a tenth of
  /// what is left of its wall and its pressure has come within a hundred thousandth of that outside, or if they are
  /// larger than it. One inside another then becomes a part of it instead.
  /// @param walls W then [m^3] @param caps of its change, what the caps of holes have swept [m^3]
  /// @param step see network_step @param end how it ends, with the flows of `links`
  GasExchange end_step(const Eigen::VectorXd& walls, const Eigen::VectorXd& caps, const GasNetwork::Step& step,
                       const GasNetwork::End& end) const;

  /// Which balance of a joined chamber does not close to 1e-10 of what goes in and out, in words; empty if all close.
  /// Amounts must change by what links and holes have carried, energies by that and by work and heat of the wall. A
  /// chamber is checked together with what has been cut off it and what it has become a part of. For chambers that keep
  /// their temperature only amounts are checked. @param walls W [m^3]
  std::string imbalance(const Eigen::VectorXd& walls, double time) const;
  /// What has come in at time 0: nothing. @param walls W then [m^3]
  GasExchange first_exchange(const Eigen::VectorXd& walls) const;
  /// Caps move at once where holes grow or join, and volumes with them: finds what has come in if the gas keeps its
  /// state; gas that is on the other side of the wall now has leaked. @param walls W at the same positions [m^3]
  GasExchange recapped(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const;

  /// Whether the volume is given and the pressure is what keeps it.
  bool prescribes_volume(int chamber) const { return of(chamber).law == GasLaw::volume; }
  /// Only where prescribes_volume. [m^3]
  double prescribed_volume(int chamber, double time) const;

 private:
  struct Chamber {
    std::string name;
    GasLaw law = GasLaw::relative;
    ChamberOptions options;     ///< what the law needs is not empty
    double initial_volume = 0;  ///< V0 [m^3]
    double unit_amount = 1;     ///< what a value of the key points `amount` stands for [mol]
    double gamma = 1;           ///< of the laws isothermal and adiabatic
    int parent = -1;            ///< see GasExchange
  };
  /// The gas of a chamber when gas is moved at constant temperatures.
  struct Content {
    double amount = 0;  ///< [mol]
    double heat = 0;    ///< n T [mol K]
  };

  void add(const std::string& name, const ChamberOptions& options);
  void begin();
  void nest();
  std::vector<int> from_within() const;
  void require_inside(int chamber) const;
  void find_particles();
  Content content(const GasExchange& exchange, int chamber, double time) const;
  void fill(GasExchange& exchange, int number, int like, const Content& gas, double volume) const;
  static void pass_out(GasExchange& exchange, std::vector<Content>& contents, int chamber, const Content& gas,
                       double heat_capacity);
  Eigen::VectorXd volumes(const Field& positions, const std::vector<int>& chamber_of_triangle, const Rims& rims,
                          int count) const;
  Eigen::VectorXd windings(int chamber, const Field& positions, const std::vector<int>& number_of_triangle,
                           int count) const;
  void set_amounts();
  void join();
  void find_vessels();
  void become_part(GasExchange& exchange, int chamber, double time) const;
  double pressure_round(int chamber, const GasNetwork::End& end) const;
  int number_of(const std::string& name, const std::string& key, const std::string& others) const;
  /// A pressure that changes with the place, beside the mean on a chamber's wall.
  struct UnevenPressure {
    Eigen::Vector3d slope;   ///< [Pa/m]
    Eigen::Vector3d middle;  ///< where it is 0 [m]

    double at(const Eigen::Vector3d& place) const { return slope.dot(place - middle); }
  };
  std::vector<UnevenPressure> uneven_pressures(const Field& positions, const Eigen::Vector3d& gravity,
                                               double time) const;
  Eigen::VectorXd areas(const Field& positions) const;
  static bool is_open(const GasExchange& exchange, int chamber) { return exchange.open[chamber] != 0; }
  /// In a joined chamber at time 0 [mol].
  double first_amount(int chamber) const { return of(chamber).unit_amount * of(chamber).options.amount.front()[1]; }
  /// Of the gas in a joined chamber [J]; 0 of others.
  double energy(int chamber, const GasState& gas) const {
    return is_joined(chamber) ? heat_capacity(chamber) * gas.amount * gas.temperature : 0;
  }
  PetscInt owned_triangles() const { return surface_->triangles_per_element * surface_->elements.owned; }
  const Chamber& of(int chamber) const { return chambers_[chamber]; }
  void require_closed(int chamber, const Field& rest, const Projectors& projectors) const;

  const Surface* surface_;
  GasOptions gas_;
  Eigen::Vector3d origin_;
  SymmetryPlanes planes_;
  std::vector<Chamber> chambers_;
  std::vector<PetscInt> chamber_of_element_;  ///< of each local element, -1: none
  std::vector<int> chamber_of_triangle_;      ///< of what is left of their triangles, -1: none
  /// See volume_gradients, without values: three rows for each owned particle by which a chamber's volume changes.
  Eigen::SparseMatrix<double> no_gradients_;
  /// Which of these threes of entries each corner of the triangles has, -1: it is a ghost's, or bounds no chamber.
  std::vector<PetscInt> place_of_corner_;
  Rims rims_;                  ///< of chambers that vent
  std::vector<int> has_hole_;  ///< of each chamber
  std::vector<Link> links_;
  std::vector<int> joined_;
  std::vector<int> vessels_;
  std::vector<int> vessel_of_;  ///< of each chamber, -1: it is not joined
  GasExchange exchange_{0, 0};  ///< by the beginning of the step
  ChamberWalls walls_;          ///< then
  double h_ = 0;                ///< of the step [s]
};

}  // namespace gas
}  // namespace pellicle
