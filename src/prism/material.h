#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "options/choice.h"

namespace pellicle::prism {

/// A hyperelastic, isotropic material of the wall.
///
/// Energy per undeformed volume as a function of t = trace and d = determinant of the in-plane right Cauchy-Green
/// tensor and of c = (h/h0)^2, so that I1 = t + c, I2 = d + c t, J^2 = d c:
/// - St. Venant-Kirchhoff: mu E:E + lambda/2 (tr E)^2 (balloon paper, eq. 6)
/// - neo-Hookean: mu/2 (I1 - 3 - ln J^2) + lambda/8 (ln J^2)^2
/// - Mooney-Rivlin: c1 (I1 - 3) + c2 (I2 - 3) - (c1 + 2 c2) ln J^2 + lambda/8 (ln J^2)^2
/// - Ogden: sum_k mu_k/alpha_k (l1^alpha_k + l2^alpha_k + l3^alpha_k - 3 - alpha_k ln J) + lambda/8 (ln J^2)^2, l_i the
///   principal stretches
/// In an element that keeps its volume J = 1, and the terms in ln J vanish.
struct Material {
  enum class Law : int {};  ///< number of a law among material_laws(); of a name: Choice<Law>(name)

  Law law = Choice<Law>("neo_hookean");
  double mu = 4e5;                  ///< shear modulus: St. Venant-Kirchhoff, neo-Hookean [Pa]
  double lambda = 0;                ///< Lame's first parameter, all laws [Pa]
  double c1 = 0;                    ///< Mooney-Rivlin [Pa]
  double c2 = 0;                    ///< Mooney-Rivlin [Pa]
  std::vector<double> ogden_mu;     ///< [Pa]
  std::vector<double> ogden_alpha;  ///< exponents, as many as ogden_mu
  bool wrinkles = false;            ///< whether metric_energy is relaxed by tension-field theory
  double tension = 0;               ///< if the wall wrinkles: its undeformed stress in metric_energy [Pa]
};

/// The moduli of a material at small strain.
struct SmallStrainModuli {
  double shear = 0;   ///< mu [Pa]
  double lambda = 0;  ///< Lame's first parameter [Pa]
};

/// The constants that a law may have beside lambda, which all have.
enum class MaterialConstant { mu, c1, c2, ogden };

/// A law of hyperelastic materials: what decks, checks, elements and the log know of it.
struct MaterialLaw {
  std::string name;  ///< in decks
  std::vector<MaterialConstant> constants;
  bool needs_lambda;        ///< whether lambda matters, too, where the element keeps its volume
  std::string shear_words;  ///< how its shear modulus follows from its constants, for a message; empty: it is mu
  SmallStrainModuli (*moduli)(const Material& material);
  /// Adds psi and the upper half of its second derivative.
  void (*add_energy)(const Material& material, double t, double d, double c, struct EnergyDensity& psi);
  int flops;              ///< of add_energy: sums, products, quotients, roots, logarithms and powers, one each
  int flops_of_term = 0;  ///< in addition, of each of Ogden's terms

  bool has(MaterialConstant constant) const {
    return std::find(constants.begin(), constants.end(), constant) != constants.end();
  }
};
/// All laws.
const std::vector<MaterialLaw>& material_laws();
inline std::vector<std::string> names_of(Material::Law) { return names_in(material_laws()); }
inline const MaterialLaw& law_of(const Material& material) {
  return material_laws()[static_cast<std::size_t>(material.law)];
}

inline SmallStrainModuli small_strain_moduli(const Material& material) { return law_of(material).moduli(material); }

/// psi and its derivatives by (t, d, c), in this order.
struct EnergyDensity {
  double value = 0;           ///< psi [Pa]
  double gradient[3] = {};    ///< [Pa]
  double hessian[3][3] = {};  ///< [Pa], symmetric
};

/// psi at a state. @param t > 0 @param d in 0 < d <= t^2/4 @param c > 0
EnergyDensity energy_density(const Material& material, double t, double d, double c);

/// Operations of energy_density, as PETSc counts (MaterialLaw::flops).
inline int energy_density_flops(const Material& material) {
  const MaterialLaw& law = law_of(material);
  return law.flops + law.flops_of_term * static_cast<int>(material.ogden_alpha.size());
}

}  // namespace pellicle::prism
