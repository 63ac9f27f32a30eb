#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "base/sorting.h"
#include "gas/chambers.h"
#include "parallel/collective.h"

namespace pellicle::gas {

/// The parts of the walls of chambers that vent, by the pieces of the surface.
struct Chambers::WallParts {
  /// Chamber and piece.
  using Part = std::pair<int, PetscInt>;

  std::vector<Part> parts;       ///< ascending, the same on every rank
  std::vector<int> of_triangle;  ///< number of the part of each local triangle, by its first corner; -1: none

  int count() const { return static_cast<int>(parts.size()); }
};

/// The parts of the walls of chambers that vent, are not open and have gas of their own. Collective.
Chambers::WallParts Chambers::wall_parts(const std::vector<PetscInt>& piece, const GasExchange& exchange) const {
  using Part = WallParts::Part;
  const Part none(-1, -1);
  std::vector<Part> part_of;  // of each local triangle
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    const PetscInt here = piece[surface_->triangles[triangle].front()];
    const bool is_part =
        chamber >= 0 && here >= 0 && vents(chamber) && !exchange.is_open(chamber) && !exchange.is_part(chamber);
    part_of.push_back(is_part ? Part(chamber, here) : none);
  }
  WallParts walls{without_repeats(of_all_ranks(surface_->comm(), without_repeats(part_of))), {}};
  walls.parts.erase(std::remove(walls.parts.begin(), walls.parts.end(), none), walls.parts.end());
  for (const Part& part : part_of) {
    const auto place = std::lower_bound(walls.parts.begin(), walls.parts.end(), part) - walls.parts.begin();
    walls.of_triangle.push_back(part == none ? -1 : static_cast<int>(place));
  }
  return walls;
}

std::optional<Chambers::Division> Chambers::divided(const std::vector<PetscInt>& piece, const GasExchange& exchange,
                                                    const Field& positions, double time) const {
  const WallParts walls = wall_parts(piece, exchange);
  const auto are_alike = [](const WallParts::Part& a, const WallParts::Part& b) { return a.first == b.first; };
  if (std::adjacent_find(walls.parts.begin(), walls.parts.end(), are_alike) == walls.parts.end()) {
    return std::nullopt;
  }
  const Rims rims(*surface_, walls.of_triangle, origin_, planes_);
  Eigen::VectorXd volume = volumes(positions, walls.of_triangle, rims, walls.count());  // of the gas in each part
  const Eigen::VectorXd enclosed = volumes(positions);
  std::vector<std::pair<int, int>> nested;  // chambers inside parts, each with the part that winds round it most
  for (int chamber = 0; chamber < count(); ++chamber) {
    const int round = exchange.gas_outside(chamber);
    if (exchange.is_part(chamber) || round < 0) {
      continue;
    }
    const Eigen::VectorXd winding = windings(chamber, positions, walls.of_triangle, walls.count());
    int most = -1;
    for (int part = 0; part < walls.count(); ++part) {
      if (walls.parts[part].first == round && (most < 0 || winding[part] > winding[most])) {
        most = part;
      }
    }
    if (most >= 0) {
      nested.emplace_back(chamber, most);
      volume[most] -= enclosed[chamber];
    }
  }

  Division division{chamber_of_element_, exchange, {}};
  const std::vector<int> chamber_of_part = divide_gas(division, walls, volume, time);
  for (const auto& [chamber, part] : nested) {
    division.exchange.outside[chamber] = chamber_of_part[part];
  }
  for (std::size_t triangle = 0; triangle < walls.of_triangle.size(); ++triangle) {
    if (const int part = walls.of_triangle[triangle]; part >= 0) {
      division.numbers[surface_->element_of_triangle(triangle)] = chamber_of_part[part];
    }
  }
  return division;
}

/// Divides the gas of each chamber among the large parts of its wall, and adds a chamber for each of them but the
/// first.
/// @param volume of the gas in each part [m^3] @returns the chamber of each part, -1: none
std::vector<int> Chambers::divide_gas(Division& division, const WallParts& walls, const Eigen::VectorXd& volume,
                                      double time) const {
  constexpr double least_share = 0.01;  // of the volume
  const GasExchange before = division.exchange;
  std::vector<int> chamber_of_part(walls.parts.size(), -1);
  std::vector<Content> contents = this->contents(before, time);
  std::set<int> changed;
  for (int first = 0, end = 0; first < walls.count(); first = end) {
    const int chamber = walls.parts[first].first;
    std::vector<int> large;
    for (end = first; end < walls.count() && walls.parts[end].first == chamber; ++end) {
      if (volume[end] > least_share * before.volume[chamber]) {
        large.push_back(end);
      }
    }
    chamber_of_part[large.empty() ? first : large.front()] = chamber;
    if (large.size() < 2) {
      continue;
    }
    const Content gas = contents[chamber];
    double left = 1;
    std::string line = "chamber " + name(chamber) + " is cut in " + std::to_string(large.size()) + " of";
    for (const int part : large) {
      int& number = chamber_of_part[part];
      if (number < 0) {
        number = division.exchange.chambers();
        division.exchange.add_part(chamber);
        contents.push_back(Content::Zero());
      }
      division.exchange.volume[number] = volume[part];
      const double share = volume[part] / before.volume[chamber];
      left -= share;
      contents[number] = share * gas;
      changed.insert(number);
      line += fmt::format("{} {:.4g} m^3", part == large.front() ? "" : ",", volume[part]);
    }
    division.lines.push_back(line);
    leak_out(division.exchange, contents, chamber, left * gas);  // the rest
    if (const int round = before.gas_outside(chamber); round >= 0) {
      changed.insert(round);
    }
  }
  for (const int number : changed) {
    const int like = number < count() ? number : static_cast<int>(division.exchange.parent[number]);
    fill(division.exchange, number, like, contents[number], division.exchange.volume[number]);
  }
  return chamber_of_part;
}

}  // namespace pellicle::gas
