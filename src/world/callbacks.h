#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "world/stage.h"

namespace pellicle::world {

/// Makes a stage of a program of one's own (Object::add_stage), now and whenever the surface has been numbered anew.
/// Surface and state outlive the stage.
using StageMaker = std::function<std::unique_ptr<Stage>(const Surface& surface, State& state)>;

/// The acceleration [m/s^2] of a particle at a place [m] that moves with a velocity [m/s], at a time [s].
using Acceleration =
    std::function<Eigen::Vector3d(const Eigen::Vector3d& place, const Eigen::Vector3d& velocity, double time)>;
/// Heat by mass and time that something gets at a place [m] at a time [s]; negative: that it loses [W/kg].
using Heating = std::function<double(const Eigen::Vector3d& place, double time)>;

/// A stage that accelerates all particles at the beginning of a step: it adds h times the acceleration to the
/// velocities, from which the balance goes on. Steps of statics have no velocities and ignore it.
StageMaker accelerating(Acceleration acceleration);
/// A stage that heats all particles at the beginning of a step; the heat is in the balance of heat.
/// @param capacity c of the object, HeatOptions::capacity [J/(kg K)] @throws Error if the object has no temperatures
StageMaker heating(Heating power, double capacity);

}  // namespace pellicle::world
