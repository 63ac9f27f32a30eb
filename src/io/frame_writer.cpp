#include "io/frame_writer.h"

#include <fmt/format.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::io {

namespace {

/// The tolerance accepts a step that misses its multiple by rounding alone.
double whole_intervals(double time, const OutputOptions& options) {
  return std::floor(time / options.interval_time + 1e-9);
}

/// The table of a checkpoint with the step of the last frame.
const char* const last_step_table = "output/last_frame_step";

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::vector<std::string> field_names(const Frame& frame) {
  std::vector<std::string> names;
  for (const auto* fields : {&frame.particle_fields, &frame.cell_fields}) {
    for (const DrawnField& field : *fields) {
      names.push_back(field.name);
    }
  }
  return names;
}

FrameWriter::FrameWriter(OutputFolder& folder, OutputOptions options, std::vector<FramePart> objects,
                         std::vector<FramePart> bodies)
    : folder_(folder),
      options_(std::move(options)),
      objects_(std::move(objects)),
      surface_series_(folder, options_.name, objects_),
      spring_series_(folder, options_.name + "_springs", objects_),
      body_series_(folder, options_.name + "_bodies", bodies),
      has_bodies_(!bodies.empty()) {}

void FrameWriter::reserve_names() const {
  const FrameWriter failed = of_failed_state();
  for (const FrameSeries* series : {&surface_series_, &failed.surface_series_, &body_series_}) {
    series->reserve();
  }
  if (options_.springs) {
    spring_series_.reserve();
    failed.spring_series_.reserve();
  }
}

FrameWriter FrameWriter::of_failed_state() const {
  OutputOptions options = options_;
  options.name += "_failed";
  return FrameWriter(folder_, std::move(options), objects_);
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

void FrameWriter::save(Hdf5File& checkpoint) const {
  surface_series_.save(checkpoint);
  spring_series_.save(checkpoint);
  if (has_bodies_) {
    body_series_.save(checkpoint);
  }
  checkpoint.write_once<int>(last_step_table, {last_step_});
}

void FrameWriter::resume(const Hdf5File& checkpoint) {
  surface_series_.resume(checkpoint);
  spring_series_.resume(checkpoint);
  if (has_bodies_) {
    body_series_.resume(checkpoint);
  }
  last_time_ = surface_series_.last_time();
  last_step_ = checkpoint.read_all<int>(last_step_table).front();
  folder_.start();
  write_lists();
}

void FrameWriter::write_lists() {
  for (FrameSeries* series : {&surface_series_, &spring_series_, &body_series_}) {
    if (!series->empty()) {
      series->write_list();
    }
  }
}

void FrameWriter::write(std::size_t object, const Frame& frame) {
  folder_.start();
  const vtkSmartPointer<vtkPolyData> surface =
      drawn(*frame.surface, frame.positions, chosen(frame.particle_fields), chosen(frame.cell_fields));
  if (surface->GetNumberOfPoints() > 0) {
    const double* b = surface->GetBounds();
    bounds_.extend(Eigen::AlignedBox3d(Eigen::Vector3d(b[0], b[2], b[4]), Eigen::Vector3d(b[1], b[3], b[5])));
  }
  surface_series_.write(object, surface, frame.time);
  if (frame.springs != nullptr) {
    spring_series_.write(object, drawn(*frame.springs, frame.positions, chosen(frame.spring_ends), frame.spring_fields),
                         frame.time);
  }
}

void FrameWriter::write_body(std::size_t body, const Solid& solid, double time) {
  Eigen::AlignedBox3d bounds = bounds_;
  min_over_ranks(folder_.comm(), bounds.min());
  max_over_ranks(folder_.comm(), bounds.max());
  // A plane is drawn in the same size from frame to frame, while the size of what moves stays within a factor of 2.
  const double half =
      std::exp2(std::ceil(std::log2(bounds.isEmpty() ? 1 : std::max(bounds.diagonal().norm(), 1e-9)))) / 2;
  body_series_.write(
      body, rank_of(folder_.comm()) == 0 ? drawing_of_solid(solid, half) : vtkSmartPointer<vtkPolyData>::New(), time);
}

void FrameWriter::complete(double time, int step) {
  bounds_.setEmpty();
  write_lists();
  last_time_ = time;
  last_step_ = step;
}

void FrameWriter::require_chosen_fields(const std::vector<std::string>& known) const {
  for (const std::string& name : options_.fields) {
    if (!has(known, name)) {
      throw Error(
          fmt::format("output.fields: no field '{}' in this run: expected some of {}", name, fmt::join(known, ", ")));
    }
  }
}

std::vector<DrawnField> FrameWriter::chosen(const std::vector<DrawnField>& fields) const {
  std::vector<DrawnField> result;
  std::copy_if(fields.begin(), fields.end(), std::back_inserter(result),
               [this](const DrawnField& field) { return options_.fields.empty() || has(options_.fields, field.name); });
  return result;
}

}  // namespace pellicle::io
