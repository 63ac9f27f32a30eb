#include "gas/gas_exchange.h"

#include <algorithm>
#include <numeric>

namespace pellicle::gas {

GasExchange::GasExchange(int chambers, int links)
    : open(chambers, 0),
      link_amount(Eigen::VectorXd::Zero(links)),
      link_enthalpy(Eigen::VectorXd::Zero(links)),
      inside(chambers),
      outside(chambers, -1),
      parent(chambers, -1) {
  for (Eigen::VectorXd* values : of_chambers()) {
    values->setZero(chambers);
  }
  std::iota(inside.begin(), inside.end(), 0);
}

Eigen::VectorXd GasExchange::gas_volumes(const Eigen::VectorXd& walls) const {
  Eigen::VectorXd volumes = Eigen::VectorXd::Zero(chambers());
  for (int wall = 0; wall < chambers(); ++wall) {
    volumes[gas_inside(wall)] += walls[wall];
    if (const int round = gas_outside(wall); round >= 0) {
      volumes[round] -= walls[wall];
    }
  }
  return volumes;
}

std::vector<int> GasExchange::from_within() const {
  std::vector<int> order;
  for (int chamber = 0; chamber < chambers(); ++chamber) {
    if (!is_part(chamber)) {
      order.push_back(chamber);
    }
  }
  const auto depth = [this](int chamber) {
    int levels = 0;
    for (int round = gas_outside(chamber); round >= 0; round = gas_outside(round)) {
      ++levels;
    }
    return levels;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return depth(a) > depth(b); });
  return order;
}

Eigen::VectorXd GasExchange::within_walls(Eigen::VectorXd of_gas) const {
  for (const int chamber : from_within()) {
    if (const int round = gas_outside(chamber); round >= 0) {
      of_gas[round] += of_gas[chamber];
    }
  }
  return of_gas;
}

void GasExchange::add_part(int chamber) {
  const int part = chambers();
  for (Eigen::VectorXd* values : of_chambers()) {
    values->conservativeResizeLike(Eigen::VectorXd::Zero(part + 1));
  }
  reference_volume[part] = reference_volume[chamber];
  open.push_back(0);
  inside.push_back(part);
  outside.push_back(outside[chamber]);
  parent.push_back(chamber);
}

}  // namespace pellicle::gas
