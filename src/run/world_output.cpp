#include "run/world_output.h"

#include <algorithm>
#include <utility>

#include "world/state_checks.h"

namespace pellicle::run {

namespace {

std::vector<FramePart> parts_of(const World& world) {
  std::vector<FramePart> parts;
  for (const std::unique_ptr<Object>& object : world.objects()) {
    parts.push_back({object->name(), key_of(object->name())});
  }
  return parts;
}

}  // namespace

std::vector<BodyDrawing> drawings_of_bodies(MPI_Comm comm, const std::deque<NamedOptions>& objects) {
  std::vector<BodyDrawing> drawings;
  for (const Body& body : make_bodies(comm, objects.front().options.bodies)) {
    drawings.push_back({{body.name, "bodies." + body.name}, body.shape, body.motion});
  }
  for (const NamedOptions& object : objects) {
    for (const auto& [name, source] : object.options.heat.sources) {
      if (!shape_of(source).has_centre) {
        continue;
      }
      RigidMotion motion;
      motion.start.place = source.centre;
      motion.velocity = source.velocity;
      motion.path = source.path;
      const bool is_named = !object.name.empty();
      drawings.push_back({{"heat_" + (is_named ? object.name + "_" : "") + name,
                           (is_named ? "objects." + object.name + "." : "") + "heat.sources." + name},
                          Sphere{source.radius},
                          motion,
                          source.start_time,
                          source.end_time.value_or(std::numeric_limits<double>::infinity())});
    }
  }
  return drawings;
}

WorldOutput::WorldOutput(World& world, OutputFolder& folder, Console& console, const OutputOptions& options,
                         std::vector<BodyDrawing> bodies)
    : world_(world),
      console_(console),
      bodies_(std::move(bodies)),
      writer_(folder, options, parts_of(world), {bodies_.begin(), bodies_.end()}),
      fields_are_to_be_checked_(!options.fields.empty()) {
  std::vector<bool> is_coupled(world.objects().size(), false);
  for (const std::unique_ptr<Group>& group : world.groups()) {
    for (const std::size_t i : group->plan().objects) {
      is_coupled[i] = !group->plan().is_single();
    }
  }
  for (std::size_t i = 0; i < world.objects().size(); ++i) {
    tables_.push_back(std::make_unique<HistoryTables>(folder, *world.objects()[i], is_coupled[i]));
  }
  for (const std::unique_ptr<Group>& group : world.groups()) {
    if (!group->plan().is_single() && group->plan().contact.self) {
      contacts_.push_back({group.get(), std::make_unique<History>(folder, "contacts.csv", group->report().columns())});
    }
  }
  writer_.reserve_names();
}

void WorldOutput::begin() {
  draw();
  add_rows(0, true);
}

void WorldOutput::resume(const Hdf5File& checkpoint) {
  check_chosen_fields();
  writer_.resume(checkpoint);
  for (const std::unique_ptr<HistoryTables>& tables : tables_) {
    tables->resume(checkpoint);
  }
  for (const GroupTable& table : contacts_) {
    table.contacts->resume(checkpoint);
  }
}

/// Refuses names in `output.fields` that are fields of no object.
void WorldOutput::check_chosen_fields() {
  if (!std::exchange(fields_are_to_be_checked_, false)) {
    return;
  }
  std::vector<std::string> known;
  for (const std::unique_ptr<Object>& object : world_.objects()) {
    object->draw([&known](const Frame& frame) {
      for (const std::string& name : field_names(frame)) {
        if (std::find(known.begin(), known.end(), name) == known.end()) {
          known.push_back(name);
        }
      }
    });
  }
  writer_.require_chosen_fields(known);
}

void WorldOutput::draw() {
  if (!writer_.lacks(step())) {
    return;
  }
  check_chosen_fields();
  const std::vector<std::unique_ptr<Object>>& objects = world_.objects();
  auto missing = std::count_if(objects.begin(), objects.end(),
                               [this](const std::unique_ptr<Object>& object) { return world_.is_present(*object); });
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!world_.is_present(*objects[i])) {
      continue;
    }
    objects[i]->draw([&](const Frame& frame) {
      writer_.write(i, frame);
      if (--missing == 0) {  // Its tables may still fail to be written: by then the frame exists.
        draw_bodies();
        writer_.complete(time(), step());
      }
    });
    tables_[i]->add_frame();
  }
}

void WorldOutput::draw_bodies() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const BodyDrawing& body = bodies_[i];
    if (body.from <= time() && time() < body.to) {
      writer_.write_body(i, {body.shape, body.motion.at(time())}, time());
    }
  }
}

std::string WorldOutput::draw_failed(double h) {
  FrameWriter writer = writer_.of_failed_state();
  const std::vector<std::unique_ptr<Object>>& objects = world_.objects();
  double start = time();  // Objects before the one that failed are already at the end of the step.
  for (const std::unique_ptr<Object>& object : objects) {
    start = object->is_gone() ? start : std::min(start, object->state().time);
  }
  bool was_finite = true;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Object& object = *objects[i];
    if (object.is_gone()) {
      continue;
    }
    was_finite = !make_finite(world_.comm(), object.state()) && was_finite;
    object.draw([&](Frame frame) {
      frame.time = start + h;
      writer.write(i, frame);
    });
  }
  writer.complete(start + h, step());
  return writer.file() + (was_finite ? "" : ", with 0 in place of numbers that are not finite");
}

void WorldOutput::record(int retries) {
  for (const std::unique_ptr<Object>& object : world_.objects()) {
    for (const News& news : object->take_news()) {
      const std::string line = heading_of(object->name()) + news.line;
      news.is_figure ? console_.say(line) : console_.tell(line);
    }
  }
  add_rows(retries, false);
}

/// @param all also the rows of objects that have gone before
void WorldOutput::add_rows(int retries, bool all) {
  const std::vector<std::unique_ptr<Object>>& objects = world_.objects();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (all || world_.is_present(*objects[i])) {
      tables_[i]->add_step(retries);
    }
  }
  for (const GroupTable& table : contacts_) {
    table.contacts->add(table.group->report().values());
  }
}

void WorldOutput::save(Hdf5File& checkpoint) const {
  world_.save(checkpoint);
  for (const std::unique_ptr<HistoryTables>& tables : tables_) {
    tables->save(checkpoint);
  }
  for (const GroupTable& table : contacts_) {
    table.contacts->save(checkpoint);
  }
  writer_.save(checkpoint);
}

}  // namespace pellicle::run
