#pragma once

#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::io {

/// A grey picture.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<double> grey;  ///< in [0, 1], rows from the lower edge up
};

/// Reads a PNG file of any kind: 1 to 16 bits, grey, colour or palette, interlaced or not. Colours become the mean of
/// their channels; transparency is dropped, and no gamma is applied. Not collective.
/// @throws Error in one line if the file is missing, no PNG or damaged, or if the picture that its header announces has
/// more than 2^26 pixels (8192 x 8192) or does not fit in memory, which is found before it is decoded.
Picture read_png(const std::string& path);

}  // namespace pellicle::io
