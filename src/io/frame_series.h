#pragma once

#include <mpi.h>
#include <vtkSmartPointer.h>

#include <string>
#include <utility>
#include <vector>

class vtkMultiProcessController;
class vtkPolyData;

namespace pellicle {

/// Frames of one name for ParaView: DIRECTORY/NAME.pvd names one .pvtp a frame, which names one .vtp a rank (VTK XML,
/// appended LZ4 data). The .pvd is complete after every frame, so that it can be opened during the run.
class FrameSeries {
 public:
  /// Touches no file. Collective.
  FrameSeries(MPI_Comm comm, std::string directory, std::string name);
  ~FrameSeries();
  FrameSeries(const FrameSeries&) = delete;
  FrameSeries& operator=(const FrameSeries&) = delete;

  bool empty() const { return frames_.empty(); }

  /// Makes the directory and removes the frames of an older run of this name. Collective. @throws Error, on all ranks.
  void start();

  /// Writes this rank's piece of a frame. Collective. @throws Error, on all ranks, when a file cannot be written.
  void write(vtkPolyData* piece, double time);

 private:
  void write_pieces(vtkPolyData* piece, const std::string& file);

  MPI_Comm comm_;  ///< VTK keeps a pointer to it
  int rank_ = 0;
  int ranks_ = 1;
  std::string directory_;
  std::string name_;
  vtkSmartPointer<vtkMultiProcessController> controller_;
  std::vector<std::pair<double, std::string>> frames_;  ///< time [s], file
};

}  // namespace pellicle
