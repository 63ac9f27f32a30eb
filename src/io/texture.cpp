#include "io/texture.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::io {

Texture Texture::read(MPI_Comm comm, const std::string& path) {
  Texture texture;
  on_root(comm, [&] { texture = read_png(path); });
  MPI_Bcast(&texture.width, 1, MPI_INT, 0, comm);
  MPI_Bcast(&texture.height, 1, MPI_INT, 0, comm);
  texture.grey.resize(static_cast<std::size_t>(texture.width) * static_cast<std::size_t>(texture.height));
  MPI_Bcast(texture.grey.data(), static_cast<int>(texture.grey.size()), MPI_DOUBLE, 0, comm);
  return texture;
}

double Texture::sample(double u, double v) const {
  const double x = std::clamp(u, 0.0, 1.0) * width - 0.5;
  const double y = std::clamp(v, 0.0, 1.0) * height - 0.5;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const double right = x - column;
  const double up = y - row;
  const auto pixel = [this](int at_column, int at_row) {
    return grey[std::clamp(at_row, 0, height - 1) * static_cast<std::ptrdiff_t>(width) +
                std::clamp(at_column, 0, width - 1)];
  };
  return (1 - up) * ((1 - right) * pixel(column, row) + right * pixel(column + 1, row)) +
         up * ((1 - right) * pixel(column, row + 1) + right * pixel(column + 1, row + 1));
}

std::vector<double> Textures::values(const Eigen::Matrix2Xd& uv, const std::string& key, const std::string& file,
                                     const std::vector<double>& range) {
  if (file.empty()) {
    return {};
  }
  if (!on_any_rank(comm_, uv.cols() > 0)) {
    throw Error(key + ": " + file + " needs texture coordinates, and the mesh has none");
  }
  auto texture = read_.find(file);
  if (texture == read_.end()) {
    texture = read_.emplace(file, Texture::read(comm_, file)).first;
  }
  std::vector<double> values;
  for (Eigen::Index i = 0; i < uv.cols(); ++i) {
    values.push_back(range[0] + (range[1] - range[0]) * texture->second.sample(uv(0, i), uv(1, i)));
  }
  return values;
}

}  // namespace pellicle::io
