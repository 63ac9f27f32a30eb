#include "world/inflate_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "ablation/ablation.h"
#include "ablation/cut_surface.h"
#include "state/field_tables.h"
#include "state/mesh_tables.h"
#include "surface/compaction.h"
#include "surface/membrane_geometry.h"
#include "world/contact_of_object.h"
#include "world/contact_start.h"
#include "world/gas_of_object.h"
#include "world/non_finite.h"
#include "world/piece_fields.h"
#include "world/renumbering.h"
#include "world/step_reach.h"

namespace pellicle {
inline namespace world {

namespace {

// Names in a checkpoint, in the group of the object.
std::string balloon_mesh(const ObjectOutput& output) { return output.group("balloon") + "/mesh"; }
std::string balloon_state(const ObjectOutput& output) { return output.group("balloon") + "/state"; }

std::unique_ptr<Membrane> burnable(Membrane membrane, const Options& options) {
  make_burnable(membrane, options);
  return std::make_unique<Membrane>(std::move(membrane));
}

/// The state from a checkpoint. Collective.
std::unique_ptr<BalloonState> read_state(const Hdf5File& checkpoint, const Membrane& membrane, const Options& options,
                                         const ObjectOutput& output) {
  const std::string group = balloon_state(output);
  const auto chambers = checkpoint.read_all<double>(group + "/once/pressure").size();
  auto state = std::make_unique<BalloonState>(state_at_rest(membrane, options, static_cast<int>(chambers)));
  read_fields(checkpoint, group, *state, membrane.persistent_id, membrane.element_id);
  return state;
}

/// m/m^init of the local vertices.
std::vector<double> mass_ratios(const Membrane& membrane, const Field& mass) {
  std::vector<double> ratio;
  for (std::size_t i = 0; i < membrane.initial_mass.size(); ++i) {
    ratio.push_back(mass.data()[i] / membrane.initial_mass[i]);
  }
  return ratio;
}

}  // namespace

InflateRun::InflateRun(Membrane membrane, const Options& options, const ObjectOutput& output)
    : options_(options),
      output_(output),
      membrane_(burnable(std::move(membrane), options)),
      inflate_(std::make_unique<Inflate>(*membrane_, options, output.clock)),
      state_(std::make_unique<BalloonState>(inflate_->initial_state())),
      surface_(drawing_of(*membrane_, whole_surface(*membrane_))),
      ledger_(std::make_unique<BalloonLedger>(output_, *inflate_)) {
  inflate_->follow(*state_);
  refuse_start_in_bodies(*this, inflate_->bodies());
}

InflateRun::InflateRun(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output)
    : options_(options),
      output_(output),
      membrane_(burnable(
          make_membrane(checkpoint.comm(), read_mesh(checkpoint, balloon_mesh(output)), options.sheet).membrane,
          options)),
      state_(read_state(checkpoint, *membrane_, options, output)),
      surface_(drawing_of(*membrane_, whole_surface(*membrane_))) {
  inflate_ = std::make_unique<Inflate>(*membrane_, options, output.clock, *state_);
  inflate_->follow(*state_);
  told_open_ = opened_chambers(*state_);
  ledger_ = std::make_unique<BalloonLedger>(output_, *inflate_);
  find_end();
}

StepResult InflateRun::begin(double h) {
  last_ = within_reach(options_, *membrane_, *state_, h, [&] { return inflate_->begin(*state_, h); });
  return {last_.converged, last_.reason, last_.heat_iterations};
}

StepResult InflateRun::end(const EquilibriumResult& balance) {
  inflate_->end(*state_, balance, last_);
  return result();
}

/// Figures of the last step.
StepResult InflateRun::result() {
  StepResult result;
  result.converged = last_.converged;
  result.reason = last_.reason;
  if (result.converged) {
    const auto vertices = static_cast<std::size_t>(membrane_->particles.local());
    std::vector<NamedValues> watched{
        {"position", state_->position.data(), 3 * vertices},
        {"velocity", state_->velocity.data(), 3 * vertices},
        {"thickness", state_->thickness_ratio.data(), state_->thickness_ratio.size()},
        {"pressure", state_->pressure.data(), static_cast<std::size_t>(state_->pressure.size())}};
    if (state_->burning) {
      watched.push_back({"temperature", state_->burning->temperature.data(), vertices});
      watched.push_back({"mass", state_->burning->mass.data(), vertices});
    }
    result.reason = non_finite(membrane_->comm(), watched);
    result.converged = result.reason.empty();
  }
  result.iterations = last_.linear_iterations + last_.heat_iterations;
  result.step_error = last_.step_error;
  result.newton_iterations = last_.newton_iterations;
  if (state_->pressure.size() > 0) {
    result.figures = fmt::format("p {:.4g} Pa", state_->pressure[0]);
  }
  return result;
}

void InflateRun::keep() {
  if (kept_ == nullptr) {
    kept_ = std::make_unique<BalloonState>(*membrane_, inflate_->chambers().count());
  }
  *kept_ = *state_;
}

void InflateRun::restore() {
  *state_ = *kept_;
  inflate_->follow(*state_);
}

void InflateRun::accept(double time) {
  state_->time = time;
  lips_.clear();
  find_end();
  if (ended_.empty() && (last_.has_cracked || (last_.has_burnt && inflate_->can_crack()))) {
    split();
  }
  if (ended_.empty() && (last_.has_cracked || last_.has_burnt)) {
    divide();
  }
}

/// Divides the chambers whose walls have separated.
void InflateRun::divide() {
  const std::vector<std::string> lines =
      divide_chambers(inflate_->chambers(), state_->burning->pieces.of_particle, *state_, state_->chamber);
  if (!lines.empty()) {
    state_->pressure.conservativeResizeLike(Eigen::VectorXd::Zero(state_->gas->chambers()));
    inflate_ = std::make_unique<Inflate>(*membrane_, std::move(*inflate_), *state_);
    note_replaced();
  }
  inflate_->follow(*state_);
  for (const std::string& line : lines) {
    output_.console.tell(output_.heading() + line);
  }
}

/// Splits the vertices at which cracks have separated the wall.
void InflateRun::split() {
  const auto timer = output_.clock.time("ablation");
  const SplitCorners corners = find_split_corners(*membrane_, state_->burning->living);
  if (corners.count == 0) {
    return;
  }
  const auto [particles, copies, cells] = packed(*state_, *membrane_, corners);
  lips_ = find_lips(*membrane_, corners);
  LoadedMembrane loaded = pellicle::split(*membrane_, corners, particles, copies, cells, options_.sheet);
  std::unique_ptr<Membrane> membrane = burnable(std::move(loaded.membrane), options_);
  auto state = std::make_unique<BalloonState>(state_at_rest(*membrane, options_, inflate_->chambers().count()));
  take_over(*state, *state_, loaded.particles, loaded.elements);
  auto inflate = std::make_unique<Inflate>(*membrane, std::move(*inflate_), *state);
  kept_ = nullptr;
  state_ = std::move(state);
  inflate_ = std::move(inflate);
  note_replaced();
  membrane_ = std::move(membrane);
  inflate_->follow(*state_);
  update_pieces(state_->burning->pieces, *membrane_, state_->burning->living, state_->time);
}

void InflateRun::find_end() {
  if (!state_->burning) {
    return;
  }
  const BurningFields& fields = *state_->burning;
  ended_ = is_gone() ? "the wall has burnt away" : hole(inflate_->chambers(), *membrane_, state_->position, fields);
  if (ended_.empty() && inflate_->can_crack()) {
    ended_ =
        torn_open(inflate_->chambers(), *membrane_, state_->position, find_split_corners(*membrane_, fields.living));
  }
}

void InflateRun::draw(const FrameSink& write) {
  const auto timer = output_.clock.time("output");
  const PrismElements& wall = inflate_->elements();
  const std::size_t elements = membrane_->triangles.size();
  std::vector<double> thickness(elements);
  std::vector<double> stretch(2 * elements);
  std::vector<double> stress(2 * elements);
  for (std::size_t e = 0; e < elements; ++e) {
    if (wall.stiffness(e) == 0) {
      continue;
    }
    const auto [e12, e13] = edges_of(state_->position.data(), membrane_->triangles[e]);
    thickness[e] = wall.wall().thickness[e] * state_->thickness_ratio[e];
    const PrincipalState principal = wall.principal(e, e12, e13, state_->thickness_ratio[e]);
    Eigen::Map<Eigen::Vector2d>(stretch.data() + 2 * e) = principal.stretch;
    Eigen::Map<Eigen::Vector2d>(stress.data() + 2 * e) = principal.stress;
  }
  Frame frame;
  frame.time = state_->time;
  frame.step = state_->step;
  frame.surface = &surface_;
  frame.positions = state_->position.data();
  frame.particle_fields = drawn_fields(*state_, Item::particle);
  frame.cell_fields = drawn_fields(*state_, Item::cell);
  frame.cell_fields.insert(
      frame.cell_fields.end(),
      {{"thickness", 1, thickness.data()}, {"stretch", 2, stretch.data()}, {"stress", 2, stress.data()}});
  if (state_->burning) {
    draw_burnt(frame, write);
  } else {
    write(frame);
  }
}

void InflateRun::draw_burnt(Frame& frame, const FrameSink& write) {
  const BurningFields& fields = *state_->burning;
  surface_ = drawing_of(
      *membrane_, cut_surface(*membrane_, fields.living, level_set(*membrane_, fields.mass, inflate_->loss_mass())));
  const std::vector<double> mass_ratio = mass_ratios(*membrane_, fields.mass);
  frame.particle_fields.push_back({"mass_ratio", 1, mass_ratio.data()});
  const std::vector<double> masses = piece_masses(fields.pieces, *membrane_, fields.mass);
  const PieceFields pieces(*membrane_, fields.pieces, masses);
  const std::vector<DrawnField> of_pieces = pieces.drawn();
  frame.cell_fields.insert(frame.cell_fields.end(), of_pieces.begin(), of_pieces.end());
  if (write(frame)) {
    ledger_->add(state_->time, state_->step, fields.pieces, masses);
  }
}

void InflateRun::save(Hdf5File& checkpoint) const {
  const std::vector<PetscInt>& particles = membrane_->persistent_id;
  const std::vector<PetscInt>& elements = membrane_->element_id;
  write_mesh(checkpoint, balloon_mesh(output_), rows_of(*membrane_, {}, {}));
  write_fields(checkpoint, balloon_state(output_), *state_,
               {particles.begin(), particles.begin() + membrane_->particles.owned},
               {elements.begin(), elements.begin() + membrane_->elements.owned});
  ledger_->save(checkpoint);
}

void InflateRun::resume_output(const Hdf5File& checkpoint) { ledger_->resume(checkpoint); }

void InflateRun::record(double h, int retries) {
  if (last_.is_factorised && ++factorised_steps_ == 1) {
    output_.console.tell(output_.heading() + "step " + std::to_string(state_->step) +
                         ": the tangent is factorised (prism.factor)");
  }
  for (const std::string& line : newly_open(inflate_->chambers(), *state_, told_open_)) {
    output_.console.tell(output_.heading() + line);
  }
  ledger_->add(*inflate_, *state_, last_, h, retries);
}

std::vector<std::string> InflateRun::first_remarks() const {
  std::vector<std::string> lines;
  if (inflate_->burns()) {
    for (const std::string& line : front_remarks(options_, mean_side(*membrane_))) {
      lines.push_back(line);
    }
  }
  if (const std::string words = inflate_->crack_remark(); !words.empty()) {
    lines.push_back(words);
  }
  return lines;
}

std::vector<std::string> InflateRun::remarks() const {
  std::vector<std::string> lines = ledger_->remarks();
  if (factorised_steps_ > 0) {
    lines.push_back("linear solver: the tangent was factorised in " + std::to_string(factorised_steps_) + " steps");
  }
  return lines;
}

}  // namespace world
}  // namespace pellicle
