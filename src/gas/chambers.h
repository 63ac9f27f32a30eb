#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gas/gas_exchange.h"
#include "gas/gas_network.h"
#include "gas/gas_options.h"
#include "gas/rims.h"
#include "geometry/projectors.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::gas {

/// The gas of a chamber at a moment. Quantities that the law does not determine are 0: amount and temperature for the
/// laws relative, pressure and volume; all except the volume for the law volume, whose pressure the solver finds.
struct GasState {
  double volume = 0;             ///< V [m^3]
  double pressure = 0;           ///< across the wall, inside minus outside [Pa]
  double pressure_slope = 0;     ///< dp/dV at constant amount [Pa/m^3]; 0 where the pressure is prescribed
  double absolute_pressure = 0;  ///< inside [Pa]
  double amount = 0;             ///< n [mol]
  double temperature = 0;        ///< T [K]
  double potential = 0;          ///< W with dW/dV = -p: energy of the gas and the surroundings [J]
};

/// The chambers of a balloon or of a sheet: volumes enclosed by closed pieces of the surface (balloon paper, section
/// 5), or by a piece and the symmetry planes that its boundary lies in. The volume is that within the surface's
/// triangles; of a sheet of quads they join corners and lattice points, so that both layers feel the pressure.
///
/// A chamber may lie inside another one, whose gas then is round its wall. The volume W that a wall encloses, and
/// dW/dx, by which the pressure across the wall acts, include the chambers inside it. The volume V of a chamber's gas
/// is W of its wall less W of the walls inside it.
///
/// Exchanged gas is not stored here: the functions take the GasExchange of the object's state, which FlowingGas
/// computes.
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
  /// @param numbers chamber of each local element, -1: none
  /// @param exchange that of the state, with the chambers that have been cut in two; null: the initial one
  /// @throws Error on keys that the law lacks or does not know
  Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers, const GasExchange* exchange,
           const SymmetryPlanes& planes = {});

  int count() const { return static_cast<int>(chambers_.size()); }
  const Surface& surface() const { return *surface_; }
  /// Number of the chamber to whose wall each local element belongs, -1: none.
  const std::vector<PetscInt>& numbers() const { return chamber_of_element_; }
  const std::string& name(int chamber) const { return of(chamber).name; }
  /// Whether a chamber is one of the initial ones; others are parts of a chamber that has been cut in two.
  bool was_there_at_first(int chamber) const { return of(chamber).parent < 0; }
  /// Chamber of a triangle of the local elements, -1 if it bounds none.
  int of_triangle(PetscInt triangle) const { return chamber_of_triangle_[triangle]; }

  /// The exchange at time 0, with the nesting of the walls and no exchanged gas; valid at all times if no chamber is
  /// joined.
  const GasExchange& initial_exchange() const { return initial_exchange_; }

  /// Whether a chamber's law depends on the volume.
  bool needs_volume(int chamber) const { return of(chamber).options.law != GasLaw::pressure; }
  /// Whether gas flows through holes of a chamber's wall; caps close them for the volume (Rims).
  bool vents(int chamber) const { return of(chamber).options.hole_discharge.has_value(); }
  /// Whether a chamber may not have holes.
  bool needs_closed_wall(int chamber) const { return needs_volume(chamber) && !vents(chamber); }
  /// The rims of chambers that vent.
  const Rims& rims() const { return rims_; }
  /// Sets which triangles of the local elements live: the pressure of a chamber that may have holes acts on no others.
  /// Collective.
  void set_active(const ActiveSet& active);
  /// Division of chambers that vent and whose wall has come apart. Each piece that encloses a hundredth of the
  /// chamber's volume bounds a chamber, with gas of the same state in proportion to its volume; the oldest of them
  /// continues as the old chamber, with its links. Smaller pieces bound none. The rest of the gas has leaked. A chamber
  /// inside the old one is inside the piece round it.
  struct Division {
    std::vector<PetscInt> numbers;   ///< chamber of each local element, for set_numbers
    GasExchange exchange;            ///< of all chambers, the new ones last
    std::vector<std::string> lines;  ///< messages: which chambers have been cut, and into which
  };
  /// None if no wall has come apart. Collective. @param piece of each local particle (Pieces)
  std::optional<Division> divided(const std::vector<PetscInt>& piece, const GasExchange& exchange,
                                  const Field& positions, double time) const;
  /// Sets the chamber of each element after a division without new chambers; call set_active afterwards.
  void set_numbers(const std::vector<PetscInt>& numbers) { chamber_of_element_ = numbers; }
  /// Whether triangles are missing on which the given pressure of a chamber would act, or its wall has cracked. Then V
  /// is no volume, and dV/dx, by which the pressure acts, is not its gradient.
  bool has_hole(int chamber) const { return has_hole_[chamber] != 0; }

  /// V0, from the undeformed positions, the same on every rank [m^3].
  double initial_volume(int chamber) const { return of(chamber).initial_volume; }
  /// W of all chambers (eq. 13), summed over the ranks [m^3]. Collective.
  /// @param positions [m], ghosts up to date
  Eigen::VectorXd volumes(const Field& positions) const {
    return volumes(positions, chamber_of_triangle_, rims_, count());
  }
  /// Forces on walls by the weights of gas and air and by jets, in addition to even pressures (3 x owned) [N]. The
  /// pressure at x is (rho - rho_outside) g.(x - x_0), with the middle x_0 of the wall; its sum is minus the lift, (rho
  /// - rho_outside) V g. Jets push the rims (jet_thrust), except for the part that the pressure on a wall with holes
  ///   contributes already. Collective.
  /// @param gravity g [m/s^2]; 0: gas and air weigh nothing
  Eigen::Matrix3Xd uneven_forces(const GasExchange& exchange, const Field& positions, const Eigen::Vector3d& gravity,
                                 double time) const;
  /// dW/dx = A n / 3 (eq. 15 without p) by the owned particles, a column a chamber, (3 owned x count) [m^2].
  /// @param only the chamber besides which all columns are 0; -1: there is none
  Eigen::SparseMatrix<double> volume_gradients(const Field& positions, int only = -1) const;
  /// dW/dx of one chamber (3 x owned) [m^2].
  Eigen::Matrix3Xd volume_gradient(int chamber, const Field& positions) const;

  /// Gas of a chamber by its law at a volume V [m^3] and time [s], with the exchange at the beginning of the step; its
  /// pressure is that against the ambient air. Not finite where the law needs a volume above 0 and V is not.
  GasState state(const GasExchange& exchange, int chamber, double volume, double time) const;
  /// The gas of a chamber without exchanged gas.
  GasState state(int chamber, double volume, double time) const {
    return state(initial_exchange_, chamber, volume, time);
  }
  /// The gas of all chambers, with the pressures across walls; parts of others are empty. @param walls W [m^3]
  std::vector<GasState> states(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const;
  /// Like `states`, with the pressures against the ambient air. @param walls W [m^3]
  std::vector<GasState> states_against_ambient(const GasExchange& exchange, const Eigen::VectorXd& walls,
                                               double time) const;
  /// Turns the pressures of all chambers' states from those against the ambient air to those across walls.
  static void put_across_walls(const GasExchange& exchange, std::vector<GasState>& states);
  const GasOptions& gas_options() const { return gas_; }

  // Joined chambers exchange gas or heat, by links, holes, leaks or heat transfer, or lie inside or round others. Their
  // laws are isothermal or adiabatic. Those that have not become parts of others are vessels of a network.

  /// Numbers of the joined chambers, ascending.
  const std::vector<int>& joined() const { return joined_; }
  bool is_joined(int chamber) const { return is_joined_[chamber]; }
  /// The joined chambers that are vessels of a network, which may have those of other objects, too.
  struct Vessels {
    std::vector<int> chambers;  ///< of each vessel, ascending
    /// Number in the network of the vessel with the gas inside the wall of each chamber; -1: none, it is not joined.
    std::vector<int> of_chamber;

    /// Number of the vessel with the gas of a chamber. @param chamber below 0: GasNetwork::ambient
    int number(int chamber) const { return chamber < 0 ? GasNetwork::ambient : of_chamber[chamber]; }
  };
  /// @param first number in the network of the first vessel
  Vessels vessels(const GasExchange& exchange, int first = 0) const;
  GasNetwork::Vessel vessel(int chamber) const {
    return {of(chamber).options.law == GasLaw::isothermal, of(chamber).gamma, of(chamber).initial_volume};
  }
  /// c_v of a mole of a joined chamber's gas [J/(mol K)].
  double heat_capacity(int chamber) const { return gas_constant / (of(chamber).gamma - 1); }

  /// A link with one or both ends in these chambers: numbers of chambers, ambient or elsewhere.
  using Link = GasNetwork::Link;
  static constexpr int elsewhere = -2;  ///< end of a link in a chamber of another object, which the options name
  const std::vector<Link>& links() const { return links_; }
  bool has_links_elsewhere() const {
    return std::any_of(links_.begin(), links_.end(),
                       [](const Link& link) { return link.from == elsewhere || link.to == elsewhere; });
  }

  /// Properties of the walls for the gas at given positions, with the temperatures of the options. Collective.
  /// @param gravity [m/s^2], as for uneven_forces: the pressure at a hole is that at its height
  ChamberWalls walls(const GasExchange& exchange, const Field& positions, const Eigen::Vector3d& gravity,
                     double time) const;
  double heat_transfer(int chamber) const { return of(chamber).options.heat_transfer; }  ///< [W/(m^2 K)]
  /// Adds the data of these chambers to those of a network's step. @param walls W at its end [m^3]
  void add_to_step(GasNetwork::Step& step, const GasStep& start, const Vessels& vessels, const Eigen::VectorXd& walls,
                   double time) const;
  /// The exchange at the end of the step. A chamber becomes open if its holes are larger than a tenth of its remaining
  /// wall and its pressure is within a hundred thousandth of that outside, or if its holes are larger than the wall; if
  /// it is inside another, it becomes a part of that one instead.
  /// @param links number in the network of each of `links`; -1: nothing flows
  /// @param walls W at the end [m^3] @param caps part of the change of W that the caps of holes have swept [m^3]
  /// @param time at the end [s] @param end of the network
  GasExchange end_step(const GasStep& start, const Vessels& vessels, const std::vector<int>& links,
                       const Eigen::VectorXd& walls, const Eigen::VectorXd& caps, double time,
                       const GasNetwork::End& end) const;

  /// Message that names a balance of a joined chamber that does not close to 1e-10 of its terms; empty if all close.
  /// Amounts must change by the flows through links and holes, energies by their enthalpy and by work and heat of the
  /// wall. A chamber is checked together with those cut off it and the one of which it is a part. For chambers that
  /// keep their temperature only amounts are checked. @param walls W [m^3]
  std::string imbalance(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const;
  /// The exchange at time 0, without exchanged gas. @param walls W at time 0 [m^3]
  GasExchange first_exchange(const Eigen::VectorXd& walls) const;
  /// The exchange after caps have jumped because holes have grown or joined: the gas keeps its state, and gas that is
  /// on the other side of the wall now has leaked. @param walls W at the same positions [m^3]
  GasExchange recapped(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const;

  /// Whether a chamber's volume is prescribed, so that the pressure is a Lagrange multiplier.
  bool prescribes_volume(int chamber) const { return of(chamber).options.law == GasLaw::volume; }
  /// The volume of a chamber that prescribes_volume [m^3].
  double prescribed_volume(int chamber, double time) const;

 private:
  struct Chamber {
    std::string name;
    ChamberOptions options;     ///< with defaults for what the law needs
    double initial_volume = 0;  ///< V0 [m^3]
    double unit_amount = 1;     ///< unit of the key points `amount` [mol]
    double gamma = 1;           ///< of the laws isothermal and adiabatic
    int parent = -1;            ///< as in GasExchange

    /// Whether the law is one by which the chamber has an amount of gas.
    bool has_amount() const { return options.law == GasLaw::isothermal || options.law == GasLaw::adiabatic; }
  };
  /// The gas of a chamber at its present volume: n [mol] and n T [mol K].
  using Content = Eigen::Array2d;

  void set_initial_volumes(const Field& rest);
  void set_nesting();
  void require_inside(int chamber, const Field& rest) const;
  void make_gradient_pattern();
  VesselGas vessel_gas(const GasExchange& exchange, int chamber, double time) const;
  std::vector<Content> contents(const GasExchange& exchange, double time) const;
  void fill(GasExchange& exchange, int number, int like, const Content& gas, double volume) const;
  void leak_out(GasExchange& exchange, std::vector<Content>& contents, int chamber, const Content& gas) const;
  Eigen::VectorXd volumes(const Field& positions, const std::vector<int>& chamber_of_triangle, const Rims& rims,
                          int count) const;
  Eigen::VectorXd windings(int chamber, const Field& positions, const std::vector<int>& number_of_triangle,
                           int count) const;
  void set_amounts();
  void find_joined();
  double pressure_outside(const GasExchange& exchange, const Vessels& vessels, int chamber,
                          const GasNetwork::End& end) const;
  std::pair<double, double> energy_balance(int chamber, double from, double to, double heat, double end_heat,
                                           double energy) const;
  void open_chambers(GasExchange& exchange, const GasStep& start, const Vessels& vessels, double time,
                     const GasNetwork::End& end) const;
  struct WallParts;
  WallParts wall_parts(const std::vector<PetscInt>& piece, const GasExchange& exchange) const;
  std::vector<int> divide_gas(Division& division, const WallParts& walls, const Eigen::VectorXd& volume,
                              double time) const;
  int number_of(const std::string& name, const std::string& key, const std::string& others) const;
  /// A pressure that changes with the place, beside the mean on a chamber's wall.
  struct UnevenPressure {
    Eigen::Vector3d slope;   ///< [Pa/m]
    Eigen::Vector3d middle;  ///< where it is 0 [m]

    double at(const Eigen::Vector3d& place) const { return slope.dot(place - middle); }
  };
  std::vector<UnevenPressure> uneven_pressures(const GasExchange& exchange, const Field& positions,
                                               const Eigen::Vector3d& gravity, double time) const;
  /// Amount of gas in a joined chamber at time 0 [mol].
  double first_amount(int chamber) const { return of(chamber).unit_amount * of(chamber).options.amount.front()[1]; }
  /// Internal energy of the gas in a joined chamber; 0 of other chambers [J].
  double energy(int chamber, const GasState& gas) const {
    return is_joined(chamber) ? heat_capacity(chamber) * gas.amount * gas.temperature : 0;
  }
  const Chamber& of(int chamber) const { return chambers_[chamber]; }
  void require_closed(int chamber, const Field& rest, const Projectors& projectors) const;

  const Surface* surface_;
  GasOptions gas_;
  Eigen::Vector3d origin_;
  SymmetryPlanes planes_;
  std::vector<Chamber> chambers_;
  std::vector<PetscInt> chamber_of_element_;  ///< of each local element, -1: none
  std::vector<int> chamber_of_triangle_;      ///< of each local triangle, -1: none, or the triangle is gone
  /// Pattern of volume_gradients: three rows for each owned particle by which a chamber's volume changes.
  Eigen::SparseMatrix<double> no_gradients_;
  /// Place in this pattern, in threes of entries, of each corner of the triangles; -1: a ghost, or bounds no chamber.
  std::vector<PetscInt> place_of_corner_;
  Rims rims_;                  ///< of chambers that vent
  std::vector<int> has_hole_;  ///< of each chamber
  std::vector<Link> links_;
  std::vector<int> joined_;
  std::vector<bool> is_joined_;  ///< of each chamber
  GasExchange initial_exchange_{0, 0};
};

}  // namespace pellicle::gas
