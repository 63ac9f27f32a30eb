#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/shared_folder.h"

namespace pellicle {

constexpr double tolerance = 1e-9;  // relative to the largest expected value

/// The folder of the cases of an independent implementation: NAME.obj is the mesh, NAME.params.json the input,
/// NAME.expected.json the result (JSON is YAML).
inline std::filesystem::path reference_folder() {
  const char* named = std::getenv("PELLICLE_REFERENCE");
  return named != nullptr ? std::filesystem::path(named) : shared_folder() / "reference";
}

/// Names of the cases that begin with `kind`.
inline std::vector<std::string> cases_of(const std::string& kind) {
  std::vector<std::string> names;
  std::error_code no_folder;
  for (const auto& entry : std::filesystem::directory_iterator(reference_folder(), no_folder)) {
    const std::string file = entry.path().filename().string();
    const std::string ending = ".params.json";
    if (file.rfind(kind, 0) == 0 && file.size() > ending.size() &&
        file.compare(file.size() - ending.size(), ending.size(), ending) == 0) {
      names.push_back(file.substr(0, file.size() - ending.size()));
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace pellicle
