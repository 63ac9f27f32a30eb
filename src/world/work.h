#pragma once

#include <Eigen/Core>

#include "parallel/field.h"
#include "surface/surface.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

class Report;

/// The causes of work on an object, besides contact (ContactWork): entries of State::work. The work of a step is that
/// of the forces with which the step is in balance over its displacements. With steps of implicit Euler kinetic and
/// elastic energy change by the sum of all works less what the steps damp, which falls with their length.
enum class Work {
  gravity,
  damping,   ///< `force.damping` and viscosity; of a balloon C (PrismOptions)
  pins,      ///< that move
  pressure,  ///< across walls, with weights and jets of gas
  bodies,
  air,
  loads  ///< attachments and forces
};
constexpr int kinds_of_work = 7;

/// An entry of a vector of works [J].
inline double& of(Eigen::VectorXd& works, Work kind) { return works[static_cast<Eigen::Index>(kind)]; }

/// The kinetic energy of an object [J]. Collective. @param mass of the owned particles [kg]
double kinetic_energy(const Surface& surface, const double* mass, const Field& velocity);

/// Adds the works that an object with these options can have, such as gravity_work. @param works since time 0 [J]
void report_work(Report& report, const Options& options, const Eigen::VectorXd& works);

}  // namespace world
}  // namespace pellicle
