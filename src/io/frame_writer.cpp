#include "io/frame_writer.h"

#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/error.h"

namespace pellicle {

namespace {

/// The tolerance keeps a step that misses its multiple by rounding alone.
double whole_intervals(double time, const OutputOptions& options) {
  return std::floor(time / options.interval_time + 1e-9);
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

FrameWriter::FrameWriter(MPI_Comm comm, OutputOptions options, Drawing surface)
    : options_(std::move(options)),
      surface_(std::move(surface)),
      surface_series_(comm, options_.directory, options_.name),
      spring_series_(comm, options_.directory, options_.name + "_springs") {
  options_.validate();
}

FrameWriter::FrameWriter(const Membrane& membrane, OutputOptions options)
    : FrameWriter(membrane.comm(), std::move(options), drawing_of(membrane)) {}

FrameWriter::FrameWriter(const Sheet& sheet, OutputOptions options)
    : FrameWriter(sheet.comm(), std::move(options), drawing_of(sheet)) {
  if (options_.springs) {
    sheet_ = &sheet;
    springs_ = drawing_of_springs(sheet);
  }
}

bool FrameWriter::due(double time, int step) const {
  if (surface_series_.empty()) {
    return true;
  }
  if (options_.interval_time > 0) {
    return whole_intervals(time, options_) > whole_intervals(last_time_, options_);
  }
  return step / options_.interval_steps > last_step_ / options_.interval_steps;
}

std::optional<double> FrameWriter::next_time(double time) const {
  if (options_.interval_time == 0) {
    return std::nullopt;
  }
  return (whole_intervals(time, options_) + 1) * options_.interval_time;
}

void FrameWriter::write(const Frame& frame) {
  check_chosen_fields(frame);
  if (surface_series_.empty()) {
    surface_series_.start();
    spring_series_.start();  // Also of an older run that drew springs.
  }
  surface_series_.write(drawn(surface_, frame.positions, chosen(frame.particle_fields), chosen(frame.cell_fields)),
                        frame.time);
  if (springs_) {
    write_springs(frame);
  }
  last_time_ = frame.time;
  last_step_ = frame.step;
}

void FrameWriter::check_chosen_fields(const Frame& frame) const {
  std::vector<std::string> known;
  std::string list;
  for (const auto* fields : {&frame.particle_fields, &frame.cell_fields}) {
    for (const DrawnField& field : *fields) {
      known.push_back(field.name);
      list.append(list.empty() ? "" : ", ").append(field.name);
    }
  }
  for (const std::string& name : options_.fields) {
    if (!has(known, name)) {
      throw Error("output.fields: no field '" + name + "' in this run: expected some of " + list);
    }
  }
}

std::vector<DrawnField> FrameWriter::chosen(const std::vector<DrawnField>& fields) const {
  std::vector<DrawnField> result;
  std::copy_if(fields.begin(), fields.end(), std::back_inserter(result),
               [this](const DrawnField& field) { return options_.fields.empty() || has(options_.fields, field.name); });
  return result;
}

void FrameWriter::write_springs(const Frame& frame) {
  const std::vector<DrawnField>& declared = frame.spring_fields[0];
  std::vector<std::vector<double>> values(declared.size());  // of the lines, colour after colour
  std::vector<DrawnField> line_fields = declared;
  for (std::size_t i = 0; i < declared.size(); ++i) {
    for (const Colour colour : all_colours) {
      const std::vector<DrawnField>& fields = frame.spring_fields[static_cast<std::size_t>(colour)];
      if (fields.size() != declared.size() || fields[i].name != declared[i].name) {
        throw std::logic_error("the spring fields of a frame differ from colour to colour");
      }
      values[i].insert(values[i].end(), fields[i].values,
                       fields[i].values + fields[i].components * sheet_->of(colour).owned());
    }
    line_fields[i].values = values[i].data();
  }
  spring_series_.write(drawn(*springs_, frame.positions, chosen(frame.particle_fields), line_fields), frame.time);
}

}  // namespace pellicle
