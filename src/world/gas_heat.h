#pragma once

#include <string>
#include <vector>

#include "gas/chambers.h"
#include "world/burning_fields.h"

namespace pellicle {
inline namespace world {

/// Heat between the gas in chambers and walls that have temperatures. A particle i with a fraction a of a chamber's
/// walls gives h k a/(1 + h k a/(c m)) (T_i - T_gas), with the heat transfer coefficient k, as if its own temperature
/// changed implicitly too; the gas receives the sum.
class GasHeat {
 public:
  /// Begins a step of length h [s], and sets the heat properties of the walls for the gas. Collective.
  /// @param capacity c of the wall [J/(kg K)]
  void begin_step(const Chambers& chambers, const GasExchange& exchange, const Surface& surface, const Field& position,
                  const BurningFields& fields, double capacity, double h, ChamberWalls& walls);
  /// Takes the heat that the gas has received from the particles, or gives them what it has lost. Collective.
  /// @param given to the gas of each chamber in the step [J]
  /// @returns in words where the two do not agree to 1e-10; empty: everywhere
  std::string end_step(const Chambers& chambers, const Eigen::VectorXd& given, BurningFields& fields) const;

 private:
  struct Share {
    PetscInt particle;
    int chamber;
    double conductance;  ///< [W/K]
  };

  std::vector<Share> shares_;  ///< of the owned particles
  ChamberWalls walls_;
  double capacity_ = 0;
  double h_ = 0;
};

}  // namespace world
}  // namespace pellicle
