#pragma once

namespace pellicle {
inline namespace geometry {

constexpr double pi = 3.14159265358979323846;

}  // namespace geometry
}  // namespace pellicle
