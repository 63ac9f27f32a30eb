#include "constraints/point_loads.h"

#include <numeric>
#include <utility>

#include "base/error.h"
#include "geometry/key_points.h"
#include "parallel/collective.h"

namespace pellicle::constraints {

void describe(OptionTable& table, AttachmentOptions& options) {
  describe(table, static_cast<PinOptions&>(options));
  table.add("total_stiffness", options.total_stiffness, Rules("N/m").more_than(0),
            "stiffness of all springs together; each has its vertex's share of the area", "docs/theory.md: parameters");
}

void describe(OptionTable& table, PushOptions& options) {
  describe(table, static_cast<SelectionOptions&>(options));
  table.add("force", options.force, Rules("s,N,N,N"),
            "key points (time, x, y, z) of the force in total, of which each vertex has its share of the area; linear "
            "between key points, constant before and after them");
}

PointLoads::PointLoads(const Surface& points, const std::vector<double>& areas,
                       const std::map<std::string, AttachmentOptions>& attachments,
                       const std::map<std::string, PushOptions>& forces, const std::vector<bool>* chosen)
    : points_(&points) {
  const std::size_t loads = attachments.size() + forces.size();
  chosen_ = chosen != nullptr ? *chosen : std::vector<bool>(loads * areas.size());
  std::size_t load = 0;
  // Share of each local particle in the area on which the next load acts; 0: it does not act there. Collective.
  const auto next_shares = [&](const std::string& key, const SelectionOptions& selection) {
    const std::vector<bool> selected = chosen == nullptr ? select(points, key, selection) : std::vector<bool>();
    std::vector<double> shares(areas.size(), 0);
    for (std::size_t i = 0; i < shares.size(); ++i) {
      if (chosen == nullptr) {
        chosen_[loads * i + load] = selected[i];
      }
      shares[i] = chosen_[loads * i + load] ? areas[i] : 0;
    }
    ++load;
    const double total =
        sum_over_ranks(points.comm(), std::accumulate(shares.begin(), shares.begin() + points.particles.owned, 0.0));
    for (double& share : shares) {
      share /= total;
    }
    return shares;
  };
  for (const auto& [name, given] : attachments) {
    const std::string key = "attachments." + name;
    refuse_fault(key, fault_of_motion(given.path, given.velocity));
    std::vector<double> stiffness = next_shares(key, given);
    for (double& fraction : stiffness) {
      fraction *= given.total_stiffness;
    }
    attachments_.push_back({given, std::move(stiffness), Eigen::Vector3d::Zero()});
  }
  for (const auto& [name, given] : forces) {
    const std::string key = "forces." + name;
    if (given.force.empty()) {
      throw Error(key + ".force: no key points given, expected at least one: time, x, y, z");
    }
    refuse_fault(key + ".force: ", fault_of_key_points(given.force));
    pushes_.push_back({given.force, next_shares(key, given), Eigen::Vector3d::Zero()});
  }
}

void PointLoads::set_time(double time) {
  for (Attachment& attachment : attachments_) {
    attachment.displacement = place_of_motion(attachment.options.path, attachment.options.velocity, time);
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

}  // namespace pellicle::constraints
