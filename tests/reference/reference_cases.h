#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/shared_folder.h"

namespace pellicle {

constexpr double tolerance = 1e-9;  // relative to the largest expected value

/// The folder beside the checkout with cases of an independent implementation: NAME.obj is the mesh, NAME.params.json
/// the input, NAME.expected.json the result (JSON is YAML).
inline std::filesystem::path reference_folder() {
  const char* named = std::getenv("PELLICLE_REFERENCE");
  return named != nullptr ? std::filesystem::path(named) : shared_folder() / "reference";
}

/// The cases that this project has itself: burning_strip.py writes them.
inline std::filesystem::path own_cases() {
  return std::filesystem::path(PELLICLE_SOURCE_DIR) / "tests" / "reference" / "cases";
}

/// The cases that begin with `kind`, in both folders: the paths of their files without .params.json and so on.
inline std::vector<std::string> cases_of(const std::string& kind) {
  std::vector<std::string> cases;
  for (const std::filesystem::path& folder : {own_cases(), reference_folder()}) {
    std::error_code no_folder;
    for (const auto& entry : std::filesystem::directory_iterator(folder, no_folder)) {
      const std::string file = entry.path().filename().string();
      const std::string ending = ".params.json";
      if (file.rfind(kind, 0) == 0 && file.size() > ending.size() &&
          file.compare(file.size() - ending.size(), ending.size(), ending) == 0) {
        cases.push_back((folder / file.substr(0, file.size() - ending.size())).string());
      }
    }
  }
  std::sort(cases.begin(), cases.end());
  return cases;
}

}  // namespace pellicle
