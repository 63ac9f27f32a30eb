#include "projection/pins.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <sstream>

#include "base/error.h"
#include "geometry/key_points.h"

namespace pellicle {

namespace {

/// The condition that a name such as "min_x_max_y" stands for: for each axis the lowest end, the highest, or neither.
struct Ends {
  std::array<int, 3> wanted{0, 0, 0};  ///< -1 lowest, 1 highest, 0 any
};

[[noreturn]] void refuse_corner(const std::string& key, const std::string& name) {
  throw Error(key + ": '" + name + "' names no corner, expected all, or ends such as max_y or min_x_max_y");
}

Ends parse_ends(const std::string& name, const std::string& key) {
  Ends ends;
  if (name == "all") {
    return ends;
  }
  std::istringstream words(name);
  std::string end;
  std::string axis;
  while (std::getline(words, end, '_')) {
    if (!std::getline(words, axis, '_') || (end != "min" && end != "max") || axis.size() != 1 || axis[0] < 'x' ||
        axis[0] > 'z') {
      refuse_corner(key, name);
    }
    ends.wanted[static_cast<std::size_t>(axis[0] - 'x')] = end == "min" ? -1 : 1;
  }
  return ends;
}

/// The smallest box round the chosen owned particles of all ranks; collective.
Eigen::AlignedBox3d bounds(const Sheet& sheet, const std::vector<bool>& chosen) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i]) {
      box.extend(sheet.rest.col(static_cast<Eigen::Index>(i)));
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, box.min().data(), 3, MPI_DOUBLE, MPI_MIN, sheet.comm());
  MPI_Allreduce(MPI_IN_PLACE, box.max().data(), 3, MPI_DOUBLE, MPI_MAX, sheet.comm());
  return box;
}

/// Marks owned particles for one pin; each selector must find something on some rank.
class Selection {
 public:
  Selection(const Sheet& sheet, std::string pin)
      : sheet_(sheet), pin_(std::move(pin)), chosen_(static_cast<std::size_t>(sheet.particles.owned), false) {}

  const std::vector<bool>& chosen() const { return chosen_; }

  template <class Condition>
  void add(const std::string& selector, const Condition& holds) {
    PetscInt found = 0;
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      if (holds(i)) {
        chosen_[static_cast<std::size_t>(i)] = true;
        ++found;
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, sheet_.comm());
    if (found == 0) {
      throw Error(pin_ + "." + selector + ": selects no particle of the sheet, expected at least one");
    }
  }

 private:
  const Sheet& sheet_;
  std::string pin_;
  std::vector<bool> chosen_;
};

std::vector<bool> select(const Sheet& sheet, const std::string& pin, const PinOptions& options) {
  Selection selection(sheet, pin);
  if (options.corners.empty() && options.box.empty() && options.vertices.empty() && options.group.empty()) {
    throw Error(pin + ": selects nothing, expected corners, box, vertices or group");
  }
  if (!options.corners.empty()) {
    const std::vector<bool> corners = geometric_corners(sheet);
    const Eigen::AlignedBox3d box = bounds(sheet, corners);
    const double tolerance = 1e-6 * (box.isEmpty() ? 0 : box.diagonal().norm());
    for (const std::string& name : options.corners) {
      const Ends ends = parse_ends(name, pin + ".corners");
      selection.add("corners: " + name, [&](PetscInt i) {
        bool holds = i < sheet.owned_corners && corners[static_cast<std::size_t>(i)];
        for (int axis = 0; holds && axis < 3; ++axis) {
          const int wanted = ends.wanted[static_cast<std::size_t>(axis)];
          const double end = wanted < 0 ? box.min()[axis] : box.max()[axis];
          holds = wanted == 0 || std::abs(sheet.rest(axis, i) - end) <= tolerance;
        }
        return holds;
      });
    }
  }
  if (!options.box.empty()) {
    const Eigen::Map<const Eigen::Vector3d> first(options.box.data());
    const Eigen::Map<const Eigen::Vector3d> second(options.box.data() + 3);
    const Eigen::AlignedBox3d box(first.cwiseMin(second), first.cwiseMax(second));
    selection.add("box", [&](PetscInt i) {
      const bool lattice = sheet.is_lattice[static_cast<std::size_t>(i)];
      return (options.layer == "both" || lattice == (options.layer == "lattice")) && box.contains(sheet.rest.col(i));
    });
  }
  for (const int id : options.vertices) {
    selection.add("vertices: " + std::to_string(id),
                  [&](PetscInt i) { return sheet.persistent_id[static_cast<std::size_t>(i)] == id; });
  }
  if (!options.group.empty()) {
    std::vector<bool> members(static_cast<std::size_t>(sheet.particles.local()), false);
    if (const auto group = sheet.groups.find(options.group); group != sheet.groups.end()) {
      for (const PetscInt i : group->second) {
        members[static_cast<std::size_t>(i)] = true;
      }
    }
    selection.add("group: " + options.group, [&](PetscInt i) { return members[static_cast<std::size_t>(i)]; });
  }
  return selection.chosen();
}

[[noreturn]] void refuse_second_pin(const std::string& key, const std::string& first, PetscInt id) {
  throw Error(key + ": particle " + std::to_string(id) + " is also held by pins." + first +
              ", expected each particle in one pin");
}

void require_valid_motion(const std::string& key, const PinOptions& options) {
  const std::string fault = fault_of_motion(options.path, options.velocity);
  if (!fault.empty()) {
    throw Error(key + fault);
  }
}

}  // namespace

void describe(OptionTable& table, PinOptions& options) {
  table.add("corners", options.corners)
      .help(
          "geometric corners of the sheet (vertices of one cell only): all, or those at an end of an axis, such as "
          "max_y or min_x_max_y");
  table.add("box", options.box)
      .unit("m")
      .length(6)
      .help("particles whose undeformed place is in the box between two points x,y,z,x,y,z");
  table.add("layer", options.layer).choices({"corners", "lattice", "both"}).help("which particles a box selects");
  table.add("vertices", options.vertices)
      .at_least(0)
      .help(
          "persistent ids: vertex numbers of the mesh, or, for lattice points, its number of vertices plus a cell "
          "number");
  table.add("group", options.group).help("named group of vertices in the mesh");
  table.add("velocity", options.velocity).unit("m/s").help("constant velocity; excludes a path");
  table.add("path", options.path)
      .unit("s,m,m,m")
      .help(
          "key points (time, x, y, z) of the displacement from the undeformed place; linear between key points, at "
          "rest before and after them");
}

std::vector<bool> geometric_corners(const Sheet& sheet) {
  Field cells(sheet.particles, 1);
  for (PetscInt cell = 0; cell < sheet.owned_cells; ++cell) {
    for (const PetscInt corner : sheet.cells[static_cast<std::size_t>(cell)]) {
      cells.values()(0, corner) += 1;
    }
  }
  cells.add_ghosts();
  std::vector<bool> corners(static_cast<std::size_t>(sheet.owned_corners));
  for (PetscInt i = 0; i < sheet.owned_corners; ++i) {
    corners[static_cast<std::size_t>(i)] = cells.values()(0, i) == 1;
  }
  return corners;
}

Pins::Pins(const Sheet& sheet, const std::map<std::string, PinOptions>& options)
    : sheet_(&sheet), pinned_(static_cast<std::size_t>(sheet.particles.local()), false) {
  Field pin_number(sheet.particles, 1);  // 0: free
  std::vector<std::string> names;
  for (const auto& [name, given] : options) {
    const std::string key = "pins." + name;
    require_valid_motion(key, given);
    const std::vector<bool> chosen = select(sheet, key, given);
    names.push_back(name);
    together(sheet.comm(), [&] {
      for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
        if (chosen[static_cast<std::size_t>(i)]) {
          double& number = pin_number.values()(0, i);
          if (number > 0) {
            refuse_second_pin(key, names[static_cast<std::size_t>(number) - 1],
                              sheet.persistent_id[static_cast<std::size_t>(i)]);
          }
          number = static_cast<double>(names.size());
        }
      }
    });
    pins_.push_back({given.velocity, given.path, {}});
  }
  pin_number.update_ghosts();
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    if (const auto number = static_cast<std::size_t>(pin_number.values()(0, i)); number > 0) {
      pins_[number - 1].particles.push_back(i);
      pinned_[static_cast<std::size_t>(i)] = true;
      global_count_ += i < sheet.particles.owned ? 1 : 0;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &global_count_, 1, MPIU_INT, MPI_SUM, sheet.comm());
}

void Pins::impose(Field& positions, double time) const {
  for (const Pin& pin : pins_) {
    const Eigen::Vector3d displacement =
        pin.path.empty() ? Eigen::Vector3d(pin.velocity * time) : place_on_key_points(pin.path, time);
    for (const PetscInt i : pin.particles) {
      positions.vector(i) = sheet_->rest.col(i) + displacement;
    }
  }
}

}  // namespace pellicle
