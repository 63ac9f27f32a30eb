#include "prism/material.h"

#include <cmath>

namespace pellicle::prism {

namespace {

/// Adds -k ln J^2 + lambda/8 (ln J^2)^2 with J^2 = d c.
void add_volumetric(double k, double lambda, double d, double c, EnergyDensity& psi) {
  const double log_j2 = std::log(d * c);
  const double slope = -k + lambda / 4 * log_j2;
  const double curvature = lambda / 4;
  psi.value += (-k + lambda / 8 * log_j2) * log_j2;
  psi.gradient[1] += slope / d;
  psi.gradient[2] += slope / c;
  psi.hessian[1][1] += (curvature - slope) / (d * d);
  psi.hessian[2][2] += (curvature - slope) / (c * c);
  psi.hessian[1][2] += curvature / (d * c);
}

void add_st_venant_kirchhoff(const Material& material, double t, double d, double c, EnergyDensity& psi) {
  const double mu = material.mu, lambda = material.lambda;
  const double trace = (t + c - 3) / 2;                                                 // tr E
  const double square = ((t - 2) * (t - 2) + 2 * (t - 1 - d) + (c - 1) * (c - 1)) / 4;  // E : E
  psi.value += mu * square + lambda / 2 * trace * trace;
  psi.gradient[0] += mu / 2 * (t - 1) + lambda / 2 * trace;
  psi.gradient[1] -= mu / 2;
  psi.gradient[2] += mu / 2 * (c - 1) + lambda / 2 * trace;
  psi.hessian[0][0] += mu / 2 + lambda / 4;
  psi.hessian[0][2] += lambda / 4;
  psi.hessian[2][2] += mu / 2 + lambda / 4;
}

void add_neo_hookean(const Material& material, double t, double d, double c, EnergyDensity& psi) {
  const double mu = material.mu;
  psi.value += mu / 2 * (t + c - 3);
  psi.gradient[0] += mu / 2;
  psi.gradient[2] += mu / 2;
  add_volumetric(mu / 2, material.lambda, d, c, psi);
}

void add_mooney_rivlin(const Material& material, double t, double d, double c, EnergyDensity& psi) {
  const double c1 = material.c1, c2 = material.c2;
  psi.value += c1 * (t + c - 3) + c2 * (d + c * t - 3);
  psi.gradient[0] += c1 + c2 * c;
  psi.gradient[1] += c2;
  psi.gradient[2] += c1 + c2 * t;
  psi.hessian[0][2] += c2;
  add_volumetric(c1 + 2 * c2, material.lambda, d, c, psi);
}

/// The even part h(y) = ((1 + z)^b + (1 - z)^b)/2 with y = z^2, and its derivatives by y.
struct EvenPower {
  double value, first, second;
};

/// The series sum_j binomial(b, 2j) y^j: for small y, of either sign, where the closed form divides by z.
EvenPower even_power_series(double b, double y) {
  EvenPower h{1, 0, 0};
  double coefficient = 1;
  double power = 1;  // y^(j - 2) for j >= 2
  for (int j = 1; j < 40; ++j) {
    coefficient *= (b - 2 * j + 2) * (b - 2 * j + 1) / ((2 * j) * (2 * j - 1));
    if (j == 1) {
      h.value += coefficient * y;
      h.first += coefficient;
      continue;
    }
    const double term = coefficient * power;
    h.second += j * (j - 1) * term;
    h.first += j * term * y;
    h.value += term * y * y;
    power *= y;
    if (std::abs(j * (j - 1) * term) <= 1e-17 * std::abs(h.second)) {
      break;
    }
  }
  return h;
}

/// The closed form. @param log_plus, log_minus of 1 + z and 1 - z
EvenPower even_power(double b, double z, double log_plus, double log_minus) {
  const double plus = std::exp(b * log_plus), minus = std::exp(b * log_minus);
  const double plus1 = plus * std::exp(-log_plus), minus1 = minus * std::exp(-log_minus);
  const double plus2 = plus1 * std::exp(-log_plus), minus2 = minus1 * std::exp(-log_minus);
  const double first = b * (plus1 - minus1) / (4 * z);
  return {(plus + minus) / 2, first, (b * (b - 1) * (plus2 + minus2) / (4 * z) - first / z) / (2 * z)};
}

/// Sums over the terms; l1^2, l2^2 = t/2 (1 +- z), so that l1^alpha + l2^alpha = 2 (t/2)^b h(y) with b = alpha/2.
void add_ogden(const Material& material, double t, double d, double c, EnergyDensity& psi) {
  const double rest = 4 * d / (t * t);  // 1 - y
  const double y = 1 - rest;
  // Below this the closed form would lose digits: h'' about 1e-16/z^3 of them. The series needs some 14 terms at most.
  const bool nearly_equal = y < 0.04;
  const double z = nearly_equal ? 0 : std::sqrt(y);
  const double log_plus = nearly_equal ? 0 : std::log1p(z);
  const double log_minus = nearly_equal ? 0 : std::log(rest / (1 + z));
  const double log_mean = std::log(t / 2), log_c = std::log(c);
  double half_mu = 0;  // of all terms
  for (std::size_t k = 0; k < material.ogden_alpha.size(); ++k) {
    const double b = material.ogden_alpha[k] / 2;
    const EvenPower h = nearly_equal ? even_power_series(b, y) : even_power(b, z, log_plus, log_minus);
    const double scale = material.ogden_mu[k] / material.ogden_alpha[k];
    const double c_power = std::exp(b * log_c);
    const double sum = 2 * scale * std::exp(b * log_mean);
    psi.value += sum * h.value + scale * (c_power - 3);
    psi.gradient[0] += sum / t * (b * h.value + 2 * rest * h.first);
    psi.gradient[1] -= 4 * sum / (t * t) * h.first;
    psi.gradient[2] += scale * b * c_power / c;
    psi.hessian[0][0] +=
        sum / (t * t) * (b * (b - 1) * h.value + (4 * b - 6) * rest * h.first + 4 * rest * rest * h.second);
    psi.hessian[0][1] += sum / (t * t * t) * ((8 - 4 * b) * h.first - 8 * rest * h.second);
    psi.hessian[1][1] += 16 * sum / (t * t * t * t) * h.second;
    psi.hessian[2][2] += scale * b * (b - 1) * c_power / (c * c);
    half_mu += material.ogden_mu[k] / 2;
  }
  add_volumetric(half_mu, material.lambda, d, c, psi);
}

SmallStrainModuli moduli_of_lame(const Material& material) { return {material.mu, material.lambda}; }

SmallStrainModuli moduli_of_mooney_rivlin(const Material& material) {
  return {2 * (material.c1 + material.c2), material.lambda + 4 * material.c2};
}

SmallStrainModuli moduli_of_ogden(const Material& material) {
  double shear = 0;
  for (std::size_t k = 0; k < material.ogden_mu.size(); ++k) {
    shear += material.ogden_mu[k] * material.ogden_alpha[k] / 2;
  }
  return {shear, material.lambda};
}

constexpr int volumetric_flops = 23;

}  // namespace

const std::vector<MaterialLaw>& material_laws() {
  // In the order in which messages name them.
  static const std::vector<MaterialLaw> laws{
      {"st_venant_kirchhoff", {MaterialConstant::mu}, true, "", moduli_of_lame, add_st_venant_kirchhoff, 36},
      {"neo_hookean", {MaterialConstant::mu}, false, "", moduli_of_lame, add_neo_hookean, 8 + volumetric_flops},
      {"mooney_rivlin",
       {MaterialConstant::c1, MaterialConstant::c2},
       false,
       "2 c1 + 2 c2",
       moduli_of_mooney_rivlin,
       add_mooney_rivlin,
       19 + volumetric_flops},
      {"ogden",
       {MaterialConstant::ogden},
       false,
       "half the sum of mu alpha",
       moduli_of_ogden,
       add_ogden,
       13 + volumetric_flops,
       91 + 2}};  // In closed form, and 2 a term for the sum of the moduli.
  return laws;
}

EnergyDensity energy_density(const Material& material, double t, double d, double c) {
  EnergyDensity psi;
  law_of(material).add_energy(material, t, d, c, psi);
  psi.hessian[1][0] = psi.hessian[0][1];
  psi.hessian[2][0] = psi.hessian[0][2];
  psi.hessian[2][1] = psi.hessian[1][2];
  return psi;
}

}  // namespace pellicle::prism
