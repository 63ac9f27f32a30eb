#include "io/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "parallel/collective.h"

namespace pellicle::io {

bool stdout_is_terminal() {
  if (std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr) {
    return isatty(STDOUT_FILENO) != 0;
  }
  // The parent is mpirun itself where rank 0 runs beside it; elsewhere it is a daemon without a terminal.
  std::FILE* output = std::fopen(fmt::format("/proc/{}/fd/1", getppid()).c_str(), "a");
  const bool terminal = output != nullptr && isatty(fileno(output)) != 0;
  if (output != nullptr) {
    std::fclose(output);
  }
  return terminal;
}

std::string time_text(double seconds) { return fmt::format("{:.6g} s", seconds); }

std::string duration_text(double seconds) {
  if (seconds < 9.95) {
    return fmt::format("{:.2g} s", seconds);
  }
  const long whole = std::lround(seconds);
  if (whole < 60) {
    return fmt::format("{} s", whole);
  }
  if (whole < 3600) {
    return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  }
  return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
}

Console::Console(MPI_Comm comm, int monitor, std::ostream& stream, bool terminal, double longest_silence)
    : comm_(comm),
      rank_(rank_of(comm)),
      interval_(monitor == 0 && terminal ? 1 : monitor),
      stream_(stream),
      longest_silence_(longest_silence),
      start_(MPI_Wtime()),
      last_line_(start_) {}

void Console::say(const std::string& line) {
  if (interval_ > 0) {
    tell(line);
  }
}

void Console::tell(const std::string& line) {
  if (rank_ == 0) {
    stream_ << line << std::endl;
    last_line_ = MPI_Wtime();
  }
}

void Console::tell(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    tell(line);
  }
}

void Console::progress(const Progress& progress) {
  const bool is_due = interval_ > 0 && progress.step % interval_ == 0;
  if (!is_due && MPI_Wtime() - last_line_ < longest_silence_) {
    return;
  }
  const double elapsed = MPI_Wtime() - start_;
  const std::string left =
      progress.fraction > 0 ? duration_text(elapsed * (1 - progress.fraction) / progress.fraction) : "?";
  tell(fmt::format("step {:6}  time {:<10.5g} s {:>5.1f} %  left {:<12}  iterations {:5}  {}", progress.step,
                   progress.time, 100 * progress.fraction, left, progress.iterations, progress.figures));
}

void Console::stage_table(const std::vector<std::pair<std::string, const StageClock*>>& clocks) {
  std::vector<StageTime> stages;
  std::vector<double> seconds;
  for (const auto& [object, clock] : clocks) {
    for (StageTime stage : clock->stages()) {
      stage.name = (object.empty() ? "" : object + ": ") + stage.name;
      seconds.push_back(stage.seconds);
      stages.push_back(std::move(stage));
    }
  }
  max_over_ranks(comm_, seconds);
  const double total = max_over_ranks(comm_, clocks.front().second->elapsed());

  std::size_t width = 5;
  double rest = total;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    width = std::max(width, stages[i].name.size());
    rest -= seconds[i];
  }
  const auto row = [&](const std::string& name, const std::string& calls, double spent) {
    say(fmt::format("{:<{}} {:>8} {:>10.3f} {:>6.1f} %", name, width, calls, spent,
                    total > 0 ? 100 * spent / total : 0.0));
  };
  say(fmt::format("{:<{}} {:>8} {:>10} {:>8}", "stage", width, "calls", "seconds", "share"));
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    row(stages[i].name, std::to_string(stages[i].calls), seconds[i]);
  }
  row("rest", "", std::max(0.0, rest));
  row("total", "", total);
}

}  // namespace pellicle::io
