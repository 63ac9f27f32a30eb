#include "world/world.h"

#include <algorithm>
#include <utility>

#include "world/non_finite.h"

namespace pellicle {
inline namespace world {

namespace {

std::vector<FramePart> parts_of(const std::vector<World::Member>& members) {
  std::vector<FramePart> parts;
  for (const World::Member& member : members) {
    parts.push_back({member.name, key_of(member.name)});
  }
  return parts;
}

std::vector<FramePart> parts_of(const std::vector<BodyDrawing>& bodies) {
  std::vector<FramePart> parts;
  for (const BodyDrawing& body : bodies) {
    parts.push_back(body.part);
  }
  return parts;
}

}  // namespace

World::World(OutputFolder& folder, const OutputOptions& options, std::vector<Member> members,
             const std::vector<GroupPlan>& groups, std::vector<BodyDrawing> bodies)
    : comm_(folder.comm()),
      members_(std::move(members)),
      bodies_(std::move(bodies)),
      writer_(folder, options, parts_of(members_), parts_of(bodies_)),
      fields_are_to_be_checked_(!options.fields.empty()) {
  writer_.reserve_names();
  for (const GroupPlan& plan : groups) {
    std::vector<std::pair<Object*, StageClock*>> objects;
    for (const std::size_t i : plan.objects) {
      objects.emplace_back(members_[i].object.get(), members_[i].clock.get());
    }
    groups_.push_back(std::make_unique<Group>(plan, objects, folder));
  }
}

std::vector<std::pair<std::string, const StageClock*>> World::clocks() const {
  std::vector<std::pair<std::string, const StageClock*>> clocks;
  for (const Member& member : members_) {
    clocks.emplace_back(member.name, member.clock.get());
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    if (group->clock() != nullptr) {
      clocks.emplace_back("together", group->clock());
    }
  }
  return clocks;
}

double World::time() const {
  double time = members_.front().object->state().time;
  for (const Member& member : members_) {
    time = std::max(time, static_cast<const Object&>(*member.object).state().time);
  }
  return time;
}

int World::step() const {
  PetscInt step = 0;
  for (const Member& member : members_) {
    step = std::max(step, member.object->state().step);
  }
  return static_cast<int>(step);
}

StepResult World::advance(double h) {
  StepResult all;
  for (const std::unique_ptr<Group>& group : groups_) {
    const StepResult result = group->advance(h);
    all.iterations += result.iterations;
    all.newton_iterations += result.newton_iterations;
    all.converged = result.converged;
    all.reason = result.reason;
    all.figures += (all.figures.empty() || result.figures.empty() ? "" : ", ") + result.figures;
    if (result.step_error) {
      all.step_error = std::max(*result.step_error, all.step_error.value_or(0));
    }
    if (!all.converged) {
      break;
    }
  }
  return all;
}

void World::accept(double time) {
  for (const Member& member : members_) {
    if (is_present(member)) {
      member.object->accept(time);
    }
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    group->accept();
  }
}

void World::keep() {
  for (const std::unique_ptr<Group>& group : groups_) {
    if (group->clock() != nullptr) {
      group->clock()->start_lap();
    }
  }
  for (const Member& member : members_) {
    member.clock->start_lap();
    member.object->keep();
  }
}

void World::restore() {
  for (const Member& member : members_) {
    member.object->restore();
  }
}

std::string World::ended() const {
  std::string reasons;
  bool goes_on = false;
  for (const Member& member : members_) {
    const std::string reason = member.object->ended();
    goes_on = goes_on || reason.empty();
    reasons += reason.empty() ? "" : (reasons.empty() ? "" : "; ") + heading_of(member.name) + reason;
    if (!reason.empty() && !member.object->is_gone()) {
      return heading_of(member.name) + reason;
    }
  }
  return goes_on ? "" : reasons;
}

std::vector<std::string> World::gather(std::vector<std::string> (Object::*lines)() const) const {
  std::vector<std::string> all;
  for (const Member& member : members_) {
    for (const std::string& line : ((*member.object).*lines)()) {
      all.push_back(heading_of(member.name) + line);
    }
  }
  return all;
}

std::vector<std::string> World::first_remarks() const {
  std::vector<std::string> lines = gather(&Object::first_remarks);
  for (const std::unique_ptr<Group>& group : groups_) {
    for (const std::string& line : group->first_remarks()) {
      lines.push_back(line);
    }
  }
  return lines;
}

void World::check_chosen_fields() {
  if (!std::exchange(fields_are_to_be_checked_, false)) {
    return;
  }
  std::vector<std::string> known;
  for (const Member& member : members_) {
    member.object->draw([&known](const Frame& frame) {
      for (const std::string& name : field_names(frame)) {
        if (std::find(known.begin(), known.end(), name) == known.end()) {
          known.push_back(name);
        }
      }
      return false;
    });
  }
  writer_.require_chosen_fields(known);
}

void World::draw() {
  if (!writer_.lacks(step())) {
    return;
  }
  check_chosen_fields();
  auto missing = std::count_if(members_.begin(), members_.end(), [this](const Member& m) { return is_present(m); });
  for (std::size_t i = 0; i < members_.size(); ++i) {
    if (is_present(members_[i])) {
      members_[i].object->draw([&](const Frame& frame) {
        writer_.write(i, frame);
        if (--missing == 0) {  // The object may still fail to write its tables: by then the frame exists.
          draw_bodies(time());
          writer_.complete(time(), step());
        }
        return true;
      });
    }
  }
}

void World::draw_bodies(double time) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const BodyDrawing& body = bodies_[i];
    if (body.from <= time && time < body.to) {
      writer_.write_body(i, {body.shape, body.motion.at(time)}, time);
    }
  }
}

std::string World::draw_failed(double h) {
  FrameWriter writer = writer_.of_failed_state();
  double start = time();  // Objects before the one that failed are already at the end of the step.
  for (const Member& member : members_) {
    start = member.object->is_gone() ? start : std::min(start, member.object->state().time);
  }
  bool was_finite = true;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Object& object = *members_[i].object;
    if (object.is_gone()) {
      continue;
    }
    was_finite = !make_finite(comm_, object.state()) && was_finite;
    object.draw([&](Frame frame) {
      frame.time = start + h;
      writer.write(i, frame);
      return false;
    });
  }
  writer.complete(start + h, step());
  return writer.file() + (was_finite ? "" : ", with 0 in place of numbers that are not finite");
}

void World::record(double h, int retries) {
  for (const Member& member : members_) {
    if (is_present(member) || h == 0) {  // The first row of a folder also includes removed objects.
      member.object->record(h, retries);
    }
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    group->record(time(), step());
  }
}

void World::save(Hdf5File& checkpoint) const {
  for (const Member& member : members_) {
    member.object->save(checkpoint);
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    group->save(checkpoint);
  }
  writer_.save(checkpoint);
}

void World::resume_output(const Hdf5File& checkpoint) {
  check_chosen_fields();
  writer_.resume(checkpoint);
  for (const Member& member : members_) {
    member.object->resume_output(checkpoint);
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    group->resume_output(checkpoint);
  }
}

}  // namespace world
}  // namespace pellicle
