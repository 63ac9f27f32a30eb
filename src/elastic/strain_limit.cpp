#include "elastic/strain_limit.h"

#include <algorithm>
#include <cmath>

namespace pellicle {
inline namespace elastic {

double StrainLimit::fraction(double length, double target) const {
  const double strain = length / target - 1;
  if (strain < 0 && largest >= 1) {
    return 0;
  }
  return (std::abs(strain) / largest - begins) / (1 - begins);
}

StrainLimit::Law StrainLimit::at(double length, double target) const {
  const double u = fraction(length, target);
  if (u <= 0) {
    return {};
  }
  const double at = std::min(u, exact_to);
  const double left = 1 - at;
  const double second = 6 * at / (left * left * left * left);                          // B''
  const double first = at * at * (3 - at) / (left * left * left) + second * (u - at);  // B'
  const double value = at * at * at / (left * left) + (first - second * (u - at) / 2) * (u - at);
  const double width = (1 - begins) * largest * target;  // l w
  const double direction = length > target ? 1 : -1;
  return {stiffness * width * width * value, direction * stiffness * width * first, stiffness * second};
}

}  // namespace elastic
}  // namespace pellicle
