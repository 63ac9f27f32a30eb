#include "elastic/sheet_springs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/incidence.h"
#include "geometry/pressure_load.h"
#include "surface/membrane.h"

namespace pellicle::elastic {

namespace {

double factor_at(const std::vector<double>& factors, const std::array<PetscInt, 2>& ends) {
  return factors.empty() ? 1 : (factors[ends[0]] + factors[ends[1]]) / 2;
}

}  // namespace

Eigen::Matrix3Xd warp_of(const Sheet& sheet, const Eigen::Vector3d& direction) {
  Eigen::Matrix3Xd normal = Eigen::Matrix3Xd::Zero(3, sheet.particles.local());
  for (const std::array<PetscInt, 3>& triangle : sheet.triangles) {
    const auto [e12, e13] = edges_of(sheet.rest.data(), triangle);
    for (const PetscInt i : triangle) {
      normal.col(i) += e12.cross(e13);
    }
  }
  normal.colwise().normalize();
  Eigen::Matrix3Xd warp(3, normal.cols());
  constexpr double upright = 1e-3;  // sine of the angle below which a direction counts as normal to the surface
  const Eigen::Vector3d wanted = direction.stableNormalized();
  const Eigen::Vector3d next(wanted.z(), wanted.x(), wanted.y());
  for (Eigen::Index i = 0; i < normal.cols(); ++i) {
    const Eigen::Vector3d n = normal.col(i);
    const Eigen::Vector3d in_plane = wanted - n.dot(wanted) * n;
    warp.col(i) = (in_plane.norm() > upright ? in_plane : Eigen::Vector3d(next - n.dot(next) * n)).normalized();
  }
  return warp;
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

SheetSprings::SheetSprings(const Sheet& sheet, const Stiffness& stiffness, const Eigen::Vector3d& warp,
                           const MaterialFactors& factors)
    : sheet_(&sheet), cell_area_(cell_areas(sheet)), beyond_(sides_beyond(sheet)) {
  const Eigen::Matrix3Xd warps = warp_of(sheet, warp);
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
      const double shear = factor_at(factors.shear, ends) * stiffness.shear;  // G
      if (colour == Colour::yellow) {
        per_area[s] = shear / squared_length;
        continue;
      }
      const auto& triangles = set.triangles[s];
      if (colour == Colour::red) {
        const auto& c = sheet.cells[triangles[0] / 4];
        const Eigen::Vector3d first = sheet.rest.col(c[2]) - sheet.rest.col(c[0]);
        const Eigen::Vector3d second = sheet.rest.col(c[3]) - sheet.rest.col(c[1]);
        // Diagonals that are far from perpendicular to each other change little in a shear along the sides.
        const double squared_sine = first.cross(second).squaredNorm() / (first.squaredNorm() * second.squaredNorm());
        per_area[s] = 2 * shear / (squared_length * squared_sine);
        continue;
      }
      const Eigen::Vector3d both_warps = warps.col(ends[0]) + warps.col(ends[1]);
      const double along = std::pow(arm.dot(both_warps), 2) / (squared_length * both_warps.squaredNorm());
      const double tensile_factor = factor_at(factors.tensile, ends);
      const double of_warp = tensile_factor * stiffness.tensile[0];
      const double of_weft = tensile_factor * stiffness.tensile[1];
      const double product = of_warp * of_weft;
      const double excess = product > 0 ? (1 + std::sqrt(1 + 4 * shear * shear / product)) / 2 : 1;
      const double normal = excess * of_warp * along + excess * of_weft * (1 - along);  // between C11 and C22
      const auto area_at = [this](PetscInt triangle) { return triangle >= 0 ? cell_area_[triangle / 4] : 0; };
      const int sides = (triangles[0] >= 0 ? 1 : 0) + (triangles[1] >= 0 ? 1 : 0);
      const double aspect = squared_length / ((area_at(triangles[0]) + area_at(triangles[1])) / sides);
      const double of_diagonals = shear * aspect * aspect;
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
