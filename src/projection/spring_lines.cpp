#include "projection/spring_lines.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::projection {

namespace {

constexpr PetscInt none = -1;

/// Builds the lines step by step.
class LineFinder {
 public:
  LineFinder(const SpringSet& set, const Layout& particles)
      : set_(set), incidence_(set.ends, particles.local()), following_(set.owned(), {none, none}) {
    find_corners();
    for (PetscInt particle = 0; particle < particles.local(); ++particle) {
      pair_springs(particle);
    }
    trace_lines();
    choose_families();
    agree_on_families();
    for (PetscInt particle = 0; particle < particles.local(); ++particle) {
      keep_crossing_springs(particle);
    }
    keep_springs_that_meet_other_ranks();
    choose_separators();
  }

  SpringLines result() const {
    SpringLines result;
    for (const std::vector<PetscInt>& line : lines_) {
      PetscInt previous = none;
      for (const PetscInt spring : line) {
        auto& chains = (is_eliminated_[spring] ? result.eliminated : result.kept).lines;
        if (previous == none || is_eliminated_[previous] != is_eliminated_[spring] || is_separator_[previous] ||
            is_separator_[spring]) {
          chains.emplace_back();
        }
        chains.back().push_back(spring);
        previous = spring;
      }
    }
    for (const bool eliminated : {true, false}) {
      LineFamily& family = eliminated ? result.eliminated : result.kept;
      family.separators_of_all = separators_of_all_[eliminated ? 0 : 1];
      for (std::size_t line = 0; line < family.lines.size(); ++line) {
        const PetscInt spring = family.lines[line][0];
        if (is_separator_[spring]) {
          add_separator(spring, family);
        } else {
          add_ends(line, family);
        }
      }
    }
    return result;
  }

 private:
  std::size_t end_at(PetscInt spring, PetscInt particle) const { return set_.ends[spring][0] == particle ? 0 : 1; }
  PetscInt other_end(PetscInt spring, PetscInt particle) const {
    return set_.ends[spring][1 - end_at(spring, particle)];
  }

  /// Finds the springs with which each local spring forms corners of quads. As a rank does not have the quads beyond
  /// its ghosts, owners send theirs, so that all ranks with springs at a particle have the same corners. Collective.
  void find_corners() {
    corners_.assign(set_.local(), {{{none, none, none}, {none, none, none}}});
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      for (std::size_t end = 0; end < 2; ++end) {
        const PetscInt particle = set_.ends[spring][end];
        auto* next = corners_[spring][end].begin();
        for (const PetscInt other : incidence_[particle]) {
          if (other != spring && next != corners_[spring][end].end() && share_quad(particle, spring, other)) {
            *next++ = set_.layout.to_global(other);
          }
        }
      }
    }
    update_ghosts(set_.layout, corners_);
  }
  /// Whether this rank has a quad of the weave with both springs at a particle as sides.
  bool share_quad(PetscInt particle, PetscInt one, PetscInt other) const {
    const PetscInt a = other_end(one, particle);
    const PetscInt b = other_end(other, particle);
    for (const PetscInt from_a : incidence_[a]) {
      for (const PetscInt from_b : incidence_[b]) {
        if (from_a != one && from_b != other && other_end(from_a, a) == other_end(from_b, b)) {
          return true;
        }
      }
    }
    return false;
  }
  /// Whether the owner of either spring has a quad with both springs at a particle as sides.
  bool make_corner(PetscInt particle, PetscInt one, PetscInt other) const {
    const auto sees = [&](PetscInt spring, PetscInt beside) {
      const auto& corners = corners_[spring][end_at(spring, particle)];
      return std::find(corners.begin(), corners.end(), set_.layout.to_global(beside)) != corners.end();
    };
    return sees(one, other) || sees(other, one);
  }

  void add_separator(PetscInt spring, LineFamily& family) const {
    family.separators.push_back(spring);
    family.numbers.push_back(number_[spring]);
    for (std::size_t end = 0; end < 2; ++end) {
      const PetscInt next = separator_beside(spring, end);
      if (next != none && number_[spring] < number_[next]) {
        family.neighbours.push_back({spring, next});
        family.neighbour_numbers.push_back(number_[spring]);
      }
    }
  }

  void add_ends(std::size_t line, LineFamily& family) const {
    std::vector<PetscInt>& springs = family.lines[line];
    std::array<PetscInt, 2> separators{none, none};
    for (std::size_t end = 0; end < 2; ++end) {
      const PetscInt spring = end == 0 ? springs.front() : springs.back();
      for (std::size_t side = 0; side < 2; ++side) {
        const PetscInt next = separator_beside(spring, side);
        if (next != none && (springs.size() > 1 || side == end)) {
          separators[end] = next;
        }
      }
    }
    if (separators[0] != none && separators[1] == none) {
      std::reverse(springs.begin(), springs.end());
      std::swap(separators[0], separators[1]);
    }
    for (std::size_t end = 0; end < 2; ++end) {
      if (separators[end] != none) {
        family.ends.push_back(
            {line, end, {end == 0 ? springs.front() : springs.back(), separators[end]}, number_[separators[end]]});
      }
    }
  }

  void join(PetscInt particle, PetscInt one, PetscInt other) {
    for (const auto& [from, to] : {std::pair{one, other}, std::pair{other, one}}) {
      if (from < set_.owned()) {
        following_[from][end_at(from, particle)] = to;
      }
    }
  }

  /// Joins opposite springs: those that make no corner.
  void pair_springs(PetscInt particle) {
    const Incidence::Range all = incidence_[particle];
    std::vector<PetscInt> springs(all.begin(), all.end());
    std::sort(springs.begin(), springs.end(), [this](PetscInt a, PetscInt b) {  // in the same order on all ranks
      return set_.layout.to_global(a) < set_.layout.to_global(b);
    });
    if (springs.size() == 3 || springs.size() == 4) {
      pair_regularly(particle, springs);
      return;
    }
    std::vector<bool> is_joined(springs.size(), false);
    for (std::size_t i = 0; i < springs.size(); ++i) {
      for (std::size_t j = i + 1; j < springs.size() && !is_joined[i]; ++j) {
        if (!is_joined[j] && !make_corner(particle, springs[i], springs[j])) {
          join(particle, springs[i], springs[j]);
          is_joined[i] = is_joined[j] = true;
        }
      }
    }
  }

  /// Joins four springs two by two, or two of three. At the border, where quads are missing, any of several ways is
  /// right.
  void pair_regularly(PetscInt particle, std::vector<PetscInt> s) {
    s.resize(4, none);  // One of three springs is joined with none.
    using Pairs = std::array<SpringPair, 2>;
    const std::array ways{Pairs{{{s[0], s[1]}, {s[2], s[3]}}}, Pairs{{{s[0], s[2]}, {s[1], s[3]}}},
                          Pairs{{{s[0], s[3]}, {s[1], s[2]}}}};
    const auto is_refused = [&](const SpringPair& pair) {
      return pair.other != none && make_corner(particle, pair.own, pair.other);
    };
    const auto chosen = std::find_if(ways.begin(), ways.end(), [&](const Pairs& pairs) {
      return std::none_of(pairs.begin(), pairs.end(), is_refused);
    });
    if (chosen != ways.end()) {
      for (const SpringPair& pair : *chosen) {
        if (pair.other != none) {
          join(particle, pair.own, pair.other);
        }
      }
    }
  }

  void trace_lines() {
    line_of_.assign(following_.size(), none);
    // A spring, and the end of it at which its line goes on; none after the last one of this rank.
    using Place = std::pair<PetscInt, std::size_t>;
    const auto next = [this](const Place& from) {
      const auto [spring, end] = from;
      const PetscInt following = following_[spring][end];
      return following < 0 || following >= set_.owned()
                 ? Place{none, 0}
                 : Place{following, 1 - end_at(following, set_.ends[spring][end])};
    };
    for (PetscInt start = 0; start < set_.owned(); ++start) {
      if (line_of_[start] != none) {
        continue;
      }
      Place last{start, 0};
      bool is_closed = false;
      for (Place place = next(last); place.first != none && !is_closed; place = next(place)) {
        last = place;
        is_closed = last.first == start;
      }
      const auto line = static_cast<PetscInt>(lines_.size());
      lines_.emplace_back();
      for (Place place{last.first, 1 - last.second}; place.first != none && line_of_[place.first] != line;
           place = next(place)) {
        lines_.back().push_back(place.first);
        line_of_[place.first] = line;
      }
      if (is_closed) {  // Cut: its last spring becomes a line of its own.
        const PetscInt cut = lines_.back().back();
        lines_.back().pop_back();
        line_of_[cut] = static_cast<PetscInt>(lines_.size());
        lines_.push_back({cut});
        cuts_.push_back(cut);
      }
    }
  }

  /// Gives crossing lines of this rank different families where possible.
  void choose_families() {
    component_of_line_.assign(lines_.size(), none);
    std::vector<bool> is_first_family(lines_.size(), true);
    std::vector<std::size_t> queue;
    for (std::size_t start = 0; start < lines_.size(); ++start) {
      if (component_of_line_[start] != none) {
        continue;
      }
      component_of_line_[start] = static_cast<PetscInt>(start);
      queue.assign(1, start);
      for (std::size_t head = 0; head < queue.size(); ++head) {
        for (const PetscInt spring : lines_[queue[head]]) {
          for (const PetscInt particle : set_.ends[spring]) {
            for (const PetscInt crossing : incidence_[particle]) {
              const PetscInt line = crossing < set_.owned() ? line_of_[crossing] : none;
              if (line != none && component_of_line_[line] == none) {
                component_of_line_[line] = static_cast<PetscInt>(start);
                is_first_family[line] = !is_first_family[queue[head]];
                queue.push_back(line);
              }
            }
          }
        }
      }
    }
    is_eliminated_.assign(set_.local(), false);
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      is_eliminated_[spring] = is_first_family[line_of_[spring]];
    }
  }

  /// Exchanges the families of connected parts of a rank so that lines have the same family on all ranks, where
  /// possible: the pairs of parts with most votes come first.
  void agree_on_families() {
    struct Vote {
      PetscInt one, other;  // global numbers of two parts
      PetscInt alike;       // how many more lines have the same family in both than have not
    };
    const PetscInt first = number_owned(set_.layout.comm, static_cast<PetscInt>(lines_.size())).first;
    std::vector<PetscInt> family(set_.local());  // 2 * part + family
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      family[spring] = 2 * (first + component_of_line_[line_of_[spring]]) + (is_eliminated_[spring] ? 1 : 0);
    }
    update_ghosts(set_.layout, family);
    std::map<std::pair<PetscInt, PetscInt>, PetscInt> own_votes;
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      for (const PetscInt other : following_[spring]) {
        if (other >= set_.owned() && family[spring] < family[other]) {
          own_votes[{family[spring] / 2, family[other] / 2}] += family[spring] % 2 == family[other] % 2 ? 1 : -1;
        }
      }
    }
    std::vector<Vote> votes;
    for (const auto& [parts, alike] : own_votes) {
      votes.push_back({parts.first, parts.second, alike});
    }
    votes = of_all_ranks(set_.layout.comm, votes);
    std::stable_sort(votes.begin(), votes.end(),
                     [](const Vote& a, const Vote& b) { return std::abs(a.alike) > std::abs(b.alike); });
    // Parts that have agreed form a tree, whose edges say whether families are exchanged.
    std::map<PetscInt, std::pair<PetscInt, bool>> parent;
    const auto root_of = [&parent](PetscInt part) {
      bool is_exchanged = false;
      for (auto found = parent.find(part); found != parent.end(); found = parent.find(part)) {
        part = found->second.first;
        is_exchanged ^= found->second.second;
      }
      return std::pair{part, is_exchanged};
    };
    for (const Vote& vote : votes) {
      const auto [one, one_exchanged] = root_of(vote.one);
      const auto [other, other_exchanged] = root_of(vote.other);
      if (one != other) {
        parent[std::max(one, other)] = {std::min(one, other), (vote.alike < 0) != (one_exchanged != other_exchanged)};
      }
    }
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      if (root_of(family[spring] / 2).second) {
        is_eliminated_[spring] = !is_eliminated_[spring];
      }
    }
    for (const PetscInt cut : cuts_) {
      is_eliminated_[cut] = false;
    }
  }

  /// Leaves one pair of eliminated springs at a particle, and unmarks the others.
  void keep_crossing_springs(PetscInt particle) {
    PetscInt first = none;
    for (const PetscInt spring : incidence_[particle]) {
      if (spring >= set_.owned() || !is_eliminated_[spring]) {
        continue;
      }
      if (first == none) {
        first = spring;
      } else if (following_[first][end_at(first, particle)] != spring) {
        is_eliminated_[spring] = false;
      }
    }
  }

  /// If two eliminated springs of different ranks share a particle and are not in one line, only the lower rank's may
  /// stay eliminated.
  void keep_springs_that_meet_other_ranks() {
    update_ghosts(set_.layout, is_eliminated_);
    const std::vector<bool> eliminated = is_eliminated_;
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      for (std::size_t end = 0; end < 2; ++end) {
        for (const PetscInt other : incidence_[set_.ends[spring][end]]) {
          if (is_of_lower_rank(other) && eliminated[other] && following_[spring][end] != other) {
            is_eliminated_[spring] = false;
          }
        }
      }
    }
    update_ghosts(set_.layout, is_eliminated_);
  }

  /// If two springs of different ranks and of one family follow each other in a line, the higher rank's is a separator;
  /// in a closed line one of these is not. All ranks solve for all separators: where these are too many there are none,
  /// and the eliminated springs at such places are kept instead.
  void choose_separators() {
    is_separator_.assign(set_.local(), false);
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      for (const PetscInt other : following_[spring]) {
        if (is_of_lower_rank(other) && is_eliminated_[spring] == is_eliminated_[other]) {
          is_separator_[spring] = true;
        }
      }
    }
    update_ghosts(set_.layout, is_separator_);
    number_.assign(set_.local(), none);
    for (const bool eliminated : {true, false}) {
      number_separators(eliminated);
    }
    update_ghosts(set_.layout, number_);
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      if (is_separator_[spring] && number_[spring] == none) {
        is_separator_[spring] = is_eliminated_[spring] = false;
      }
    }
    update_ghosts(set_.layout, is_separator_);
    update_ghosts(set_.layout, is_eliminated_);
  }

  void number_separators(bool eliminated) {
    std::vector<PetscInt> own;                       // global numbers
    std::vector<std::array<PetscInt, 2>> own_links;  // of separators next to each other along a line, by global numbers
    for (PetscInt spring = 0; spring < set_.owned(); ++spring) {
      if (is_eliminated_[spring] != eliminated) {
        continue;
      }
      const bool is_separator = is_separator_[spring];
      if (is_separator) {
        own.push_back(set_.layout.to_global(spring));
      }
      for (std::size_t end = 0; end < 2; ++end) {
        const PetscInt beside = separator_beside(spring, end);
        if (beside != none) {
          const PetscInt here = set_.layout.to_global(is_separator ? spring : beside);
          const PetscInt there = is_separator ? set_.layout.to_global(beside) : separator_beyond(spring, 1 - end);
          if (there > here) {
            own_links.push_back({here, there});
          }
        }
      }
    }
    const auto all = of_all_ranks(set_.layout.comm, own);
    const auto links = of_all_ranks(set_.layout.comm, own_links);
    constexpr PetscInt worth = 10;  // springs of a rank for a separator
    if (worth * static_cast<PetscInt>(all.size()) * ranks_of(set_.layout.comm) > set_.layout.global) {
      return;
    }
    std::map<PetscInt, std::vector<PetscInt>> neighbours;
    for (const PetscInt separator : all) {
      neighbours[separator];
    }
    for (const auto& [one, other] : links) {
      neighbours[one].push_back(other);
      neighbours[other].push_back(one);
    }
    std::map<PetscInt, PetscInt> numbers;
    PetscInt& count = separators_of_all_[eliminated ? 0 : 1];
    const auto number_along = [&](PetscInt separator) {
      while (separator != none) {
        numbers[separator] = count++;
        PetscInt next = none;
        for (const PetscInt other : neighbours[separator]) {
          if (numbers.count(other) == 0) {
            next = other;
          }
        }
        separator = next;
      }
    };
    for (const auto& [separator, beside] : neighbours) {
      if (beside.size() < 2 && numbers.count(separator) == 0) {
        number_along(separator);
      }
    }
    for (const auto& [separator, beside] : neighbours) {  // What is left is closed, and opened here.
      if (numbers.count(separator) == 0) {
        numbers[separator] = none;
        number_along(beside[0]);
      }
    }
    for (const PetscInt separator : own) {
      number_[separator - set_.layout.first] = numbers[separator];
    }
  }

  bool is_of_lower_rank(PetscInt spring) const {
    return spring >= set_.owned() && set_.layout.to_global(spring) < set_.layout.first;
  }
  PetscInt following_of_family(PetscInt spring, std::size_t end) const {
    const PetscInt next = following_[spring][end];
    return next != none && is_eliminated_[next] == is_eliminated_[spring] ? next : none;
  }
  /// Separator in which the line of an owned spring continues at an end, or none.
  PetscInt separator_beside(PetscInt spring, std::size_t end) const {
    const PetscInt next = following_of_family(spring, end);
    return next != none && is_separator_[next] ? next : none;
  }
  /// Global number of the first spring along the line of an owned one that may be a separator, or none.
  PetscInt separator_beyond(PetscInt spring, std::size_t end) const {
    for (const PetscInt start = spring;;) {
      const PetscInt next = following_of_family(spring, end);
      if (next == none || next == start) {
        return none;
      }
      if (is_separator_[next]) {
        return set_.layout.to_global(next);
      }
      end = 1 - end_at(next, set_.ends[spring][end]);
      spring = next;
    }
  }

  const SpringSet& set_;
  Incidence incidence_;
  std::vector<std::array<std::array<PetscInt, 3>, 2>> corners_;  ///< global numbers at either end of each local spring
  std::vector<std::array<PetscInt, 2>> following_;  ///< spring in which an owned spring's line continues at either end
  std::vector<std::vector<PetscInt>> lines_;
  std::vector<PetscInt> line_of_;
  std::vector<PetscInt> component_of_line_;  ///< first line of the connected part, on this rank, of each line
  std::vector<PetscInt> cuts_;               ///< springs at which closed lines are cut
  std::vector<bool> is_eliminated_;          ///< with ghosts, once ranks have agreed
  std::vector<bool> is_separator_;           ///< of the local springs
  std::vector<PetscInt> number_;  ///< of the local springs that are separators, over all ranks and along the lines
  std::array<PetscInt, 2> separators_of_all_{};  ///< their number, of the eliminated and of the kept family
};

}  // namespace

SpringLines find_lines(const SpringSet& set, const Layout& particles) { return LineFinder(set, particles).result(); }

}  // namespace pellicle::projection
