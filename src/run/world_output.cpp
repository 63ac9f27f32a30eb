#include "run/world_output.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace pellicle::run {

namespace {

std::vector<FramePart> parts_of(const World& world) {
  std::vector<FramePart> parts;
  for (const std::unique_ptr<Object>& object : world.objects()) {
    parts.push_back({object->name(), key_of(object->name())});
  }
  return parts;
}

/// "history_cloth.csv" of "history".
std::string file_of(const std::string& table, const Object& object) {
  return table + (object.name().empty() ? "" : "_" + object.name()) + ".csv";
}

}  // namespace

std::vector<BodyDrawing> drawings_of_bodies(MPI_Comm comm, const std::deque<NamedOptions>& objects) {
  std::vector<BodyDrawing> drawings;
  for (const Body& body : make_bodies(comm, objects.front().options.bodies)) {
    drawings.push_back({{body.name, "bodies." + body.name}, body.shape, body.motion});
  }
  for (const NamedOptions& object : objects) {
    for (const auto& [name, source] : object.options.heat.sources) {
      if (source.shape != SourceShape::ball) {
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

HistoryTables::HistoryTables(OutputFolder& folder, Object& object, bool contact_apart)
    : object_(object),
      contact_apart_(contact_apart),
      history_(folder, file_of("history", object), object.report(0, contact_apart).columns(), key_of(object.name())) {
  if (object.state().burning) {
    pieces_ = std::make_unique<History>(
        folder, file_of("pieces", object),
        std::vector<History::Column>{{"time", "s"}, {"step", ""}, {"piece", ""}, {"birth_time", "s"}, {"mass", "kg"}},
        key_of(object.name()));
  }
  if (object.options().project.monitor) {
    std::vector<History::Column> columns{
        {"time", "s"}, {"step", ""}, {"projection_step", ""}, {"projected_colour", ""}};
    for (const char* colour : colour_names) {
      columns.push_back({std::string("error_") + colour, "m"});
    }
    columns.push_back({"error_total", "m"});
    projection_ = std::make_unique<History>(folder, file_of("projection", object), columns, key_of(object.name()));
  }
}

void HistoryTables::add_step(int retries) {
  const State& state = object_.state();
  if (projection_ != nullptr) {
    projection_->start();
    for (const ProjectionError& error : object_.last_step().projected) {  // the curves of Fig. 8
      if (rank_of(object_.surface().comm()) == 0) {
        const char* after = error.projected ? colour_names[static_cast<std::size_t>(*error.projected)] : "start";
        std::printf("  projection step %d %-6s ||C|| red %.4e green %.4e blue %.4e yellow %.4e all %.4e\n", error.step,
                    after, error.colour[0], error.colour[1], error.colour[2], error.colour[3], error.total);
      }
      std::vector<double> row{state.time, static_cast<double>(state.step), static_cast<double>(error.step),
                              error.projected ? static_cast<double>(*error.projected) : -1.0};
      row.insert(row.end(), error.colour.begin(), error.colour.end());
      row.push_back(error.total);
      projection_->add(row);
    }
  }
  if (pieces_ != nullptr) {
    pieces_->start();  // It is there, too, when nothing is left.
  }
  history_.add(object_.report(retries, contact_apart_).values());
}

void HistoryTables::add_frame() {
  if (pieces_ == nullptr) {
    return;
  }
  const State& state = object_.state();
  const Pieces& pieces = state.burning->pieces;
  const std::vector<double> masses = piece_masses(pieces, object_.surface(), state.burning->mass);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    pieces_->add({state.time, static_cast<double>(state.step), static_cast<double>(pieces.present[i]),
                  pieces.birth_time[i], masses[i]});
  }
}

void HistoryTables::save(Hdf5File& checkpoint) const {
  for (const History* table : std::initializer_list<const History*>{&history_, pieces_.get(), projection_.get()}) {
    if (table != nullptr) {
      table->save(checkpoint);
    }
  }
}

void HistoryTables::resume(const Hdf5File& checkpoint) {
  for (History* table : {&history_, pieces_.get(), projection_.get()}) {
    if (table != nullptr) {
      table->resume(checkpoint);
    }
  }
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
    if (!group->plan().is_single() && group->plan().contact.self) {
      touching_ = group.get();
      contacts_ = std::make_unique<History>(folder, "contacts.csv", group->report().columns());
    }
  }
  for (std::size_t i = 0; i < world.objects().size(); ++i) {
    tables_.emplace_back(folder, *world.objects()[i], is_coupled[i]);
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
  for (HistoryTables& tables : tables_) {
    tables.resume(checkpoint);
  }
  if (contacts_ != nullptr) {
    contacts_->resume(checkpoint);
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
    tables_[i].add_frame();
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
      tables_[i].add_step(retries);
    }
  }
  if (contacts_ != nullptr) {
    contacts_->add(touching_->report().values());
  }
}

void WorldOutput::save(Hdf5File& checkpoint) const {
  world_.save(checkpoint);
  for (const HistoryTables& tables : tables_) {
    tables.save(checkpoint);
  }
  if (contacts_ != nullptr) {
    contacts_->save(checkpoint);
  }
  writer_.save(checkpoint);
}

}  // namespace pellicle::run
