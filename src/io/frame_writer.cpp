#include "io/frame_writer.h"

#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace pellicle {

namespace {

/// The tolerance keeps a step that misses its multiple by rounding alone.
double whole_intervals(double time, const OutputOptions& options) {
  return std::floor(time / options.interval_time + 1e-9);
}

/// Of a checkpoint: the times of the frames.
std::string frames_of(const FrameSeries& series) { return "output/frames/" + series.name(); }

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

FrameWriter::FrameWriter(OutputFolder& folder, OutputOptions options)
    : folder_(folder),
      options_(std::move(options)),
      surface_series_(folder, options_.name),
      spring_series_(folder, options_.name + "_springs") {}

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

void FrameWriter::save(Hdf5File& checkpoint) const {
  for (const FrameSeries* series : {&surface_series_, &spring_series_}) {
    checkpoint.write_once(frames_of(*series), series->times());
  }
  checkpoint.write_once<int>("output/last_frame_step", {last_step_});
}

void FrameWriter::resume(const Hdf5File& checkpoint) {
  for (FrameSeries* series : {&surface_series_, &spring_series_}) {
    const std::vector<double> times = checkpoint.read_all<double>(frames_of(*series));
    series->resume(times);
    last_time_ = times.empty() ? last_time_ : times.back();
  }
  last_step_ = checkpoint.read_all<int>("output/last_frame_step").front();
  folder_.start();
  for (FrameSeries* series : {&surface_series_, &spring_series_}) {
    if (!series->empty()) {
      series->write_list();
    }
  }
}

void FrameWriter::write(const Frame& frame) {
  if (!surface_series_.empty() && frame.step == last_step_) {
    return;
  }
  check_chosen_fields(frame);
  folder_.start();
  surface_series_.write(
      drawn(*frame.surface, frame.positions, chosen(frame.particle_fields), chosen(frame.cell_fields)), frame.time);
  if (frame.springs != nullptr) {
    spring_series_.write(drawn(*frame.springs, frame.positions, chosen(frame.spring_ends), frame.spring_fields),
                         frame.time);
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

}  // namespace pellicle
