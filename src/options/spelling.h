#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::options {

/// A word with its capital letters of ASCII made small.
std::string in_lower_case(std::string_view word);

/// Whether a text begins with another.
bool starts_with(std::string_view text, std::string_view start);

/// The parts one after the other, with the separator between them.
std::string join(const std::vector<std::string>& parts, const std::string& separator);

/// The number of letters inserted, removed, replaced or swapped with their neighbour that turn `a` into `b`.
int edit_distance(const std::string& a, const std::string& b);

/// The candidate with the smallest edit distance to `word`, the first of several; "" without candidates.
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace pellicle::options
