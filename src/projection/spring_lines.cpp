#include "projection/spring_lines.h"

#include <utility>

#include "parallel/exchange.h"

namespace pellicle {
inline namespace projection {

namespace {

constexpr PetscInt none = -1;

std::size_t at(PetscInt number) { return static_cast<std::size_t>(number); }

/// Builds the lines step by step.
class LineFinder {
 public:
  LineFinder(const SpringSet& set, const Layout& particles)
      : set_(set), incidence_(set, particles.local()), partner_(at(set.owned()), {none, none}) {
    for (PetscInt particle = 0; particle < particles.local(); ++particle) {
      pair_springs(particle);
    }
    trace_lines();
    choose_families();
    for (PetscInt particle = 0; particle < particles.local(); ++particle) {
      keep_crossing_springs(particle);
    }
    keep_springs_that_meet_other_ranks();
  }

  SpringLines result() const {
    SpringLines result;
    for (const std::vector<PetscInt>& line : lines_) {
      PetscInt previous = none;
      for (const PetscInt spring : line) {
        auto& chains = is_eliminated_[at(spring)] ? result.eliminated : result.kept;
        if (previous == none || is_eliminated_[at(previous)] != is_eliminated_[at(spring)]) {
          chains.emplace_back();
        }
        chains.back().push_back(spring);
        previous = spring;
      }
    }
    return result;
  }

 private:
  /// The local springs at a particle.
  struct Range {
    const PetscInt* first;
    const PetscInt* last;
    const PetscInt* begin() const { return first; }
    const PetscInt* end() const { return last; }
    PetscInt size() const { return static_cast<PetscInt>(last - first); }
  };
  Range springs_at(PetscInt particle) const {
    const PetscInt* all = incidence_.springs.data();
    return {all + incidence_.offsets[at(particle)], all + incidence_.offsets[at(particle) + 1]};
  }
  std::size_t end_at(PetscInt spring, PetscInt particle) const { return set_.ends[at(spring)][0] == particle ? 0 : 1; }
  PetscInt other_end(PetscInt spring, PetscInt particle) const {
    return set_.ends[at(spring)][1 - end_at(spring, particle)];
  }

  /// Whether both springs at a particle are sides of one quad of the net.
  bool share_quad(PetscInt particle, PetscInt one, PetscInt other) const {
    const PetscInt a = other_end(one, particle);
    const PetscInt b = other_end(other, particle);
    for (const PetscInt from_a : springs_at(a)) {
      for (const PetscInt from_b : springs_at(b)) {
        if (from_a != one && from_b != other && other_end(from_a, a) == other_end(from_b, b)) {
          return true;
        }
      }
    }
    return false;
  }

  void join(PetscInt particle, PetscInt one, PetscInt other) {
    if (one < set_.owned() && other < set_.owned()) {
      partner_[at(one)][end_at(one, particle)] = other;
      partner_[at(other)][end_at(other, particle)] = one;
    }
  }

  /// Joins opposite springs: those that are not sides of one quad. At the border quads are missing, so that springs may
  /// look opposite that are not; four springs are joined only two by two.
  void pair_springs(PetscInt particle) {
    const Range springs = springs_at(particle);
    if (springs.size() == 4) {
      const PetscInt* s = springs.first;
      for (const std::array<std::size_t, 4>& pairs :
           {std::array<std::size_t, 4>{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}}) {
        if (!share_quad(particle, s[pairs[0]], s[pairs[1]]) && !share_quad(particle, s[pairs[2]], s[pairs[3]])) {
          join(particle, s[pairs[0]], s[pairs[1]]);
          join(particle, s[pairs[2]], s[pairs[3]]);
          return;
        }
      }
      return;
    }
    std::vector<bool> is_joined(at(springs.size()), false);
    for (std::size_t i = 0; i < is_joined.size(); ++i) {
      for (std::size_t j = i + 1; j < is_joined.size() && !is_joined[i]; ++j) {
        if (!is_joined[j] && !share_quad(particle, springs.first[i], springs.first[j])) {
          join(particle, springs.first[i], springs.first[j]);
          is_joined[i] = is_joined[j] = true;
        }
      }
    }
  }

  void trace_lines() {
    line_of_.assign(partner_.size(), none);
    const auto next = [this](std::pair<PetscInt, std::size_t> from) {
      const auto [spring, end] = from;
      const PetscInt following = partner_[at(spring)][end];
      return std::pair{following, 1 - end_at(following, set_.ends[at(spring)][end])};
    };
    for (PetscInt start = 0; start < set_.owned(); ++start) {
      if (line_of_[at(start)] != none) {
        continue;
      }
      std::pair<PetscInt, std::size_t> last{start, 0};
      bool is_closed = false;
      while (partner_[at(last.first)][last.second] != none && !is_closed) {
        last = next(last);
        is_closed = last.first == start;
      }
      const auto line = static_cast<PetscInt>(lines_.size());
      lines_.emplace_back();
      std::pair<PetscInt, std::size_t> current{last.first, 1 - last.second};
      while (true) {
        lines_.back().push_back(current.first);
        line_of_[at(current.first)] = line;
        if (partner_[at(current.first)][current.second] == none) {
          break;
        }
        current = next(current);
        if (line_of_[at(current.first)] == line) {
          break;
        }
      }
      if (is_closed) {  // Cut: its last spring becomes a line of its own.
        const PetscInt cut = lines_.back().back();
        lines_.back().pop_back();
        line_of_[at(cut)] = static_cast<PetscInt>(lines_.size());
        lines_.push_back({cut});
        cuts_.push_back(cut);
      }
    }
  }

  /// Lines that cross get different families where that is possible.
  void choose_families() {
    std::vector<bool> is_chosen(lines_.size(), false);
    std::vector<bool> is_first_family(lines_.size(), false);
    std::vector<std::size_t> queue;
    for (std::size_t start = 0; start < lines_.size(); ++start) {
      if (is_chosen[start]) {
        continue;
      }
      is_chosen[start] = is_first_family[start] = true;
      queue.assign(1, start);
      for (std::size_t head = 0; head < queue.size(); ++head) {
        for (const PetscInt spring : lines_[queue[head]]) {
          for (const PetscInt particle : set_.ends[at(spring)]) {
            for (const PetscInt crossing : springs_at(particle)) {
              const PetscInt line = crossing < set_.owned() ? line_of_[at(crossing)] : none;
              if (line != none && !is_chosen[at(line)]) {
                is_chosen[at(line)] = true;
                is_first_family[at(line)] = !is_first_family[queue[head]];
                queue.push_back(at(line));
              }
            }
          }
        }
      }
    }
    is_eliminated_.resize(partner_.size());
    for (std::size_t spring = 0; spring < is_eliminated_.size(); ++spring) {
      is_eliminated_[spring] = is_first_family[at(line_of_[spring])];
    }
    for (const PetscInt cut : cuts_) {
      is_eliminated_[at(cut)] = false;
    }
  }

  /// Of the eliminated springs at a particle, one pair may stay.
  void keep_crossing_springs(PetscInt particle) {
    PetscInt first = none;
    for (const PetscInt spring : springs_at(particle)) {
      if (spring >= set_.owned() || !is_eliminated_[at(spring)]) {
        continue;
      }
      if (first == none) {
        first = spring;
      } else if (partner_[at(first)][end_at(first, particle)] != spring) {
        is_eliminated_[at(spring)] = false;
      }
    }
  }

  /// Of two eliminated springs of different ranks that share a particle, the lower rank's may stay.
  void keep_springs_that_meet_other_ranks() {
    std::vector<bool> eliminated = is_eliminated_;
    eliminated.resize(at(set_.local()));
    update_ghosts(set_.layout, eliminated);
    for (std::size_t spring = 0; spring < is_eliminated_.size(); ++spring) {
      for (const PetscInt particle : set_.ends[spring]) {
        for (const PetscInt other : springs_at(particle)) {
          if (other >= set_.owned() && eliminated[at(other)] && set_.layout.to_global(other) < set_.layout.first) {
            is_eliminated_[spring] = false;
          }
        }
      }
    }
  }

  const SpringSet& set_;
  SpringIncidence incidence_;
  std::vector<std::array<PetscInt, 2>> partner_;  ///< spring in which an owned spring's line goes on at either end
  std::vector<std::vector<PetscInt>> lines_;
  std::vector<PetscInt> line_of_;
  std::vector<PetscInt> cuts_;  ///< springs at which closed lines are cut
  std::vector<bool> is_eliminated_;
};

}  // namespace

SpringIncidence::SpringIncidence(const SpringSet& set, PetscInt particles) {
  offsets.assign(at(particles) + 1, 0);
  for (const auto& ends : set.ends) {
    for (const PetscInt end : ends) {
      ++offsets[at(end) + 1];
    }
  }
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    offsets[i] += offsets[i - 1];
  }
  springs.resize(2 * set.ends.size());
  std::vector<PetscInt> next(offsets.begin(), offsets.end() - 1);
  for (std::size_t s = 0; s < set.ends.size(); ++s) {
    for (const PetscInt end : set.ends[s]) {
      springs[at(next[at(end)]++)] = static_cast<PetscInt>(s);
    }
  }
}

SpringLines find_lines(const SpringSet& set, const Layout& particles) { return LineFinder(set, particles).result(); }

}  // namespace projection
}  // namespace pellicle
