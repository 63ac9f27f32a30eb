#pragma once

#include <mpi.h>

#include <deque>
#include <limits>
#include <vector>

#include "geometry/solids.h"
#include "io/frame_series.h"
#include "world/options.h"

namespace pellicle {
inline namespace run {

/// A body or a ball of heat as frames show it.
struct BodyDrawing {
  FramePart part;  ///< "ball", "heat_flame", of an object "heat_paper_flame"
  Shape shape;
  RigidMotion motion;
  double from = 0;                                      ///< time at which it appears [s]
  double to = std::numeric_limits<double>::infinity();  ///< time at which it disappears [s]
};

/// The bodies of a run, and the balls of heat of all its objects. Collective. @throws Error as make_bodies does
/// @param objects the first has the run's bodies
std::vector<BodyDrawing> drawings_of_bodies(MPI_Comm comm, const std::deque<NamedOptions>& objects);

}  // namespace run
}  // namespace pellicle
