#include "world/gas_push.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace pellicle {
inline namespace world {

namespace {

/// Share of a chamber's volume to which the end of a step and the law agree.
constexpr double tolerance = 1e-5;
constexpr int most_solves = 12;

/// Of the free sheet's compliance, for the second solve: how far springs may hold the sheet back is not known yet.
constexpr double first_guess = 0.25;
constexpr double least_share = 1e-6;

}  // namespace

GasPush::GasPush(PushedGas& gas, const Sheet& sheet, const Field& free, const std::vector<double>& mass,
                 const std::vector<bool>& held, double h)
    : gas_(gas),
      chambers_(gas.chambers()),
      response_{chambers_.volumes(free), Eigen::VectorXd(chambers_.count())},
      pressure_(static_cast<std::size_t>(chambers_.count())),
      velocity_(sheet.particles, 3) {
  const PetscInt owned = sheet.particles.owned;
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    Field& move = moves_.emplace_back(sheet.particles, 3);
    move.values().leftCols(owned) = chambers_.volume_gradient(chamber, free);
    if (sheet.layers == 1) {
      move.update_ghosts();
      for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
        for (const PetscInt corner : sheet.cells[cell]) {
          move.vector(corner) += move.vector(sheet.lattice[cell]) / 4;
        }
      }
    }
    double sum = 0;
    for (PetscInt i = 0; i < owned; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Eigen::Vector3d gradient = move.vector(i);
      move.vector(i) *= held[k] ? 0 : h / mass[k];
      sum += h * gradient.dot(move.vector(i));
    }
    move.update_ghosts();
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
    response_.compliance[chamber] = sum;
  }
  free_compliance_ = response_.compliance;
  gas_.gas().set_response(gas_.number(), response_);
}

void GasPush::choose_pressures() {
  velocity_.values().setZero();
  expected_ = gas_.gas().walls(gas_.number());
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    const auto c = static_cast<std::size_t>(chamber);
    const double compliance = response_.compliance[chamber];
    if (!chambers_.prescribes_volume(chamber)) {
      pressure_[c] = gas_.gas().states(gas_.number())[c].pressure;
    } else {
      pressure_[c] = compliance > 0 ? (expected_[chamber] - response_.walls[chamber]) / compliance : 0;
    }
    velocity_.values() += pressure_[c] * moves_[c].values();
  }
}

bool GasPush::is_done(const Field& end) {
  const Eigen::VectorXd volumes = chambers_.volumes(end);
  ++solves_;
  disagreement_.clear();
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    if (chambers_.needs_volume(chamber)) {
      const double share = volumes[chamber] / expected_[chamber] - 1;
      if (!(std::abs(share) <= tolerance)) {  // also when it is not a number
        char text[200];
        std::snprintf(
            text, sizeof text,
            "after %d solves the volume of chamber %s is off that of its gas by a share of %.1e, expected %.0e",
            solves_, chambers_.name(chamber).c_str(), std::abs(share), tolerance);
        disagreement_ = text;
      }
    }
  }
  if (disagreement_.empty() || solves_ == most_solves) {
    return true;
  }
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    const auto c = static_cast<std::size_t>(chamber);
    double share = first_guess;
    if (!last_pressure_.empty() && pressure_[c] != last_pressure_[c]) {
      const double secant = (volumes[chamber] - last_volume_[chamber]) / (pressure_[c] - last_pressure_[c]);
      share = std::clamp(secant / free_compliance_[chamber], least_share, 1.0);
    }
    response_.compliance[chamber] = share * free_compliance_[chamber];
    response_.walls[chamber] = volumes[chamber] - response_.compliance[chamber] * pressure_[c];
  }
  last_pressure_ = pressure_;
  last_volume_ = volumes;
  gas_.gas().set_response(gas_.number(), response_);
  return false;
}

void GasPush::settle(const Field& end) {
  has_settled_ = true;
  response_.walls = chambers_.volumes(end);
  response_.compliance.setZero();
  gas_.gas().set_response(gas_.number(), response_);
}

}  // namespace world
}  // namespace pellicle
