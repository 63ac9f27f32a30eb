#include "world/textures.h"

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

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

}  // namespace world
}  // namespace pellicle
