#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "gas/gas_options.h"
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
  /// @throws Error on keys that the law lacks or does not know
  Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
           const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers);

  int count() const { return static_cast<int>(chambers_.size()); }
  /// Number of the chamber that each local element bounds, -1: none.
  const std::vector<PetscInt>& numbers() const { return chamber_of_element_; }
  const std::string& name(int chamber) const { return of(chamber).name; }
  /// Chamber of a triangle of the local elements, -1 if it bounds none.
  int of_triangle(PetscInt triangle) const { return chamber_of_triangle_[static_cast<std::size_t>(triangle)]; }

  /// Whether its law asks for the volume, which a wall with a hole does not enclose.
  bool needs_closed_wall(int chamber) const { return of(chamber).law != GasLaw::pressure; }
  /// Says which triangles of the local elements there are: the pressure of a chamber that needs no closed wall acts on
  /// no others. Collective.
  void set_living(const Living& living);
  /// Whether triangles are missing on which the pressure of a chamber would act, or its wall has cracked. Then V is no
  /// volume, and dV/dx, by which the pressure acts, is not its gradient.
  bool has_hole(int chamber) const { return has_hole_[static_cast<std::size_t>(chamber)] != 0; }

  /// V0, from the undeformed positions, the same on every rank [m^3].
  double initial_volume(int chamber) const { return of(chamber).initial_volume; }
  /// V of all chambers (eq. 13), summed over the ranks [m^3]. Collective.
  /// @param positions [m], ghosts up to date
  Eigen::VectorXd volumes(const Field& positions) const;
  /// dV/dx = A n / 3 (eq. 15 without p) of the owned particles for one chamber, zero elsewhere, (3 x owned) [m^2].
  Eigen::Matrix3Xd volume_gradient(int chamber, const Field& positions) const;

  /// The gas by its law at a volume [m^3] and time [s]. Not finite where the law needs a volume above 0 and there is
  /// none.
  GasState state(int chamber, double volume, double time) const;
  /// The gas at the end of a step in which its pressure p moves what encloses it: V is `volume` + `compliance` p.
  /// @param volume to which the step leads without this pressure [m^3]
  /// @param compliance h^2 g.W g, g = dV/dx and W the inverse masses: by how much p moves the volume [m^3/Pa]
  /// @param time at the end of the step [s]
  GasState moved_state(int chamber, double volume, double compliance, double time) const;
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
  };

  void add(const std::string& name, const ChamberOptions& options);
  void begin();
  void set_amounts();
  const Chamber& of(int chamber) const { return chambers_[static_cast<std::size_t>(chamber)]; }
  void require_closed(int chamber, const Field& rest, const std::vector<Eigen::Matrix3d>& projectors) const;

  const Surface* surface_;
  double ambient_pressure_;  ///< [Pa]
  Eigen::Vector3d origin_;
  std::vector<Chamber> chambers_;
  std::vector<PetscInt> chamber_of_element_;  ///< of each local element, -1: none
  std::vector<int> chamber_of_triangle_;      ///< of what is left of their triangles, -1: none
  std::vector<int> has_hole_;                 ///< of each chamber
};

}  // namespace gas
}  // namespace pellicle
