#pragma once

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>

#include <algorithm>
#include <string>

#include "tests/io/files.h"

namespace pellicle {

/// Brightness at texture coordinates of the picture that `write_picture` writes: black in the lower left corner, white
/// in the upper right one, linear between the centres of its pixels and unlike in both directions.
inline double brightness(double u, double v) {
  const auto along = [](double fraction) { return std::clamp(2 * fraction - 0.5, 0.0, 1.0); };
  return (100 * along(u) + 155 * along(v)) / 255;
}

/// Writes a PNG of grey pixels into a folder. Collective. @returns its path
/// @param grey of a column and a row, 0 to 255
template <class Grey>
std::string write_picture(const TestFolder& folder, int columns, int rows, const Grey& grey) {
  const std::string path = folder / "picture.png";
  if (folder.rank() == 0) {
    vtkNew<vtkImageData> image;
    image->SetDimensions(columns, rows, 1);
    image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    for (int pixel = 0; pixel < columns * rows; ++pixel) {
      const int column = pixel % columns;
      const int row = pixel / columns;
      image->SetScalarComponentFromDouble(column, row, 0, 0, grey(column, row));
    }
    vtkNew<vtkPNGWriter> writer;
    writer->SetFileName(path.c_str());
    writer->SetInputData(image);
    writer->Write();
  }
  MPI_Barrier(MPI_COMM_WORLD);
  return path;
}

/// The picture of two by two pixels that `brightness` tells of. Collective. @returns its path
inline std::string write_picture(const TestFolder& folder) {
  return write_picture(folder, 2, 2, [](int column, int row) { return 100 * column + 155 * row; });
}

}  // namespace pellicle
