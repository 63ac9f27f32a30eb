#include "world/burn_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "ablation/cut_surface.h"
#include "ablation/drawn_shares.h"
#include "base/error.h"
#include "base/units.h"
#include "parallel/collective.h"
#include "state/field_tables.h"
#include "state/mesh_tables.h"
#include "surface/compaction.h"
#include "surface/shell.h"
#include "world/contact_of_object.h"
#include "world/contact_start.h"
#include "world/gas_of_object.h"
#include "world/load_mesh.h"
#include "world/non_finite.h"
#include "world/piece_fields.h"
#include "world/renumbering.h"
#include "world/step_reach.h"

namespace pellicle {
inline namespace world {

namespace {

// Names in a checkpoint, in the group of the object.
std::string sheet_mesh(const ObjectOutput& output) { return output.group("sheet") + "/mesh"; }
std::string sheet_ids(const ObjectOutput& output) { return sheet_mesh(output) + "/first_lattice_id_and_end"; }
std::string sheet_state(const ObjectOutput& output) { return output.group("sheet") + "/state"; }

/// Persistent ids of the first local cells; they are those of their lattice particles.
std::vector<PetscInt> cell_ids(const Sheet& sheet, std::size_t count) {
  std::vector<PetscInt> ids;
  for (std::size_t cell = 0; cell < count; ++cell) {
    ids.push_back(sheet.persistent_id[sheet.lattice[cell]]);
  }
  return ids;
}

/// The sheet of a checkpoint. Collective.
Sheet read_sheet(const Hdf5File& checkpoint, const SheetOptions& options, const ObjectOutput& output) {
  const std::vector<PetscInt> ids = checkpoint.read_all<PetscInt>(sheet_ids(output));
  return make_sheet(checkpoint.comm(), read_mesh(checkpoint, sheet_mesh(output)), SheetIds{ids.at(0), ids.at(1)},
                    options)
      .sheet;
}

/// What frames show of the local particles in addition to the state's fields.
struct ParticleFields {
  std::vector<double> mass_ratio;            ///< m/m^init
  std::vector<double> mass_ratio_of_layers;  ///< of a particle and its surroundings in the other layer
  std::vector<double> strain;                ///< rms over the living springs of a particle
};

/// Mass over initial mass of each local particle together with the shares of its cells that belong to the other layer:
/// for a corner an eighth from the lattice particles of its cells, for a lattice particle an eighth from each corner of
/// its cell. Removed particles do not count. Collective.
std::vector<double> mass_ratio_of_layers(const Sheet& sheet, const Field& mass) {
  Field sum(sheet.particles, 2);  // of masses, and of initial masses
  const auto add = [&](PetscInt to, PetscInt from, double initial) {
    const double m = mass.data()[from];
    if (m > 0) {
      sum.values().col(to) += initial * Eigen::Vector2d(m / sheet.initial_mass[from], 1);
    }
  };
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    add(i, i, sheet.initial_mass[i]);
  }
  for (PetscInt cell = 0; cell < sheet.elements.owned; ++cell) {
    const PetscInt lattice = sheet.lattice[cell];
    const double eighth = sheet.initial_mass[lattice] / 4;
    for (const PetscInt corner : sheet.cells[cell]) {
      add(corner, lattice, eighth);
      add(lattice, corner, eighth);
    }
  }
  sum.add_ghosts();
  sum.update_ghosts();
  std::vector<double> ratio;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const auto of_particle = sum.values().col(i);
    ratio.push_back(of_particle[1] > 0 ? of_particle[0] / of_particle[1] : 0);
  }
  return ratio;
}

/// Collective.
ParticleFields derive(const Sheet& sheet, const State& state) {
  ParticleFields fields;
  const auto particles = static_cast<std::size_t>(sheet.particles.local());
  fields.mass_ratio.resize(particles);
  for (std::size_t i = 0; i < particles; ++i) {
    fields.mass_ratio[i] = state.mass.data()[i] / sheet.initial_mass[i];
  }
  fields.mass_ratio_of_layers = mass_ratio_of_layers(sheet, state.mass);
  Field sum(sheet.particles, 2);  // of squared strains, and how many
  for (const Colour colour : all_colours) {
    if (!sheet.acts(colour)) {
      continue;
    }
    const std::vector<double> strain = strains(sheet.of(colour), state, colour);
    for (PetscInt s = 0; s < sheet.of(colour).owned(); ++s) {
      if (!state.living.springs[static_cast<std::size_t>(colour)][s]) {
        continue;
      }
      const double value = strain[s];
      for (const PetscInt end : sheet.of(colour).ends[s]) {
        sum.values().col(end) += Eigen::Vector2d(value * value, 1);
      }
    }
  }
  sum.add_ghosts();
  sum.update_ghosts();
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    fields.strain.push_back(std::sqrt(sum.values()(0, i) / std::max(1.0, sum.values()(1, i))));
  }
  return fields;
}

/// What frames show of the owned springs, colour after colour.
struct SpringFields {
  std::vector<double> strain;
  std::vector<double> target_length;  ///< [m]
  std::vector<double> state;          ///< a SpringState
};

/// @param level of the local particles, see level_set
SpringFields derive(const Sheet& sheet, const State& state, const std::vector<double>& level) {
  SpringFields fields;
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    const std::vector<double>& lengths = state.target_length[static_cast<std::size_t>(colour)];
    const std::vector<double> strain = strains(set, state, colour);
    fields.strain.insert(fields.strain.end(), strain.begin(), strain.begin() + set.owned());
    fields.target_length.insert(fields.target_length.end(), lengths.begin(), lengths.begin() + set.owned());
    for (PetscInt s = 0; s < set.owned(); ++s) {
      const auto [a, b] = set.ends[s];
      fields.state.push_back(static_cast<double>(spring_state(level[a], level[b])));
    }
  }
  return fields;
}

/// Prints the curves of Fig. 8 for one time step.
void print_errors(MPI_Comm comm, const std::vector<ProjectionError>& errors) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  for (const ProjectionError& error : errors) {
    if (rank == 0) {
      const char* after = error.projected ? colour_names[static_cast<std::size_t>(*error.projected)] : "start";
      std::printf("  projection step %d %-6s ||C|| red %.4e green %.4e blue %.4e yellow %.4e all %.4e\n", error.step,
                  after, error.colour[0], error.colour[1], error.colour[2], error.colour[3], error.total);
    }
  }
}

/// A line where a sheet has the layers of a thin material, but not its stiffness; empty: it has not.
std::string default_stiffness_remark(const Options& options) {
  constexpr double thin = 1e-3;     // [m]
  constexpr double of_paper = 3e9;  // [Pa]
  const SheetMaterial& material = options.material;
  if (options.dynamics != Dynamics::elastic || material.young_modulus || material.tensile_stiffness ||
      options.sheet.thickness > thin) {
    return "";
  }
  return fmt::format(
      "sheet.tensile_stiffness: {:.4g} N/m, the default, not that of a material {:.3g} m thick (sheet.thickness): "
      "such paper has some {:.1g} N/m; expected sheet.young_modulus with sheet.physical_thickness, or stiffnesses",
      stiffness_of(material).tensile[0], options.sheet.thickness, of_paper * options.sheet.thickness);
}

/// Refuses a threshold below which a projection would leave the sheet as it is, unless a limit of the strain bounds
/// that. Collective.
void require_threshold(const Sheet& sheet, const Options& options) {
  constexpr double most = 0.01;
  double squares = 0;  // of the lengths
  for (const SpringSet& springs : sheet.springs) {
    const auto end = springs.initial_length.begin() + springs.owned();
    squares = std::inner_product(springs.initial_length.begin(), end, springs.initial_length.begin(), squares);
  }
  squares = sum_over_ranks(sheet.comm(), squares);
  if (options.dynamics == Dynamics::projection && !options.project.strain_limit &&
      options.project.threshold > most * std::sqrt(squares)) {
    throw Error("project.threshold: " + number_text(options.project.threshold) + " m, expected at most " +
                number_text(most * std::sqrt(squares)) +
                " m, a hundredth of the norm of all springs' lengths, or project.strain_limit");
  }
}

}  // namespace

BurnRun::BurnRun(Sheet sheet, const Options& options, const ObjectOutput& output)
    : options_(options),
      output_(output),
      sheet_(std::make_unique<Sheet>(std::move(sheet))),
      burn_(std::make_unique<Burn>(*sheet_, options, output.clock)),
      state_(std::make_unique<State>(burn_->initial_state())),
      ledger_(std::make_unique<SheetLedger>(output_, options_, burn_->chambers())) {
  require_threshold(*sheet_, options);
  burn_->follow(*state_);
  refuse_start_in_bodies(*this, burn_->bodies());
}

BurnRun::BurnRun(const Hdf5File& checkpoint, const Options& options, const ObjectOutput& output)
    : options_(options),
      output_(output),
      sheet_(std::make_unique<Sheet>(read_sheet(checkpoint, shell_options(options), output))),
      state_(std::make_unique<State>(*sheet_)) {
  if (gas_is_joined(options)) {
    const auto chambers = checkpoint.read_all<double>(sheet_state(output) + "/once/pressure").size();
    state_->add_gas(static_cast<int>(chambers), static_cast<int>(options.gas.links.size()));
  }
  read_fields(checkpoint, sheet_state(output), *state_, sheet_->persistent_id, cell_ids(*sheet_, sheet_->cells.size()));
  burn_ = std::make_unique<Burn>(*sheet_, options, output.clock, *state_);
  burn_->follow(*state_);
  told_open_ = opened_chambers(*state_);
  ledger_ = std::make_unique<SheetLedger>(output_, options_, burn_->chambers());
  find_end();
}

StepResult BurnRun::begin(double h) {
  last_ = within_reach(options_, *sheet_, *state_, h, [&] { return burn_->begin(*state_, h); });
  return {last_.converged, last_.reason, last_.heat_iterations};
}

StepResult BurnRun::end(const EquilibriumResult& balance) {
  burn_->end(*state_, balance, last_);
  return result();
}

/// Figures of the last step.
StepResult BurnRun::result() {
  StepResult result;
  result.converged = last_.converged;
  result.reason = last_.reason;
  if (result.converged) {
    const auto particles = static_cast<std::size_t>(sheet_->particles.local());
    result.reason = non_finite(sheet_->comm(), {{"position", state_->position.data(), 3 * particles},
                                                {"velocity", state_->velocity.data(), 3 * particles},
                                                {"temperature", state_->temperature.data(), particles},
                                                {"mass", state_->mass.data(), particles}});
    result.converged = result.reason.empty();
  }
  result.iterations = last_.heat_iterations + last_.dynamics_iterations;
  result.step_error = last_.step_error;
  result.newton_iterations = last_.newton_iterations;
  result.figures = fmt::format("|C| {:.3e} m", last_.constraint_error);
  return result;
}

void BurnRun::keep() {
  if (kept_ == nullptr) {
    kept_ = std::make_unique<State>(*sheet_);
  }
  *kept_ = *state_;
}

void BurnRun::restore() { *state_ = *kept_; }

void BurnRun::accept(double time) {
  state_->time = time;
  lips_.clear();
  find_end();
  if (!ended_.empty()) {
    return;
  }
  const auto timer = output_.clock.time("compaction");
  if (last_.cracked || (last_.died && options_.ablation.strength)) {
    split();
  }
  if (burn_->chambers().count() > 0) {  // the walls of chambers keep all cells
    divide();
  } else if (last_.died && lips_.empty() && options_.ablation.compact_fraction < 1) {
    compact();  // Lips are to be opened before, with their present numbers.
  }
}

/// Divides the chambers whose walls have separated.
void BurnRun::divide() {
  if (!last_.cracked && !last_.died) {
    return;
  }
  const std::vector<std::string> lines =
      divide_chambers(burn_->chambers(), state_->pieces.of_particle, *state_, state_->chamber);
  if (!lines.empty()) {
    state_->pressure.resize(state_->gas->chambers());
    burn_ = std::make_unique<Burn>(*sheet_, std::move(*burn_), *state_);
    note_replaced();
  }
  burn_->follow(*state_);
  for (const std::string& line : lines) {
    output_.console.tell(output_.heading() + line);
  }
}

/// Splits the corners at which cracks have separated the sheet.
void BurnRun::split() {
  const SplitCorners corners = find_split_corners(*sheet_, state_->living);
  if (corners.count > 0) {
    const auto [particles, copies, cells] = packed(*state_, *sheet_, corners);
    lips_ = find_lips(*sheet_, corners);
    take_over(pellicle::split(*sheet_, corners, particles, copies, cells, shell_options(options_)));
    update_pieces(state_->pieces, *sheet_, state_->living, state_->time);
  }
}

/// Removes cells of which nothing is left, if they are many.
void BurnRun::compact() {
  std::vector<bool> kept = empty_cells(*sheet_, state_->living);
  kept.flip();
  auto left = static_cast<PetscInt>(std::count(kept.begin(), kept.end(), true));
  left = sum_over_ranks(sheet_->comm(), left);
  const PetscInt before = sheet_->elements.global;
  if (static_cast<double>(before - left) > options_.ablation.compact_fraction * static_cast<double>(before)) {
    take_over(pellicle::compact(*sheet_, kept, packed(*state_, Item::particle, sheet_->particles.owned),
                                packed(*state_, Item::cell, sheet_->elements.owned), shell_options(options_)));
    output_.console.say(output_.heading() + "step " + std::to_string(state_->step) + ": " +
                        std::to_string(before - left) + " of " + std::to_string(before) + " cells are gone; " +
                        partition_line(*sheet_));
  }
}

void BurnRun::spread(const std::vector<double>& load) {
  constexpr int interval = 50;  // steps
  int ranks = 1;
  MPI_Comm_size(sheet_->comm(), &ranks);
  if (ranks == 1 || options_.sheet.partitioner != Partitioner::metis || state_->step % interval != 0) {
    return;
  }
  const RankShares shares = shares_of_ranks(sheet_->comm(), std::accumulate(load.begin(), load.end(), 0.0));
  if (shares.sum > sheet_->elements.global && shares.imbalance > options_.sheet.imbalance_limit) {
    take_over(pellicle::spread(*sheet_, load, packed(*state_, Item::particle, sheet_->particles.owned),
                               packed(*state_, Item::cell, sheet_->elements.owned), shell_options(options_)));
    output_.console.say(output_.heading() + "step " + std::to_string(state_->step) + ": " + partition_line(*sheet_));
  }
}

/// Continues with a sheet that was made from the present one, and the data that came with its items.
void BurnRun::take_over(LoadedSheet loaded) {
  auto sheet = std::make_unique<Sheet>(std::move(loaded.sheet));
  auto state = std::make_unique<State>(*sheet);
  if (state_->gas != nullptr) {
    state->add_gas(burn_->chambers().count(), static_cast<int>(options_.gas.links.size()));
  }
  pellicle::take_over(*state, *state_, loaded.particles, loaded.cells);
  auto burn = std::make_unique<Burn>(*sheet, std::move(*burn_), *state);
  burn->follow(*state);

  kept_ = nullptr;
  state_ = std::move(state);
  burn_ = std::move(burn);
  note_replaced();
  sheet_ = std::move(sheet);
}

void BurnRun::find_end() {
  ended_ = is_gone() ? "the sheet has burnt away" : hole(burn_->chambers(), *sheet_, state_->position, *state_);
  if (ended_.empty() && burn_->chambers().count() > 0 && options_.ablation.strength) {
    ended_ = torn_open(burn_->chambers(), *sheet_, state_->position, find_split_corners(*sheet_, state_->living));
  }
}

void BurnRun::draw(const FrameSink& write) {
  const auto timer = output_.clock.time("output");
  const ParticleFields fields = derive(*sheet_, *state_);
  const std::vector<double> level = level_set(*sheet_, state_->mass, options_.ablation.loss_mass);
  DrawnSurface cut = cut_surface(*sheet_, state_->living, level);
  const DrawnShares shares(*sheet_, state_->living, cut, state_->position);
  const Drawing surface = drawing_of(*sheet_, std::move(cut));
  Field heat(sheet_->particles, 1);
  heat.values() = options_.heat.capacity * state_->mass.values().cwiseProduct(state_->temperature.values());
  const std::vector<double> areal_density = shares.density(state_->mass);
  const std::vector<double> heat_density = shares.density(heat);
  const std::vector<double> masses = piece_masses(state_->pieces, *sheet_, state_->mass);
  const PieceFields pieces(*sheet_, state_->pieces, masses);
  Frame frame;
  frame.time = state_->time;
  frame.step = state_->step;
  frame.surface = &surface;
  frame.positions = state_->position.data();
  // The surface is drawn where the corners are and moves with them; temperature and mass are of both layers.
  const auto with = [this](Item item, const std::vector<DrawnField>& derived) {
    std::vector<DrawnField> all = drawn_fields(*state_, item);
    all.insert(all.end(), derived.begin(), derived.end());
    return all;
  };
  frame.particle_fields = with(Item::particle, {{"mass_ratio", 1, fields.mass_ratio_of_layers.data(), true},
                                                {"strain", 1, fields.strain.data()}});
  frame.cell_fields =
      with(Item::cell, {{"areal_density", 1, areal_density.data()}, {"heat_density", 1, heat_density.data()}});
  const std::vector<DrawnField> of_pieces = pieces.drawn();
  frame.cell_fields.insert(frame.cell_fields.end(), of_pieces.begin(), of_pieces.end());
  std::optional<Drawing> springs;
  SpringFields spring_fields;
  if (options_.output.springs) {
    springs = drawing_of_springs(*sheet_, state_->living);
    spring_fields = derive(*sheet_, *state_, level);
    frame.springs = &*springs;
    frame.spring_ends = {{"temperature", 1, state_->temperature.data()},
                         {"mass_ratio", 1, fields.mass_ratio.data()},
                         {"velocity", 3, state_->velocity.data()},
                         {"strain", 1, fields.strain.data()}};
    frame.spring_fields = {{"strain", 1, spring_fields.strain.data()},
                           {"target_length", 1, spring_fields.target_length.data()},
                           {"state", 1, spring_fields.state.data()}};
  }
  if (write(frame)) {
    ledger_->add(state_->time, state_->step, state_->pieces, masses);
  }
}

void BurnRun::save(Hdf5File& checkpoint) const {
  const auto cells = static_cast<std::size_t>(sheet_->elements.owned);
  const std::vector<PetscInt>& ids = sheet_->persistent_id;
  write_mesh(checkpoint, sheet_mesh(output_), rows_of(*sheet_, std::vector<bool>(cells, true), {}, {}));
  checkpoint.write_once<PetscInt>(sheet_ids(output_), {sheet_->first_lattice_id, sheet_->id_end});
  write_fields(checkpoint, sheet_state(output_), *state_, {ids.begin(), ids.begin() + sheet_->particles.owned},
               cell_ids(*sheet_, cells));
  ledger_->save(checkpoint);
}

void BurnRun::resume_output(const Hdf5File& checkpoint) { ledger_->resume(checkpoint); }

std::vector<std::string> BurnRun::first_remarks() const {
  std::vector<std::string> lines;
  for (const std::string& line : front_remarks(options_, mean_side(*sheet_))) {
    lines.push_back(line);
  }
  if (const std::string line = default_stiffness_remark(options_); !line.empty()) {
    lines.push_back(line);
  }
  constexpr double worth_a_word = 1.05;
  if (const double excess = burn_->largest_excess(); excess > worth_a_word) {
    lines.push_back(
        fmt::format("some cells are so long that the sheet is {:.2g} times as stiff along them as asked for; expected "
                    "sides that differ by 1.7 at most",
                    excess));
  }
  if (const std::string words = burn_->crack_remark(); !words.empty()) {
    lines.push_back(words);
  }
  return lines;
}

std::vector<std::string> BurnRun::remarks() const { return ledger_->remarks(); }

void BurnRun::record(double h, int retries) {
  if (options_.project.monitor && state_->step > 0) {
    print_errors(sheet_->comm(), burn_->projection_errors());
    ledger_->add(state_->time, state_->step, burn_->projection_errors());
  }
  for (const std::string& line : newly_open(burn_->chambers(), *state_, told_open_)) {
    output_.console.tell(output_.heading() + line);
  }
  if (h == 0) {
    last_.elastic_energy = burn_->elastic_energy(*state_);
  }
  ledger_->add(*sheet_, *state_, *burn_, last_, h, retries);
}

}  // namespace world
}  // namespace pellicle
