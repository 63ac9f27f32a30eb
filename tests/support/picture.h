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
  const auto along = [](double share) { return std::clamp(2 * share - 0.5, 0.0, 1.0); };
  return (100 * along(u) + 155 * along(v)) / 255;
}

/// Writes a PNG of two by two grey pixels into a folder. Collective. @returns its path
inline std::string write_picture(const TestFolder& folder) {
  const std::string path = folder / "picture.png";
  if (folder.rank() == 0) {
    vtkNew<vtkImageData> image;
    image->SetDimensions(2, 2, 1);
    image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
    for (const auto& [column, row] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
      image->SetScalarComponentFromDouble(column, row, 0, 0, 100 * column + 155 * row);
    }
    vtkNew<vtkPNGWriter> writer;
    writer->SetFileName(path.c_str());
    writer->SetInputData(image);
    writer->Write();
  }
  MPI_Barrier(MPI_COMM_WORLD);
  return path;
}

}  // namespace pellicle
