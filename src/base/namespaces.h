#pragma once

/// Every folder of src has a namespace of its name, whose names are those of pellicle, too.
namespace pellicle {
inline namespace ablation {}
inline namespace air {}
inline namespace base {}
inline namespace combustion {}
inline namespace constraints {}
inline namespace contact {}
inline namespace elastic {}
inline namespace energies {}
inline namespace equilibrium {}
inline namespace gas {}
inline namespace geometry {}
inline namespace heat {}
inline namespace io {}
inline namespace linear {}
inline namespace meshing {}
inline namespace options {}
inline namespace parallel {}
inline namespace prism {}
inline namespace projection {}
inline namespace run {}
inline namespace state {}
inline namespace surface {}
inline namespace world {}
}  // namespace pellicle
