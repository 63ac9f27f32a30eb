#include "world/object.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <variant>

#include "contact/body_sweep.h"
#include "contact/contact_surface.h"
#include "contact/crossings.h"
#include "parallel/collective.h"
#include "surface/split_corners.h"
#include "world/load_mesh.h"

namespace pellicle::world {

namespace {

/// Persistent ids of the local elements: that of a quad is that of its lattice particle.
std::vector<PetscInt> element_ids(const Surface& surface) {
  std::vector<PetscInt> ids = surface.has_quads() ? surface.lattice : surface.element_id;
  for (std::size_t e = 0; e < surface.lattice.size(); ++e) {
    ids[e] = surface.persistent_id[surface.lattice[e]];
  }
  return ids;
}

/// The state of an object from its group of a checkpoint. Collective.
std::unique_ptr<State> read_state(const Hdf5File& checkpoint, const std::string& group, const Options& options,
                                  const Surface& surface) {
  const std::string table = group + "/state";
  const auto chambers = static_cast<int>(checkpoint.read_all<double>(table + "/once/pressure").size());
  auto state = std::make_unique<State>(surface, options, chambers);
  read_fields(checkpoint, table, *state, surface.persistent_id, element_ids(surface));
  return state;
}

/// Adds kinetic energy [J] and momentum [kg m/s]. Collective. @param mass of the owned particles [kg]
void report_motion(Report& report, const Surface& surface, const double* mass, const Field& velocity) {
  std::array<double, 4> sums{};
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    const Eigen::Vector3d v = velocity.vector(i);
    sums[0] += mass[i] * v.squaredNorm() / 2;
    Eigen::Map<Eigen::Vector3d>(sums.data() + 1) += mass[i] * v;
  }
  sums = sum_over_ranks(surface.comm(), sums);
  report.add("kinetic_energy", "J", sums[0]);
  report.add("momentum_x", "kg m/s", sums[1]);
  report.add("momentum_y", "kg m/s", sums[2]);
  report.add("momentum_z", "kg m/s", sums[3]);
}

/// Adds force and gap of each body; zeros at first, when loads are not known.
void report_bodies(Report& report, const std::vector<Body>& bodies, const std::vector<BodyLoad>& loads) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const BodyLoad load = b < loads.size() ? loads[b] : BodyLoad{Eigen::Vector3d::Zero(), 0};
    const std::string owner = "bodies." + bodies[b].name;
    report.add("force_" + bodies[b].name + "_x", "N", load.force.x(), owner);
    report.add("force_" + bodies[b].name + "_y", "N", load.force.y(), owner);
    report.add("force_" + bodies[b].name + "_z", "N", load.force.z(), owner);
    report.add("gap_" + bodies[b].name, "m", load.gap, owner);
  }
}

/// Adds the works that an object with these options can have, such as gravity_work. @param works since time 0 [J]
void report_work(Report& report, const Options& options, const Eigen::VectorXd& works) {
  const std::array<std::pair<const char*, bool>, kinds_of_work> kinds{
      // column and whether it applies, as in Work
      {{"gravity_work", true},
       {"damping_work", true},
       {"pin_work", !options.pins.empty()},
       {"pressure_work", !options.chambers.empty()},
       {"body_work", !options.bodies.empty() && balances_bodies(options)},
       {"air_work", options.force.air.density > 0},
       {"load_work", !options.attachments.empty() || !options.forces.empty()}}};
  for (int kind = 0; kind < kinds_of_work; ++kind) {
    if (const auto& [column, applies] = kinds[kind]; applies) {
      report.add(column, "J", works[kind]);
    }
  }
}

/// Adds how an object touches itself. Collective. @param apart see Object::report
/// @param figures at the end of the last step, if there was one
void report_contact(Report& report, const ContactOptions& options, bool apart,
                    const std::optional<ContactFigures>& figures, const Surface& surface, const State& state) {
  if (options.self && !apart) {
    const ContactFigures last = figures ? *figures : ContactFigures{0, contact_thickness(surface, options)};
    report.add("self_contacts", "", static_cast<double>(last.contacts));
    report.add("smallest_gap", "m", last.smallest_gap);
    report.add("contact_energy", "J", last.energy);
    report.add("contact_searches", "", static_cast<double>(last.searches));
    report.add("room_used", "", last.room_used);
  }
  if (options.self) {
    report.add("contact_work", "J", state.contact_work);
    report.add("friction_work", "J", state.friction_work);
  }
  if (options.check && !apart) {
    const Crossings crossings = find_crossings({{surface, state.position, state.active_triangles()}});
    report.add("crossings", "", static_cast<double>(crossings.pairs));
    report.add("crossing_element_1", "", static_cast<double>(crossings.elements[0]));
    report.add("crossing_element_2", "", static_cast<double>(crossings.elements[1]));
  }
}

/// The lines of all stages, in their order. Collective.
std::vector<std::string> lines_of(const Stages& stages, std::vector<std::string> (Stage::*of_stage)() const) {
  std::vector<std::string> lines;
  for (const std::unique_ptr<Stage>& stage : stages.all) {
    add_lines(lines, "", (*stage.*of_stage)());
  }
  return lines;
}

/// Adds the seconds that stages have taken in the step.
void report_seconds(Report& report, const StageClock& clock) {
  for (const StageTime& stage : clock.stages()) {
    std::string name = "seconds_" + stage.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    report.add(name, "s", stage.lap_seconds);
  }
}

/// Refuses an object that starts inside a body. Collective. @throws Error that names particle or triangle, and body
void refuse_start_in_bodies(const Object& object) {
  const std::vector<Body>& bodies = object.motion().bodies();
  const Surface& surface = object.surface();
  const double least = BodySweep::tolerance * object.motion().contact_part().thickness_or_usual();
  const State& state = object.state();
  const std::vector<bool> constrained = object.motion().constrained();
  refuse_fault("", particles_inside(bodies, state.time, surface.particles, state.position, constrained, least));
  refuse_fault("", triangles_inside(bodies, state.time, surface, state.position, constrained, least));
}

}  // namespace

Object::Object(std::string name, Options options, MPI_Comm comm, MeshRows rows)
    : name_(std::move(name)),
      options_(std::move(options)),
      chain_(make_chain(options_)),
      clock_(chain_->words.clock_names),
      surface_(chain_->make_surface(comm, std::move(rows))),
      textures_(comm),
      state_(chain_->initial_state(*surface_)) {
  make_stages();
  start();
  update_derived();
  refuse_start_in_bodies(*this);
}

Object::Object(std::string name, Options options, const Hdf5File& checkpoint)
    : name_(std::move(name)),
      options_(std::move(options)),
      chain_(make_chain(options_)),
      clock_(chain_->words.clock_names),
      surface_(chain_->read_surface(checkpoint, group())),
      textures_(checkpoint.comm()),
      state_(read_state(checkpoint, group(), options_, *surface_)) {
  make_stages();
  update_derived();
  find_end();
}

void Object::add_stage(StageMaker make) {
  Stage& stage = stages_.add_before_motion(make(*surface_, *state_));
  if (state_->step == 0) {
    stage.start();
  }
  stage.update_derived();
  added_.push_back(std::move(make));
}

Field& Object::field(const std::string& name) {
  const FieldRegistry::Entry* entry = state_->find(name);
  if (entry == nullptr || !std::holds_alternative<Field*>(entry->storage)) {
    throw std::logic_error("no field of the name " + name + " on particles");
  }
  return *std::get<Field*>(entry->storage);
}

void Object::make_stages() {
  stages_ = chain_->make_stages(*surface_, *state_, clock_, textures_);
  for (const StageMaker& make : added_) {
    stages_.add_before_motion(make(*surface_, *state_));
  }
}

void Object::start() {
  for (const std::unique_ptr<Stage>& stage : stages_.all) {
    stage->start();
  }
}

void Object::update_derived() {
  for (const std::unique_ptr<Stage>& stage : stages_.all) {
    stage->update_derived();
  }
}

StageResult Object::begin(double h) {
  step_ = {};
  step_.h = h;
  StageResult result;
  result.reason = beyond_reach(options_, *surface_, *state_, h);
  result.converged = result.reason.empty();
  for (auto stage = stages_.all.begin(); result.converged && stage != stages_.all.end(); ++stage) {
    result.add((*stage)->begin(step_));
  }
  return result;
}

StageResult Object::end(const EquilibriumResult& balance) {
  step_.balance = balance;
  StageResult result = stages_.motion->take_balance(step_);
  for (auto stage = stages_.all.begin(); result.converged && stage != stages_.all.end(); ++stage) {
    result = (*stage)->end(step_);
  }
  if (result.converged) {
    state_->time += step_.h;
    ++state_->step;
    result.reason = non_finite(surface_->comm(), *state_);
    result.converged = result.reason.empty();
  }
  return result;
}

void Object::keep() {
  if (!kept_) {
    kept_.emplace(surface_->particles, surface_->elements.local());
  }
  *kept_ = *state_;
}

void Object::restore() {
  *state_ = *kept_;
  update_derived();
}

void Object::accept(double time) {
  state_->time = time;
  crack_faces_.clear();
  for (const std::string& line : step_.news) {
    news_.push_back({line});
  }
  find_end();
  if (!ended_.empty() || (!step_.has_cracked && !step_.has_burnt)) {
    return;
  }
  const auto timer = clock_.time(chain_->words.renumbering);
  if (can_crack()) {
    split();
  }
  if (stages_.gas != nullptr) {  // The walls of chambers keep all elements.
    divide();
  } else if (crack_faces_.empty()) {  // Faces of cracks are to be moved apart before, with their present numbers.
    const PetscInt before = surface_->elements.global;
    if (std::optional<MovedSurface> left = chain_->compact(*surface_, *state_); left) {
      transfer(std::move(*left));
      news_.push_back({at_step() + std::to_string(before - surface_->elements.global) + " of " +
                           std::to_string(before) + " cells are gone; " + partition_line(*surface_),
                       true});
    }
  }
}

/// Divides the chambers whose walls have separated.
void Object::divide() {
  const std::vector<std::string> lines = stages_.gas->divide();
  if (!lines.empty()) {
    make_stages();
    kept_.reset();
    ++replaced_;
  }
  for (const std::string& line : lines) {
    news_.push_back({line});
  }
  update_derived();
}

/// Splits the vertices at which cracks have separated the surface.
void Object::split() {
  const SplitCorners corners = find_split_corners(*surface_, state_->burning->active);
  if (corners.count == 0) {
    return;
  }
  Records particles(state_->record_size(Item::particle), surface_->particles.owned);
  for (PetscInt i = 0; i < particles.count(); ++i) {
    state_->pack(Item::particle, i, particles.at(i), corners.fraction[i]);
  }
  Records copies(particles.bytes(), static_cast<PetscInt>(corners.copies.size()));
  for (PetscInt k = 0; k < copies.count(); ++k) {
    state_->pack(Item::particle, corners.copies[k].original, copies.at(k), corners.copies[k].fraction);
  }
  crack_faces_ = find_crack_faces(*surface_, corners);
  transfer(chain_->split(*surface_, corners, particles, copies, state_->packed(Item::cell)));
  update_pieces(state_->burning->pieces, *surface_, state_->burning->active, state_->time);
}

void Object::spread(const std::vector<double>& load) {
  if (std::optional<MovedSurface> moved = chain_->spread(*surface_, *state_, load); moved) {
    transfer(std::move(*moved));
    news_.push_back({at_step() + partition_line(*surface_), true});
  }
}

/// Continues with a surface that was made from the present one, and the data that came with its items.
void Object::transfer(MovedSurface moved) {
  auto state = std::make_unique<State>(*moved.surface, options_, static_cast<int>(state_->pressure.size()));
  state->transfer(*state_);
  state->unpack(Item::particle, moved.particles);
  state->unpack(Item::cell, moved.elements);
  stages_ = {};
  kept_.reset();
  whole_.reset();
  state_ = std::move(state);
  surface_ = std::move(moved.surface);
  make_stages();
  update_derived();
  ++replaced_;
}

void Object::find_end() {
  ended_ = is_gone() ? chain_->words.end : stages_.gas != nullptr ? stages_.gas->open_wall(can_crack()) : "";
}

void Object::draw(const std::function<void(const Frame&)>& write) {
  const auto timer = clock_.time("output");
  Picture picture;
  for (const std::unique_ptr<Stage>& stage : stages_.all) {
    stage->draw(picture);
  }
  write(picture.frame(*surface_, *state_, whole_));
}

Report Object::report(int retries, bool contact_apart) const {
  Report report;
  report.add("time", "s", state_->time);
  report.add("step", "", static_cast<double>(state_->step));
  report.add("time_step", "s", step_.h);
  report.add("retries", "", retries);
  report_motion(report, *surface_, stages_.motion->mass(), state_->velocity);
  for (const std::unique_ptr<Stage>& stage : stages_.all) {
    stage->report(report, step_);
  }
  report_work(report, options_, state_->work);
  report_contact(report, options_.contact, contact_apart, step_.balance.contact, *surface_, *state_);
  report_bodies(report, stages_.motion->bodies(), step_.loads);
  report_seconds(report, clock_);
  return report;
}

std::vector<std::string> Object::first_remarks() const { return lines_of(stages_, &Stage::first_remarks); }

std::vector<std::string> Object::remarks() const { return lines_of(stages_, &Stage::remarks); }

void Object::save(Hdf5File& checkpoint) const {
  const std::vector<PetscInt>& particles = surface_->persistent_id;
  std::vector<PetscInt> elements = element_ids(*surface_);
  elements.resize(static_cast<std::size_t>(surface_->elements.owned));
  chain_->write_surface(checkpoint, group(), *surface_);
  write_fields(checkpoint, group() + "/state", *state_,
               {particles.begin(), particles.begin() + surface_->particles.owned}, elements);
}

}  // namespace pellicle::world
