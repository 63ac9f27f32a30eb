#include "elastic/sheet_springs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/incidence.h"
#include "geometry/pressure_load.h"

namespace pellicle::elastic {

namespace {

double factor_at(const std::vector<double>& factors, const std::array<PetscInt, 2>& ends) {
  return factors.empty() ? 1 : (factors[ends[0]] + factors[ends[1]]) / 2;
}

/// Elastic moduli of an evenly strained net.
struct NetStiffness {
  std::array<double, 2> normal{};  ///< C11 and C22 [N/m]
  double shear = 0;                ///< G [N/m]

  NetStiffness(const Stiffness& stiffness, double tensile_factor, double shear_factor)
      : shear(shear_factor * stiffness.shear) {
    const double warp = tensile_factor * stiffness.tensile[0];
    const double weft = tensile_factor * stiffness.tensile[1];
    const double both = warp * weft > 0 ? (1 + std::sqrt(1 + 4 * shear * shear / (warp * weft))) / 2 : 1;
    normal = {both * warp, both * weft};
  }
};

}  // namespace

Weave weave_of(const Sheet& sheet, const Eigen::Vector3d& warp_direction) {
  Weave weave;
  weave.normal.setZero(3, sheet.particles.local());
  for (const auto& [a, b, c] : sheet.triangles) {
    const Eigen::Vector3d area = (sheet.rest.col(b) - sheet.rest.col(a)).cross(sheet.rest.col(c) - sheet.rest.col(a));
    for (const PetscInt i : {a, b, c}) {
      weave.normal.col(i) += area;
    }
  }
  weave.normal.colwise().normalize();
  weave.warp.resizeLike(weave.normal);
  constexpr double upright = 1e-3;  // sine of the angle below which a direction counts as normal to the surface
  const Eigen::Vector3d wanted = warp_direction.stableNormalized();
  const Eigen::Vector3d next(wanted.z(), wanted.x(), wanted.y());
  for (Eigen::Index i = 0; i < weave.normal.cols(); ++i) {
    const Eigen::Vector3d n = weave.normal.col(i);
    const auto in_plane = [&n](const Eigen::Vector3d& direction) {
      return Eigen::Vector3d(direction - n.dot(direction) * n);
    };
    const Eigen::Vector3d warp = in_plane(wanted);
    weave.warp.col(i) = (warp.norm() > upright ? warp : in_plane(next)).normalized();
  }
  return weave;
}

std::vector<double> cell_areas(const Sheet& sheet) {
  std::vector<double> areas;
  for (const auto& [c0, c1, c2, c3] : sheet.cells) {
    areas.push_back(
        quad_area_vector(sheet.rest.col(c0), sheet.rest.col(c1), sheet.rest.col(c2), sheet.rest.col(c3)).norm());
  }
  return areas;
}

std::vector<PetscInt> sides_beyond(const Sheet& sheet) {
  std::vector<PetscInt> corners;
  corners.reserve(4 * sheet.cells.size());
  for (const auto& cell : sheet.cells) {
    corners.insert(corners.end(), cell.begin(), cell.end());
  }
  return opposite_sides(corners, 4);
}

SheetSprings::SheetSprings(const Sheet& sheet, const Stiffness& stiffness, const Weave& weave,
                           const MaterialFactors& factors)
    : sheet_(&sheet), cell_area_(cell_areas(sheet)), beyond_(sides_beyond(sheet)) {
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    std::vector<double>& per_area = per_area_[static_cast<std::size_t>(colour)];
    per_area.assign(set.ends.size(), 0);
    stiffness_[static_cast<std::size_t>(colour)].resize(set.ends.size());
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      const auto& ends = set.ends[s];
      const Eigen::Vector3d arm = sheet.rest.col(ends[0]) - sheet.rest.col(ends[1]);
      const double squared_length = arm.squaredNorm();
      // A ghost that moves no particle of this rank may have triangles that are not known here.
      const bool is_ghost = s >= static_cast<std::size_t>(set.owned());
      if ((is_ghost && std::min(ends[0], ends[1]) >= sheet.particles.owned) || squared_length == 0) {
        continue;
      }
      const NetStiffness net(stiffness, factor_at(factors.tensile, ends), factor_at(factors.shear, ends));
      if (colour == Colour::yellow) {
        per_area[s] = net.shear / squared_length;
        continue;
      }
      double cell_area = 0;  // the mean
      int triangles = 0;
      for (std::size_t k = 0; k < 2; ++k) {
        if (set.triangles[s][k] >= 0) {
          cell_area += cell_area_[set.triangles[s][k] / 4];
          ++triangles;
        }
      }
      cell_area /= triangles;
      if (colour == Colour::red) {
        const auto& c = sheet.cells[set.triangles[s][0] / 4];
        const Eigen::Vector3d first = sheet.rest.col(c[2]) - sheet.rest.col(c[0]);
        const Eigen::Vector3d second = sheet.rest.col(c[3]) - sheet.rest.col(c[1]);
        // Diagonals that are far from perpendicular to each other change little in a shear along the sides.
        const double squared_sine = first.cross(second).squaredNorm() / (first.squaredNorm() * second.squaredNorm());
        per_area[s] = 2 * net.shear / (squared_length * squared_sine);
        continue;
      }
      const Eigen::Vector3d warp = weave.warp.col(ends[0]) + weave.warp.col(ends[1]);
      const double along = std::pow(arm.dot(warp), 2) / (squared_length * warp.squaredNorm());
      const double normal = net.normal[0] * along + net.normal[1] * (1 - along);
      const double aspect = squared_length / cell_area;
      const double of_diagonals = net.shear * aspect * aspect;
      per_area[s] = std::max(0.0, normal - of_diagonals) / squared_length;
      if (!is_ghost && normal > 0) {
        largest_excess_ = std::max(largest_excess_, of_diagonals / normal);
      }
    }
  }
}

const std::array<std::vector<double>, 4>& SheetSprings::stiffness(const ActiveSet& active) {
  if (active.triangles == active_before_ && active.cracked == cracked_before_) {  // They decide which springs live.
    return stiffness_;
  }
  active_before_ = active.triangles;
  cracked_before_ = active.cracked;
  const auto lives = [&](PetscInt triangle) { return triangle >= 0 && active.triangles[triangle]; };
  const auto area_of = [&](PetscInt triangle) { return lives(triangle) ? cell_area_[triangle / 4] / 4 : 0; };
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet_->of(colour);
    const auto index = static_cast<std::size_t>(colour);
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      double& stiffness = stiffness_[index][s];
      stiffness = 0;
      if (per_area_[index][s] == 0 || !active.springs[index][s]) {
        continue;
      }
      const auto& triangles = set.triangles[s];
      if (colour == Colour::green && active.cracked[triangles[0]]) {
        continue;
      }
      double area = area_of(triangles[0]) + area_of(triangles[1]);
      if (colour == Colour::yellow) {
        area += area_of(triangles[2]) + area_of(triangles[3]);
        if (std::all_of(triangles.begin(), triangles.end(), lives)) {
          area = 0;
        }
      }
      for (std::size_t t = 0; colour == Colour::blue && t < 2; ++t) {
        if (!lives(triangles[t])) {
          continue;
        }
        for (const PetscInt turn : {1, 3}) {  // the sides beside it
          const PetscInt beside = triangles[t] / 4 * 4 + (triangles[t] + turn) % 4;
          const bool is_crossed = beyond_[beside] >= 0 && !active.cracked[beside];
          area += is_crossed ? 0 : area_of(beside) / 2;
        }
      }
      stiffness = per_area_[index][s] * area;
    }
  }
  return stiffness_;
}

}  // namespace pellicle::elastic
