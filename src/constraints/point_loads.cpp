#include "constraints/point_loads.h"

#include <numeric>
#include <utility>

#include "base/error.h"
#include "geometry/key_points.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace constraints {

void describe(OptionTable& table, AttachmentOptions& options) {
  describe(table, static_cast<PinOptions&>(options));
  table.add("total_stiffness", options.total_stiffness)
      .unit("N/m")
      .more_than(0)
      .help("stiffness of all springs together; each has its vertex's share of the area")
      .source("docs/theory.md: parameters");
}

void describe(OptionTable& table, PushOptions& options) {
  describe(table, static_cast<SelectionOptions&>(options));
  table.add("force", options.force)
      .unit("s,N,N,N")
      .help(
          "key points (time, x, y, z) of the force in total, of which each vertex has its share of the area; linear "
          "between key points, constant before and after them");
}

PointLoads::PointLoads(const Surface& points, std::vector<double> areas,
                       const std::map<std::string, AttachmentOptions>& attachments,
                       const std::map<std::string, PushOptions>& forces, const std::vector<bool>* chosen)
    : points_(&points),
      areas_(std::move(areas)),
      loads_(attachments.size() + forces.size()),
      chosen_(chosen != nullptr ? *chosen : std::vector<bool>(loads_ * areas_.size())) {
  std::size_t load = 0;
  const auto shares_of = [&](const std::string& key, const SelectionOptions& selection) {
    if (chosen == nullptr) {
      const std::vector<bool> selected = select(points, key, selection);
      for (std::size_t i = 0; i < selected.size(); ++i) {
        chosen_[loads_ * i + load] = selected[i];
      }
    }
    return shares(load++);
  };
  for (const auto& [name, given] : attachments) {
    const std::string key = "attachments." + name;
    if (const std::string fault = fault_of_motion(given.path, given.velocity); !fault.empty()) {
      throw Error(key + fault);
    }
    std::vector<double> stiffness = shares_of(key, given);
    for (double& fraction : stiffness) {
      fraction *= given.total_stiffness;
    }
    attachments_.push_back({given.velocity, given.path, std::move(stiffness), Eigen::Vector3d::Zero()});
  }
  for (const auto& [name, given] : forces) {
    const std::string key = "forces." + name;
    if (given.force.empty()) {
      throw Error(key + ".force: no key points given, expected at least one: time, x, y, z");
    }
    if (const std::string fault = fault_of_key_points(given.force); !fault.empty()) {
      throw Error(key + ".force: " + fault);
    }
    pushes_.push_back({given.force, shares_of(key, given), Eigen::Vector3d::Zero()});
  }
}

std::vector<double> PointLoads::shares(std::size_t load) const {
  std::vector<double> result(areas_.size(), 0);
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = chosen_[loads_ * i + load] ? areas_[i] : 0;
  }
  const double total =
      sum_over_ranks(points_->comm(), std::accumulate(result.begin(), result.begin() + points_->particles.owned, 0.0));
  for (double& fraction : result) {
    fraction /= total;
  }
  return result;
}

void PointLoads::set_time(double time) {
  for (Attachment& attachment : attachments_) {
    attachment.displacement = place_of_motion(attachment.path, attachment.velocity, time);
  }
  for (Push& push : pushes_) {
    push.force = place_on_key_points(push.path, time);
  }
}

PointPotential PointLoads::at(PetscInt particle, const Eigen::Vector3d& x) const {
  const Eigen::Vector3d displacement = x - points_->rest.col(particle);
  PointPotential sum;
  for (const Attachment& attachment : attachments_) {
    const double stiffness = attachment.stiffness[particle];
    const Eigen::Vector3d stretch = displacement - attachment.displacement;
    sum.value += stiffness / 2 * stretch.squaredNorm();
    sum.gradient += stiffness * stretch;
    sum.hessian.diagonal().array() += stiffness;
  }
  for (const Push& push : pushes_) {
    sum.value -= push.fraction[particle] * push.force.dot(displacement);
    sum.gradient -= push.fraction[particle] * push.force;
  }
  return sum;
}

}  // namespace constraints
}  // namespace pellicle
