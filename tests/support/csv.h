#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace pellicle {

/// Columns of a CSV file by name, without the unit that may follow it in brackets.
inline std::map<std::string, std::vector<double>> read_csv(const std::filesystem::path& path) {
  std::map<std::string, std::vector<double>> columns;
  std::ifstream file(path);
  std::vector<std::string> names;
  std::string line;
  std::getline(file, line);
  std::istringstream head(line);
  for (std::string name; std::getline(head, name, ',');) {
    names.push_back(name.substr(0, name.find(" [")));
    columns[names.back()];
  }
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::size_t column = 0;
    for (std::string word; std::getline(row, word, ','); ++column) {
      columns.at(names.at(column)).push_back(std::stod(word));
    }
    if (column != names.size()) {
      throw std::runtime_error(path.string() + ": a row of " + std::to_string(column) + " values: " + line);
    }
  }
  return columns;
}

}  // namespace pellicle
