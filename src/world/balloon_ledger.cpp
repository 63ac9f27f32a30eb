#include "world/balloon_ledger.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "parallel/collective.h"
#include "surface/membrane_geometry.h"
#include "world/contact_of_object.h"
#include "world/gas_of_object.h"

namespace pellicle {
inline namespace world {

namespace {

// Tables in a checkpoint, in the group of the object: what is known of the steps so far.
const char* const counts_table = "/step_counts";
const char* const residuals_table = "/step_residuals";

std::vector<History::Column> columns_of_balloon(const Inflate& chain, bool contact_apart) {
  std::vector<History::Column> columns = gas_columns(chain.chambers());
  columns.insert(columns.end(), {{"rubber_volume_ratio", ""},
                                 {"thickness_min", "m"},
                                 {"thickness_max", "m"},
                                 {"thickness_ratio_min", ""},
                                 {"thickness_ratio_max", ""},
                                 {"element_volume_ratio_min", ""},
                                 {"element_volume_ratio_max", ""},
                                 {"inverted_elements", ""},
                                 {"newton_iterations", ""},
                                 {"linear_iterations", ""},
                                 {"concave_iterations", ""},
                                 {"residual", "N"},
                                 {"relative_residual", ""},
                                 {"elastic_energy", "J"}});
  const std::vector<History::Column> of_work = work_columns(chain.options());
  columns.insert(columns.end(), of_work.begin(), of_work.end());
  const std::vector<History::Column> of_contact = contact_columns(chain.options().contact, contact_apart);
  columns.insert(columns.end(), of_contact.begin(), of_contact.end());
  if (chain.burns()) {
    columns.push_back({"heat_iterations", ""});
  }
  if (chain.can_crack()) {
    columns.push_back({"cracked_sides", ""});
    columns.push_back({"crack_length", "m"});
  }
  if (chain.goes_by_arc_length()) {
    columns.push_back({"load_time", "s"});
  }
  std::vector<std::string> names;
  for (const Body& body : chain.bodies()) {
    names.push_back(body.name);
  }
  const std::vector<History::Column> of_bodies = body_columns(names);
  columns.insert(columns.end(), of_bodies.begin(), of_bodies.end());
  return columns;
}

double area_of(const double* positions, const std::array<PetscInt, 3>& triangle) {
  const auto [e12, e13] = edges_of(positions, triangle);
  return e12.cross(e13).norm() / 2;
}

}  // namespace

BalloonLedger::BalloonLedger(const ObjectOutput& output, const Inflate& chain)
    : options_(chain.options()),
      group_(output.group("balloon")),
      contact_apart_(output.contact_apart),
      ledger_(output, chain.burns(), columns_of_balloon(chain, output.contact_apart)) {
  const Membrane& membrane = chain.elements().membrane();
  const Wall& wall = chain.elements().wall();
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    initial_rubber_volume_ += wall.rest[e].volume;
  }
  initial_rubber_volume_ = sum_over_ranks(membrane.comm(), initial_rubber_volume_);
}

void BalloonLedger::resume(const Hdf5File& checkpoint) {
  const std::vector<int> counts = checkpoint.read_all<int>(group_ + counts_table);
  const std::vector<double> residuals = checkpoint.read_all<double>(group_ + residuals_table);
  steps_ = counts.at(0);
  steps_above_tolerance_ = counts.at(1);
  worst_step_ = counts.at(2);
  concave_steps_ = counts.at(3);
  first_concave_step_ = counts.at(4);
  worst_residual_ = residuals.at(0);
  last_residual_ = residuals.at(1);
  ledger_.resume(checkpoint);
}

void BalloonLedger::save(Hdf5File& checkpoint) const {
  ledger_.save(checkpoint);
  checkpoint.write_once<int>(group_ + counts_table,
                             {steps_, steps_above_tolerance_, worst_step_, concave_steps_, first_concave_step_});
  checkpoint.write_once<double>(group_ + residuals_table, {worst_residual_, last_residual_});
}

void BalloonLedger::add(const Inflate& chain, const BalloonState& state, const InflateStep& step, double h,
                        int retries) {
  const PrismElements& elements = chain.elements();
  const Membrane& membrane = elements.membrane();
  enum Sum { rubber, elastic, count };
  std::array<double, count> sums{};
  // Of thickness, its ratio and an element's volume ratio: the largest values, and the negative of the least.
  std::array<std::array<double, 2>, 3> maxima;
  maxima.fill({-HUGE_VAL, -HUGE_VAL});
  sums[rubber] = elements.volume(state.position, state.thickness_ratio);
  sums[elastic] = elements.energy(state.position, state.thickness_ratio) + chain.bending_energy(state);
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    if (elements.stiffness(e) == 0) {
      continue;
    }
    const double ratio = state.thickness_ratio[e];
    const double area = area_of(state.position.data(), membrane.triangles[e]);
    const std::array<double, 3> values{elements.wall().thickness[e] * ratio, ratio,
                                       ratio * area / elements.wall().rest[e].area};
    for (std::size_t k = 0; k < values.size(); ++k) {
      maxima[k] = {std::max(maxima[k][0], values[k]), std::max(maxima[k][1], -values[k])};
    }
  }
  sums = sum_over_ranks(membrane.comm(), sums);
  MPI_Allreduce(MPI_IN_PLACE, maxima.front().data(), 6, MPI_DOUBLE, MPI_MAX, membrane.comm());

  std::vector<double> own = gas_values(chain.chambers(), state, state.pressure.data(), state.time_of_loads());
  own.insert(own.end(),
             {sums[rubber] / initial_rubber_volume_, -maxima[0][1], maxima[0][0], -maxima[1][1], maxima[1][0],
              -maxima[2][1], maxima[2][0], static_cast<double>(step.inverted),
              static_cast<double>(step.newton_iterations), static_cast<double>(step.linear_iterations),
              static_cast<double>(step.concave_iterations), step.residual, step.relative_residual, sums[elastic]});
  const std::vector<double> of_work = work_values(chain.options(), state.work);
  own.insert(own.end(), of_work.begin(), of_work.end());
  const std::vector<double> of_contact =
      contact_values(options_.contact, contact_apart_, step.touching, membrane, state,
                     state.burning ? &state.burning->living.triangles : nullptr);
  own.insert(own.end(), of_contact.begin(), of_contact.end());
  if (chain.burns()) {
    own.push_back(static_cast<double>(step.heat_iterations));
  }
  if (chain.can_crack()) {
    cracks_ = {state.burning->cracked_sides, state.burning->crack_length};
    cracks_ = sum_over_ranks(membrane.comm(), cracks_);
    own.insert(own.end(), cracks_.begin(), cracks_.end());
  }
  if (state.load_time != nullptr) {
    own.push_back(*state.load_time);
  }
  const std::vector<double> of_bodies = body_values(chain.bodies().size(), step.loads);
  own.insert(own.end(), of_bodies.begin(), of_bodies.end());
  ledger_.add({membrane, state, chain.mass().data(), state.burning ? &*state.burning : nullptr, chain.heat_capacity(),
               chain.loss_mass(), h, retries},
              own);

  steps_ = state.step;
  last_residual_ = step.relative_residual;
  if (step.is_above_tolerance) {
    ++steps_above_tolerance_;
    if (step.relative_residual > worst_residual_) {
      worst_residual_ = step.relative_residual;
      worst_step_ = state.step;
    }
  }
  if (step.concave_iterations > 0 && ++concave_steps_ == 1) {
    first_concave_step_ = state.step;
  }
}

std::vector<std::string> BalloonLedger::remarks() const {
  std::vector<std::string> lines;
  if (steps_above_tolerance_ > 0) {
    lines.push_back(fmt::format(
        "residual: {} of {} steps ended above {}: out of balance by {:.2g} of their forces at worst, in step "
        "{}, and by {:.2g} in the last one",
        steps_above_tolerance_, steps_,
        options_.prism.newton == NewtonEnd::converged
            ? "prism.snes_rtol, as far as the rounding of the places lets Newton's method go"
            : "prism.residual_tolerance",
        worst_residual_, worst_step_, last_residual_));
  }
  if (concave_steps_ > 0) {
    lines.push_back(fmt::format(
        "equilibria: in {} of {} steps, first in step {}, the tangent was not positive definite (history.csv: "
        "concave_iterations): such a step may have several equilibria, and with another length find another",
        concave_steps_, steps_, first_concave_step_));
  }
  if (cracks_[0] > 0) {
    lines.push_back(crack_line(cracks_));
  }
  const std::vector<std::string> of_fire = ledger_.remarks(options_);
  lines.insert(lines.end(), of_fire.begin(), of_fire.end());
  return lines;
}

}  // namespace world
}  // namespace pellicle
