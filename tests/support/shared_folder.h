#pragma once

#include <cstdlib>
#include <filesystem>

namespace pellicle {

/// Folder of real meshes and reference cases that lies beside a checkout, or where PELLICLE_SHARED says. It may be
/// absent: a test that needs it is skipped then.
inline std::filesystem::path shared_folder() {
  const char* named = std::getenv("PELLICLE_SHARED");
  return named != nullptr ? std::filesystem::path(named) : std::filesystem::path(PELLICLE_SOURCE_DIR) / ".." / "shared";
}

}  // namespace pellicle
