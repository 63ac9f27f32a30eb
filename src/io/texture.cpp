#include "io/texture.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/error.h"

namespace pellicle {

namespace {

/// Whether a file is a PNG whose chunks are all there with the right check sums. VTK 9.1 crashes on any other, because
/// libpng's error handler jumps into a function that has returned.
bool is_intact_png(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string signature = "\x89PNG\r\n\x1a\n";
  if (bytes.compare(0, signature.size(), signature) != 0) {
    return false;
  }
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const auto number = [data](std::size_t at) {
    return std::uint32_t{data[at]} << 24 | std::uint32_t{data[at + 1]} << 16 | std::uint32_t{data[at + 2]} << 8 |
           std::uint32_t{data[at + 3]};
  };
  // A chunk: length of its data, type, data, check sum of type and data.
  for (std::size_t at = signature.size(); at + 12 <= bytes.size();) {
    const std::size_t length = number(at);
    if (bytes.size() - at - 12 < length ||
        crc32(0, data + at + 4, static_cast<uInt>(length + 4)) != number(at + 8 + length)) {
      return false;
    }
    if (bytes.compare(at + 4, 4, "IEND") == 0) {
      return true;
    }
    at += 12 + length;
  }
  return false;
}

}  // namespace

Texture Texture::read(MPI_Comm comm, const std::string& path) {
  Texture texture;
  on_root(comm, [&] {
    if (!std::filesystem::is_regular_file(path)) {
      throw Error(path + ": no such file: expected a PNG texture");
    }
    if (!is_intact_png(path)) {
      throw Error(path + ": expected a PNG picture: the file is damaged or something else");
    }
    vtkNew<vtkPNGReader> reader;
    reader->SetFileName(path.c_str());
    reader->Update();
    vtkDataArray* pixels = reader->GetOutput()->GetPointData()->GetScalars();
    const int* size = reader->GetOutput()->GetDimensions();
    if (pixels == nullptr || reader->GetErrorCode() != 0) {
      throw Error(path + ": a PNG picture that VTK cannot decode");
    }
    texture.width_ = size[0];
    texture.height_ = size[1];
    // One or three channels of colour; a second or fourth one is transparency.
    const int channels = pixels->GetNumberOfComponents() >= 3 ? 3 : 1;
    const double white = pixels->GetDataTypeMax();
    for (vtkIdType i = 0; i < pixels->GetNumberOfTuples(); ++i) {
      double sum = 0;
      for (int channel = 0; channel < channels; ++channel) {
        sum += pixels->GetComponent(i, channel);
      }
      texture.values_.push_back(sum / (channels * white));
    }
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

}  // namespace pellicle
