#include "world/world.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "world/load_mesh.h"

namespace pellicle::world {

namespace {

std::vector<std::unique_ptr<Object>> objects_of(MPI_Comm comm, const RunPlan& plan) {
  std::vector<std::unique_ptr<Object>> objects;
  for (const auto& [name, options] : plan.objects) {
    objects.push_back(about_object(name, [&, &name = name, &options = options] {
      return std::make_unique<Object>(name, options, comm, load_mesh(comm, options).rows);
    }));
  }
  return objects;
}

/// Lines of all objects, with their names before them.
std::vector<std::string> lines_of(const std::vector<std::unique_ptr<Object>>& objects,
                                  std::vector<std::string> (Object::*of_object)() const) {
  std::vector<std::string> lines;
  for (const std::unique_ptr<Object>& object : objects) {
    add_lines(lines, object->name(), (*object.*of_object)());
  }
  return lines;
}

}  // namespace

World::World(MPI_Comm comm, const RunPlan& plan) : World(objects_of(comm, plan), plan.groups) {}

World::World(std::vector<std::unique_ptr<Object>> objects, const std::vector<GroupPlan>& groups)
    : objects_(std::move(objects)) {
  for (const GroupPlan& plan : groups) {
    std::vector<Object*> members;
    for (const std::size_t i : plan.objects) {
      members.push_back(objects_.at(i).get());
    }
    groups_.push_back(std::make_unique<Group>(plan, std::move(members)));
  }
}

Object& World::object(const std::string& name) {
  for (const std::unique_ptr<Object>& object : objects_) {
    if (object->name() == name) {
      return *object;
    }
  }
  throw std::logic_error("no object of the name " + name);
}

std::vector<std::pair<std::string, const StageClock*>> World::clocks() const {
  std::vector<std::pair<std::string, const StageClock*>> clocks;
  for (const std::unique_ptr<Object>& object : objects_) {
    clocks.emplace_back(object->name(), &object->clock());
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    if (group->clock() != nullptr) {
      clocks.emplace_back("together", group->clock());
    }
  }
  return clocks;
}

double World::time() const {
  double time = 0;
  for (const std::unique_ptr<Object>& object : objects_) {
    time = std::max(time, std::as_const(*object).state().time);
  }
  return time;
}

int World::steps() const {
  PetscInt step = 0;
  for (const std::unique_ptr<Object>& object : objects_) {
    step = std::max(step, std::as_const(*object).state().step);
  }
  return static_cast<int>(step);
}

StepResult World::step(double h) {
  keep();
  StepResult result = advance(h);
  if (result.converged) {
    accept(time());
  } else {
    restore();
  }
  return result;
}

void World::keep() {
  for (const std::unique_ptr<Group>& group : groups_) {
    if (group->clock() != nullptr) {
      group->clock()->start_lap();
    }
  }
  for (const std::unique_ptr<Object>& object : objects_) {
    object->clock().start_lap();
    object->keep();
  }
}

StepResult World::advance(double h) {
  StepResult all;
  for (auto group = groups_.begin(); all.converged && group != groups_.end(); ++group) {
    (*group)->advance(h, all);
  }
  return all;
}

void World::accept(double time) {
  const int step = steps();
  for (const std::unique_ptr<Object>& object : objects_) {
    if (object->state().step == step) {
      object->accept(time);
    }
  }
  for (const std::unique_ptr<Group>& group : groups_) {
    group->accept();
  }
}

void World::restore() {
  for (const std::unique_ptr<Object>& object : objects_) {
    object->restore();
  }
}

std::string World::ended() const {
  std::string reasons;
  bool goes_on = false;
  for (const std::unique_ptr<Object>& object : objects_) {
    const std::string& reason = object->ended();
    goes_on = goes_on || reason.empty();
    reasons += reason.empty() ? "" : (reasons.empty() ? "" : "; ") + heading_of(object->name()) + reason;
    if (!reason.empty() && !object->is_gone()) {
      return heading_of(object->name()) + reason;
    }
  }
  return goes_on ? "" : reasons;
}

std::vector<std::string> World::first_remarks() const {
  std::vector<std::string> lines = lines_of(objects_, &Object::first_remarks);
  for (const std::unique_ptr<Group>& group : groups_) {
    add_lines(lines, "", group->first_remarks());
  }
  return lines;
}

std::vector<std::string> World::remarks() const { return lines_of(objects_, &Object::remarks); }

void World::save(Hdf5File& checkpoint) const {
  for (const std::unique_ptr<Object>& object : objects_) {
    object->save(checkpoint);
  }
}

}  // namespace pellicle::world
