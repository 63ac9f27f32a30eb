#include "contact/body_heat.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "geometry/deepest_point.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

/// Limits below which a part of a triangle is integrated by one quadrature.
struct Fineness {
  double change;  ///< from a bound of the gap to the largest gap found, as a fraction of the reach
  int divisions;  ///< the most
};
constexpr Fineness at_convex{0.5, 8};
constexpr Fineness elsewhere{1, 4};  ///< the bound is rough, and distances take long

/// Points and weights that integrate polynomials of degree 4 over a triangle exactly (Strang and Fix 1973).
struct QuadraturePoint {
  Eigen::Vector3d at;  ///< barycentric coordinates
  double weight;
};
const std::array<QuadraturePoint, 6>& quadrature() {
  constexpr double a = 0.445948490915965;
  constexpr double b = 0.091576213509771;
  constexpr double weight_a = 0.223381589678011;
  constexpr double weight_b = 1.0 / 3 - weight_a;
  static const std::array<QuadraturePoint, 6> points{{{{a, a, 1 - 2 * a}, weight_a},
                                                      {{a, 1 - 2 * a, a}, weight_a},
                                                      {{1 - 2 * a, a, a}, weight_a},
                                                      {{b, b, 1 - 2 * b}, weight_b},
                                                      {{b, 1 - 2 * b, b}, weight_b},
                                                      {{1 - 2 * b, b, b}, weight_b}}};
  return points;
}

/// A body in its pose, with the weight of its heat transfer by the distance from it.
struct HotSolid {
  Solid solid;
  Eigen::AlignedBox3d box;  ///< round the solid, in its own frame
  double touching;          ///< distance up to which the weight is 1 [m]
  double reach;             ///< further distance over which the weight falls to 0 [m]

  double farthest() const { return touching + reach; }
  double weight(double distance) const {
    const double s = std::clamp((distance - touching) / reach, 0.0, 1.0);
    return 1 - s * s * s * (10 - s * (15 - 6 * s));
  }
};

/// A surface triangle near a body, over which the weight is integrated.
struct DrawnTriangle {
  const HotSolid& hot;
  const Triangle& corners;
  const std::optional<Eigen::Vector3d>& lift;  ///< from the drawn layer to the other one [m]; none: there is one layer
  bool has_centre;                             ///< whether its last corner is the centre of a quad

  double area() const { return (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 2; }

  Eigen::Vector3d at(const Eigen::Vector3d& w) const {
    return w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2];
  }
  Eigen::Vector3d shares(const Eigen::Vector3d& w) const {
    return has_centre ? Eigen::Vector3d(w[0] * (1 - w[2]), w[1] * (1 - w[2]), w[2] * (2 - w[2])) : w;
  }
  double distance(const Eigen::Vector3d& w) const {
    const double drawn = signed_distance(hot.solid, at(w)).distance;
    return lift ? std::min(drawn, signed_distance(hot.solid, at(w) + *lift).distance) : drawn;
  }

  /// Lower bound of a part's distance [m]. @param part barycentric coordinates @param up from the drawn layer [m]
  double least_of_layer(const Triangle& part, const Eigen::Vector3d& up) const {
    const Eigen::Vector3d middle = at((part[0] + part[1] + part[2]) / 3) + up;
    const Triangle places{at(part[0]) + up, at(part[1]) + up, at(part[2]) + up};
    return least_distance(hot.solid, places, middle, signed_distance(hot.solid, middle));
  }

  /// Adds the integral over a part of weight times fraction of each corner [m^2]. @param divisions that led to the part
  void add(const Triangle& part, double area, int divisions, Eigen::Vector3d& sum) const {
    double least = least_of_layer(part, Eigen::Vector3d::Zero());
    if (lift) {
      least = std::min(least, least_of_layer(part, *lift));
    }
    if (least >= hot.farthest()) {
      return;
    }
    std::array<Eigen::Vector3d, 6> points;
    std::array<double, 6> distances{};
    for (std::size_t q = 0; q < points.size(); ++q) {
      const Eigen::Vector3d& w = quadrature()[q].at;
      points[q] = w[0] * part[0] + w[1] * part[1] + w[2] * part[2];
      distances[q] = distance(points[q]);
    }
    const double most = *std::max_element(distances.begin(), distances.end());
    const double change = most - least;
    const bool touches = most + change / 2 <= hot.touching;  // at the corners, too
    const Fineness& fine = hot.solid.is_convex() ? at_convex : elsewhere;
    if (!touches && change > fine.change * hot.reach && divisions < fine.divisions) {
      for (const Triangle& quarter : quarters(part)) {
        add(quarter, area / 4, divisions + 1, sum);
      }
      return;
    }
    for (std::size_t q = 0; q < points.size(); ++q) {
      sum += area * quadrature()[q].weight * hot.weight(distances[q]) * shares(points[q]);
    }
  }
};

/// Vector from an element's drawn layer to the other layer of a shell that has two, if its lattice particle lives.
std::optional<Eigen::Vector3d> lift_of(const Surface& surface, std::size_t element, const BodyHeatInput& input) {
  constexpr double least = 1e-6;  // of a cell's diagonal
  if (!surface.has_quads() || input.mass.data()[surface.lattice[element]] == 0) {
    return std::nullopt;
  }
  const std::array<PetscInt, 4>& cell = surface.cells[element];
  const PetscInt lattice = surface.lattice[element];
  const auto above = [&](const auto& x) {
    return Eigen::Vector3d(x.col(lattice) - (x.col(cell[0]) + x.col(cell[1]) + x.col(cell[2]) + x.col(cell[3])) / 4);
  };
  if (above(surface.rest).norm() <= least * (surface.rest.col(cell[2]) - surface.rest.col(cell[0])).norm()) {
    return std::nullopt;
  }
  return above(input.positions.values());
}

/// Whether no point of an element can be so near to the box round a body that it exchanges heat.
bool is_far(const Surface& surface, std::size_t element, const Field& positions, const HotSolid& hot,
            const std::optional<Eigen::Vector3d>& lift) {
  const Eigen::Vector3d first = positions.vector(surface.corner(element, 0));
  double radius = 0;
  for (std::size_t k = 1; k < static_cast<std::size_t>(surface.sides_per_element()); ++k) {
    radius = std::max(radius, (positions.vector(surface.corner(element, k)) - first).norm());
  }
  radius += lift ? lift->norm() : 0;
  return hot.box.exteriorDistance(hot.solid.pose.to_own(first)) > hot.farthest() + radius;
}

/// Divides the heat that a quad takes among its four corners: in the proportions of `given`, except that each corner
/// counts as if the active triangles of the quad had the same area.
/// @param given integrals of weight times fraction of the corners @param area of the quad's triangles, 0 of dead ones
Eigen::Vector4d divided(const Eigen::Vector4d& given, const Eigen::Vector4d& area) {
  Eigen::Vector4d result = Eigen::Vector4d::Zero();
  double sum_given = 0;
  double sum = 0;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const double before = area[(k + 3) % 4];
    if (given[k] > 0) {
      const int triangles = (before > 0 ? 1 : 0) + (area[k] > 0 ? 1 : 0);
      result[k] = given[k] * triangles / (before + area[k]);
    }
    sum_given += given[k];
    sum += result[k];
  }
  return result * (sum > 0 ? sum_given / sum : 0);
}

}  // namespace

bool exchange_heat(const std::map<std::string, BodyOptions>& bodies) {
  return std::any_of(bodies.begin(), bodies.end(),
                     [](const auto& body) { return body.second.temperature.has_value(); });
}

Eigen::VectorXd body_conductance(const Surface& surface, const Body& body, const BodyHeatInput& input) {
  const HotSolid hot{body.at(input.time), box_round(body.shape), body.margin + input.resting_gap, body.heat_reach};
  const std::size_t per_element = surface.triangles_per_element;
  Eigen::VectorXd integral = Eigen::VectorXd::Zero(surface.particles.local());
  for (std::size_t e = 0; e < surface.triangles.size() / per_element; ++e) {
    const std::optional<Eigen::Vector3d> lift = lift_of(surface, e, input);
    if (is_far(surface, e, input.positions, hot, lift)) {
      continue;
    }
    const DrawnPlaces places(surface, input.positions.data(), e);
    Eigen::Vector4d area = Eigen::Vector4d::Zero();
    Eigen::Vector4d of_corner = area;
    for (PetscInt k = 0; k < surface.triangles_per_element; ++k) {
      const std::size_t t = per_element * e + k;
      if (!input.active.triangles[t]) {
        continue;
      }
      const Triangle corners = places(surface.triangles[t]);
      const DrawnTriangle triangle{hot, corners, lift, surface.has_quads()};
      Eigen::Vector3d taken = Eigen::Vector3d::Zero();
      area[k] = triangle.area();
      triangle.add({Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()}, area[k], 0, taken);
      if (surface.has_quads()) {
        of_corner[k] += taken[0];
        of_corner[(k + 1) % 4] += taken[1];
        integral[surface.triangles[t][2]] += taken[2];
      } else {
        integral(surface.triangles[t]) += taken;
      }
    }
    if (surface.has_quads()) {
      integral(surface.cells[e]) += divided(of_corner, area);
    }
  }
  return body.heat_transfer * integral.head(surface.particles.owned);
}

BodyHeat exchange_with_bodies(Field& temperature, const Surface& surface, const std::vector<Body>& bodies,
                              const BodyHeatInput& input) {
  BodyHeat heat;
  for (const Body& body : bodies) {
    if (!body.temperature) {
      continue;
    }
    const Eigen::VectorXd conductance = body_conductance(surface, body, input);
    for (PetscInt i = 0; i < surface.particles.owned; ++i) {
      const double capacity = input.mass.data()[i] * input.capacity;
      if (capacity <= 0 || conductance[i] == 0) {
        continue;
      }
      double& value = temperature.data()[i];
      const double change = -std::expm1(-conductance[i] * input.h / capacity) * (*body.temperature - value);
      value += change;
      heat.gained += capacity * std::max(change, 0.0);
      heat.lost += capacity * std::max(-change, 0.0);
    }
  }
  temperature.update_ghosts();
  return heat;
}

}  // namespace pellicle::contact
