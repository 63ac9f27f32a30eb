#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "energies/newton_options.h"
#include "options/choice.h"
#include "prism/material.h"

namespace pellicle::prism {

/// Law of the material of a part of the wall: the wall's, or 1 and the number of a law.
enum class RegionLaw : int { wall };
std::vector<std::string> names_of(RegionLaw);
inline Material::Law law_of(RegionLaw law, Material::Law of_wall) {
  return law == RegionLaw::wall ? of_wall : static_cast<Material::Law>(static_cast<int>(law) - 1);
}

/// A material as a deck gives it; `Number` is double, or std::optional<double> where values may be left out.
template <class Law, class Number>
struct MaterialOptions {
  Choice<Law> law;
  Number mu{};                            ///< [Pa]
  Number lambda{};                        ///< [Pa]
  Number c1{};                            ///< [Pa]
  Number c2{};                            ///< [Pa]
  std::vector<double> ogden_mu{};         ///< [Pa]
  std::vector<double> ogden_alpha{};      ///< as many as ogden_mu
  std::optional<double> young_modulus{};  ///< E, with nu in place of mu and lambda [Pa]
  std::optional<double> poisson_ratio{};  ///< nu
};

/// A part of the wall with other properties: one of the named objects `regions`. Several selectors add up; options that
/// are not given are those of the wall.
struct RegionOptions {
  std::string group;                                 ///< of the mesh: its faces, or the faces with all vertices in it
  std::vector<double> box;                           ///< two opposite points of a box round the centroids [m], or empty
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of a ball round the centroids [m]
  std::optional<double> radius;                      ///< of the ball [m], none: no ball
  std::optional<double> thickness;                   ///< [m]
  std::optional<double> density;                     ///< [kg/m^3]
  MaterialOptions<RegionLaw, std::optional<double>> material{RegionLaw::wall};
};

/// Rule for the wall's thickness (`prism.thickness`).
enum class WallThickness { global_volume, incompressible, plane_stress, fixed };
inline std::vector<std::string> names_of(WallThickness) {
  return {"global", "incompressible", "plane_stress", "fixed"};
}

/// none: the wall bears compression, and wrinkles of the size of elements; tension_field: relaxed as in metric_energy.
enum class Wrinkling { none, tension_field };
inline std::vector<std::string> names_of(Wrinkling) { return {"none", "tension_field"}; }

/// Bending resistance of the wall (`wall.bending`). by_wrinkling: plate, but none with tension_field, whose wrinkles
/// have no definite width.
enum class BendingModel { by_wrinkling, plate, none };
inline std::vector<std::string> names_of(BendingModel) { return {"by_wrinkling", "plate", "none"}; }

/// Material, thickness and bending of a balloon's wall.
struct WallOptions {
  Choice<BendingModel> bending = BendingModel::by_wrinkling;
  Choice<WallThickness> thickness_rule = WallThickness::incompressible;
  double thickness = 0.3e-3;                            ///< undeformed [m]
  std::string thickness_texture;                        ///< image file that gives the thickness instead; empty: none
  std::vector<double> thickness_range{0.1e-3, 0.5e-3};  ///< where the image is black and white [m]
  std::string thickness_field;                          ///< field of the mesh with the thickness instead [m]
  double density = 1000;                                ///< undeformed [kg/m^3]
  std::optional<double> strength;                       ///< at which the wall cracks [Pa]; none: ablation.strength
  /// Temperature at which the moduli hold, if they are proportional to temperature; none: they do not depend on it [K].
  std::optional<double> reference_temperature;
  Choice<Wrinkling> wrinkling = Wrinkling::none;
  double slack_tension = 1e-5;  ///< of tension_field: Material::tension as a fraction of the shear modulus
  MaterialOptions<Material::Law, double> material{"neo_hookean", 4e5, 0, 2e5, 2e4, {6.3e5, 1.2e3, -1e4}, {1.3, 5, -2}};
  std::map<std::string, RegionOptions> regions;

  bool has_tension_field() const { return wrinkling == Wrinkling::tension_field; }
  bool bends() const {
    return bending == BendingModel::plate || (bending == BendingModel::by_wrinkling && !has_tension_field());
  }
};

/// Declares `prism.thickness`, the options `wall.*` and the named objects `regions`.
void describe(OptionTable& table, WallOptions& options);

/// Tangent of the elements. exact: from the metric; gradient: from F, director varied; paper: director left out.
enum class ElementTangent { exact, gradient, paper };
inline std::vector<std::string> names_of(ElementTangent) { return {"exact", "gradient", "paper"}; }

/// The implicit step of a balloon (balloon paper, sections 4 and 6); solver options of PETSc have the prefix `prism_`.
struct PrismOptions : NewtonOptions {
  PrismOptions() { solver_prefix = "prism_"; }

  Choice<ElementTangent> tangent = ElementTangent::exact;
  bool positive_elements = true;  ///< compressive stresses are left out of the geometric stiffness
  bool inertia = true;            ///< false: quasi-static; the damping remains, as drag
  double mass_damping = 20;       ///< C = mass_damping M + stiffness_damping K [1/s]
  double stiffness_damping = 0;   ///< [s]
};

void describe(OptionTable& table, PrismOptions& options);

/// Rules of VolumePreservation for the correction.
enum class VolumeRule { mass, printed, muller06 };
inline std::vector<std::string> names_of(VolumeRule) { return {"mass", "printed", "muller06"}; }

/// Preservation of the rubber's volume after a step (balloon paper, section 7).
struct VolumeOptions {
  Choice<VolumeRule> rule = VolumeRule::mass;
  double tolerance = 1e-9;  ///< of |C| relative to the undeformed volume
  int max_iterations = 30;  ///< corrections; the paper's: 1
};

void describe(OptionTable& table, VolumeOptions& options);

}  // namespace pellicle::prism
