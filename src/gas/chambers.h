#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gas/gas_network.h"
#include "gas/gas_options.h"
#include "gas/rims.h"
#include "parallel/field.h"
#include "surface/living.h"

namespace pellicle {
inline namespace gas {

/// The gas of a chamber at a moment. What the law says nothing of is 0: amount and temperature for the laws relative,
/// pressure and volume; all but the volume for the law volume, whose pressure the solver finds.
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
        parent(Eigen::VectorXd::Constant(chambers, -1)),
        reference_volume(Eigen::VectorXd::Zero(chambers)) {}

  Eigen::VectorXd amount;         ///< into each chamber [mol]
  Eigen::VectorXd heat;           ///< likewise, see VesselGas [mol K]
  Eigen::VectorXd open;           ///< 1: for good, its pressure is that outside; 0: not
  Eigen::VectorXd leak_amount;    ///< out through each wall [mol]
  Eigen::VectorXd leak_enthalpy;  ///< that it carried [J]
  Eigen::VectorXd wall_heat;      ///< that each wall has given to its gas [J]
  Eigen::VectorXd work;           ///< of the gas of each chamber that links or heat join to anything [J]
  Eigen::VectorXd link_amount;    ///< through each link, in the order of their names [mol]
  Eigen::VectorXd link_enthalpy;  ///< that it carried [J]
  Eigen::VectorXd first_energy;   ///< of the gas in each chamber at time 0 [J]
  /// Of each chamber at the end of the last step, up to which work is counted; of one that is open at which it opened,
  /// which stands for what is left of it [m^3].
  Eigen::VectorXd volume;

  // Of chambers that have been cut in two.
  Eigen::VectorXd parent;            ///< number of the chamber that each was a part of; -1: it was there at first
  Eigen::VectorXd reference_volume;  ///< V0 of each; of a part that of its parent [m^3]
  /// One chamber more, without gas: a part of another.
  void add_part(int chamber);
};

/// What the walls of the chambers are to their gas in a step.
struct ChamberWalls {
  Eigen::VectorXd area;                 ///< [m^2]
  Eigen::VectorXd hole_area;            ///< of the caps [m^2]
  std::vector<GasNetwork::Leak> leaks;  ///< through which gas gets out and in; the vessel is the chamber
  Eigen::VectorXd conductance;          ///< for heat [W/K]
  Eigen::VectorXd temperature;          ///< [K]
};

/// The chambers of a balloon or of a sheet: volumes enclosed by closed pieces of the surface (balloon paper, section
/// 5), or by a piece and the symmetry planes that its boundary lies in. The volume is that within the surface's
/// triangles; of a sheet of quads they join corners and lattice points, so that both layers feel the pressure.
class Chambers {
 public:
  /// Chambers in the order of their names; one without a vertex stands for every piece that no other names, as NAME,
  /// NAME_2, ... Collective. The surface must outlive the chambers.
  /// @param origin a point of all symmetry planes, about which volumes are taken; any point for closed pieces [m]
  /// @param projectors of the local vertices on the directions in which they may move (Constraints::projectors); asked
  /// for with symmetry planes alone
  /// @throws Error that names the chamber and the key, the same on all ranks: keys that the law lacks or does not know,
  /// a vertex that the mesh lacks, a piece in two chambers, and, unless the law is pressure, a piece that is neither
  /// closed nor closed by symmetry planes, or that encloses no volume above 0
  Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin = Eigen::Vector3d::Zero(), bool has_symmetry_planes = false,
           const std::vector<Eigen::Matrix3d>& projectors = {});

  /// Chambers of triangles that have been chosen before, whatever has become of the surface since. Collective. The
  /// surface must outlive the chambers.
  /// @param numbers chamber of each local element, see numbers
  /// @param exchange of a state that has one, which knows of chambers that have been cut in two
  /// @throws Error on keys that the law lacks or does not know
  Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers, const GasExchange* exchange);

  int count() const { return static_cast<int>(chambers_.size()); }
  /// Number of the chamber that each local element bounds, -1: none.
  const std::vector<PetscInt>& numbers() const { return chamber_of_element_; }
  const std::string& name(int chamber) const { return of(chamber).name; }
  /// Whether it was there at first; others are parts of a chamber that has been cut in two.
  bool was_there_at_first(int chamber) const { return of(chamber).parent < 0; }
  /// Chamber of a triangle of the local elements, -1 if it bounds none.
  int of_triangle(PetscInt triangle) const { return chamber_of_triangle_[static_cast<std::size_t>(triangle)]; }

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
  /// What becomes of chambers that vent and whose wall has come apart. Each piece that encloses a hundredth of the
  /// chamber's volume bounds a chamber, with gas of its state by its volume; the oldest of them goes on as the old
  /// chamber, with its links. Smaller pieces bound none. The rest of the gas has leaked. Nothing: no wall has come
  /// apart. Collective.
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
  bool has_hole(int chamber) const { return has_hole_[static_cast<std::size_t>(chamber)] != 0; }

  /// V0, from the undeformed positions, the same on every rank [m^3].
  double initial_volume(int chamber) const { return of(chamber).initial_volume; }
  /// V of all chambers (eq. 13), summed over the ranks [m^3]. Collective.
  /// @param positions [m], ghosts up to date
  Eigen::VectorXd volumes(const Field& positions) const;
  /// What the weights of gas and air, and jets through holes, do to walls beside pressures that are even. The pressure
  /// at x is (rho - rho_outside) g.(x - x_0), with the middle x_0 of the wall, which sums up to minus the lift,
  /// (rho - rho_outside) V g; jets push the rims (jet_thrust), but for what the pressure on a wall with holes sums up
  /// to already. Of the owned particles (3 x owned) [N]. Collective.
  /// @param gravity g [m/s^2]; 0: gas and air weigh nothing
  Eigen::Matrix3Xd uneven_forces(const Field& positions, const Eigen::Vector3d& gravity, double time) const;
  /// dV/dx = A n / 3 (eq. 15 without p) by the owned particles, a column a chamber, (3 owned x count) [m^2].
  Eigen::SparseMatrix<double> volume_gradients(const Field& positions) const;
  /// Of one chamber, (3 x owned) [m^2].
  Eigen::Matrix3Xd volume_gradient(int chamber, const Field& positions) const;

  /// The gas by its law at a volume [m^3] and time [s], with what has come in by the beginning of the step. Not finite
  /// where the law needs a volume above 0 and there is none.
  GasState state(int chamber, double volume, double time) const;

  /// Whether links or heat of the wall change a chamber's gas in a step. Its law is then isothermal or adiabatic.
  bool is_joined(int chamber) const { return vessel_of_[static_cast<std::size_t>(chamber)] >= 0; }
  bool has_network() const { return network_.count() > 0; }
  const GasNetwork& network() const { return network_; }
  /// The chambers of the network's vessels.
  const std::vector<int>& joined() const { return joined_; }
  /// c_v of a mole of a joined chamber's gas [J/(mol K)].
  double heat_capacity(int chamber) const {
    return network_.heat_capacity(vessel_of_[static_cast<std::size_t>(chamber)]);
  }
  /// From here on gas is that of a step that begins with what has come in so far; h = 0: of the moment between steps.
  /// @param h length of the step [s]
  /// @param walls then
  void begin_step(const GasExchange& exchange, double h, const ChamberWalls& walls = {});
  /// The walls at positions, with the temperatures that the options give. Collective.
  /// @param gravity as of uneven_forces: the pressure at a hole is that at its height
  ChamberWalls walls(const Field& positions, const Eigen::Vector3d& gravity, double time) const;
  double heat_transfer(int chamber) const { return of(chamber).options.heat_transfer; }  ///< [W/(m^2 K)]
  /// The gas of all chambers at the end of the step, with what links and walls bring until then. Not finite where a
  /// volume is not above 0, or no amounts are found.
  /// @param volumes of all chambers [m^3] @param time at the end of the step [s]
  std::vector<GasState> end_states(const Eigen::VectorXd& volumes, double time) const;
  /// dp_i/dV_j at the end of the step, of joined chambers, the vessels of the network [Pa/m^3].
  Eigen::MatrixXd joined_slopes(const Eigen::VectorXd& volumes, double time) const;
  /// Work of the gas of joined chambers from one volume to another, each pressure that at the end of a step to there:
  /// along a straight line from all volumes to all others [J].
  double joined_work(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double time) const;
  /// Which balance of a joined chamber does not close to 1e-10 of what goes in and out, in words; empty: all close.
  /// Amounts must change by what links and holes have carried, energies by that and by work and heat of the wall; a
  /// chamber is looked at together with what has been cut off it. Of a chamber that keeps its temperature only amounts
  /// are. @param volumes of all chambers [m^3]
  std::string imbalance(const Eigen::VectorXd& volumes, double time) const;
  /// What has come in at time 0: nothing. @param volumes of all chambers then [m^3]
  GasExchange first_exchange(const Eigen::VectorXd& volumes) const;
  /// Caps move at once where holes grow or join, and with them volumes: what has come in if the gas keeps its state,
  /// and what is outside now has leaked. @param volumes of all chambers at the same positions [m^3]
  GasExchange recapped(const GasExchange& exchange, const Eigen::VectorXd& volumes, double time) const;
  /// What has come in at the end of the step. A chamber is open from here on if its holes are larger than a tenth of
  /// what is left of its wall and its pressure has come within a hundred thousandth of that outside, or if they are
  /// larger than it. @param end volumes of all chambers then [m^3]
  GasExchange end_step(const Eigen::VectorXd& end, double time) const;

  /// The gas at the end of a step in which the pressures p move what encloses it: V is `volumes` + `compliance` p.
  /// @param volumes to which the step leads without the pressures [m^3]
  /// @param compliance h^2 g.W g, g = dV/dx and W the inverse masses: by how much p moves the volume [m^3/Pa]
  /// @param time at the end of the step [s]
  std::vector<GasState> moved_states(const Eigen::VectorXd& volumes, const Eigen::VectorXd& compliance,
                                     double time) const;
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

  void add(const std::string& name, const ChamberOptions& options);
  void begin();
  void find_particles();
  void fill(GasExchange& exchange, int number, int like, double amount, double temperature, double volume) const;
  void leak(GasExchange& exchange, int chamber, double amount, double temperature) const;
  Eigen::VectorXd volumes(const Field& positions, const std::vector<int>& chamber_of_triangle, const Rims& rims,
                          int count) const;
  void set_amounts();
  void join(const GasOptions& gas);
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
  bool is_open(int chamber) const { return is_open(exchange_, chamber); }
  /// In a joined chamber at time 0 [mol].
  double first_amount(int chamber) const { return of(chamber).unit_amount * of(chamber).options.amount.front()[1]; }
  /// Of the gas in a joined chamber [J]; 0 of others.
  double energy(int chamber, const GasState& gas) const {
    return is_joined(chamber) ? heat_capacity(chamber) * gas.amount * gas.temperature : 0;
  }
  GasNetwork::Step network_step(const Eigen::VectorXd& volumes, double time) const;
  GasState moved_state(int chamber, double volume, double compliance, double time) const;
  PetscInt owned_triangles() const { return surface_->triangles_per_element * surface_->elements.owned; }
  const Chamber& of(int chamber) const { return chambers_[static_cast<std::size_t>(chamber)]; }
  void require_closed(int chamber, const Field& rest, const std::vector<Eigen::Matrix3d>& projectors) const;

  const Surface* surface_;
  double ambient_pressure_;     ///< [Pa]
  double ambient_temperature_;  ///< [K]
  double molar_mass_;           ///< [kg/mol]
  Eigen::Vector3d origin_;
  std::vector<Chamber> chambers_;
  std::vector<PetscInt> chamber_of_element_;  ///< of each local element, -1: none
  std::vector<int> chamber_of_triangle_;      ///< of what is left of their triangles, -1: none
  /// See volume_gradients, without values: three rows for each owned particle by which a chamber's volume changes.
  Eigen::SparseMatrix<double> no_gradients_;
  /// Which of these threes of entries each corner of the triangles has, -1: it is a ghost's, or bounds no chamber.
  std::vector<PetscInt> place_of_corner_;
  Rims rims_;                   ///< of chambers that vent
  std::vector<int> has_hole_;   ///< of each chamber
  GasNetwork network_;          ///< of the joined chambers
  std::vector<int> joined_;     ///< chamber of each vessel
  std::vector<int> vessel_of_;  ///< of each chamber, -1: it is not joined
  GasExchange exchange_{0, 0};  ///< by the beginning of the step
  ChamberWalls walls_;          ///< then
  double h_ = 0;                ///< of the step [s]
};

}  // namespace gas
}  // namespace pellicle
