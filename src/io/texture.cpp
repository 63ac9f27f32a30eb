#include "io/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "io/png_reader.h"

namespace pellicle {
inline namespace io {

Texture Texture::read(MPI_Comm comm, const std::string& path) {
  Texture texture;
  on_root(comm, [&] {
    Picture picture = read_png(path);
    texture.width_ = picture.width;
    texture.height_ = picture.height;
    texture.values_ = std::move(picture.grey);
  });
  std::array<int, 2> size{texture.width_, texture.height_};
  MPI_Bcast(size.data(), 2, MPI_INT, 0, comm);
  texture.width_ = size[0];
  texture.height_ = size[1];
  texture.values_.resize(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]));
  MPI_Bcast(texture.values_.data(), static_cast<int>(texture.values_.size()), MPI_DOUBLE, 0, comm);
  return texture;
}

double Texture::pixel(int column, int row) const {
  column = std::clamp(column, 0, width_ - 1);
  row = std::clamp(row, 0, height_ - 1);
  return values_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column)];
}

double Texture::sample(double u, double v) const {
  const double x = std::clamp(u, 0.0, 1.0) * width_ - 0.5;
  const double y = std::clamp(v, 0.0, 1.0) * height_ - 0.5;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const double right = x - column;
  const double up = y - row;
  return (1 - up) * ((1 - right) * pixel(column, row) + right * pixel(column + 1, row)) +
         up * ((1 - right) * pixel(column, row + 1) + right * pixel(column + 1, row + 1));
}

}  // namespace io
}  // namespace pellicle
