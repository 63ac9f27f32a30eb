#include "io/texture.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "base/error.h"

namespace pellicle {

Texture Texture::read(MPI_Comm comm, const std::string& path) {
  Texture texture;
  on_root(comm, [&] {
    if (!std::filesystem::is_regular_file(path)) {
      throw Error(path + ": no such file: expected a PNG texture");
    }
    vtkNew<vtkPNGReader> reader;
    const int warnings = vtkObject::GetGlobalWarningDisplay();
    vtkObject::GlobalWarningDisplayOff();
    const bool is_png = reader->CanReadFile(path.c_str()) != 0;
    if (is_png) {
      reader->SetFileName(path.c_str());
      reader->Update();
    }
    vtkObject::SetGlobalWarningDisplay(warnings);
    vtkDataArray* pixels = is_png ? reader->GetOutput()->GetPointData()->GetScalars() : nullptr;
    const int* size = reader->GetOutput()->GetDimensions();
    if (pixels == nullptr || reader->GetErrorCode() != 0 || size[0] < 1 || size[1] < 1) {
      throw Error(path + ": not a PNG picture that can be decoded");
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
