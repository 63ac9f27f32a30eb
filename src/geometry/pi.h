#pragma once

#include "base/namespaces.h"

namespace pellicle::geometry {

constexpr double pi = 3.14159265358979323846;

}  // namespace pellicle::geometry
