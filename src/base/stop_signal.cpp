#include "base/stop_signal.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <utility>

#include "base/sorting.h"

namespace pellicle::base {

namespace {

constexpr std::array<std::pair<int, const char*>, 6> names{{{SIGTERM, "SIGTERM"},
                                                            {SIGINT, "SIGINT"},
                                                            {SIGHUP, "SIGHUP"},
                                                            {SIGUSR1, "SIGUSR1"},
                                                            {SIGUSR2, "SIGUSR2"},
                                                            {SIGXCPU, "SIGXCPU"}}};

// Variables that the handler reads.
volatile std::sig_atomic_t is_deferred = 0;
volatile std::sig_atomic_t waiting = 0;
volatile std::sig_atomic_t is_continued = 0;  ///< by SIGCONT
volatile std::sig_atomic_t is_first_rank = 1;

// The state of until_stopped, the same on all ranks that do its work.
MPI_Comm comm_of_work = MPI_COMM_NULL;  ///< null: no work is in progress
bool may_leave_at_sigcont = false;
int agreed = 0;  ///< the signal at which the work is left

/// Time between two exchanges at a StopPoint [s], and the most passes between them.
constexpr double time_between = 0.1;
constexpr int most_passes = 64;

void print(const char* text) {
  if (write(STDERR_FILENO, text, std::strlen(text)) < 0) {
    // There is no reader.
  }
}

/// The name of one of these signals; another one has none.
const char* name_of(int signal) {
  const auto* known = first_that(names, [signal](const auto& row) { return row.first == signal; });
  return known != nullptr ? known->second : "";
}

/// Calls only what a signal handler may call.
[[noreturn]] void end_at_once(int signal) {
  if (is_first_rank == 0) {
    // If the first rank got the signal too, its end makes mpirun end this process by a SIGTERM, which must print
    // nothing.
    struct sigaction quietly {};
    quietly.sa_handler = SIG_DFL;
    sigaction(SIGTERM, &quietly, nullptr);
    sigset_t all;
    sigemptyset(&all);
    sigprocmask(SIG_SETMASK, &all, nullptr);
    sleep(3);
  }
  print("pellicle: ended by ");
  print(name_of(signal));
  print(is_deferred != 0 ? ", the second signal, within a step; what was kept before is whole\n"
                         : " before the first step\n");
  _exit(128 + signal);
}

/// Whether SIGHUP is ignored at the start of the process; libraries change that later.
const bool hangup_is_ignored = [] {
  struct sigaction before {};
  return sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler == SIG_IGN;
}();

extern "C" void handle_stop_signal(int signal) {
  if (is_deferred != 0 && waiting == 0) {
    waiting = signal;
  } else if (signal != SIGXCPU || waiting != SIGXCPU) {
    end_at_once(signal);
  }
}

extern "C" void handle_sigcont(int) { is_continued = 1; }

/// The signal that follows from what has been noted on any rank.
int signal_of(bool any_is_continued, int any_waiting) {
  if (any_waiting == 0 && any_is_continued) {
    is_continued = 0;
    return SIGCONT;
  }
  return any_waiting;
}

}  // namespace

void catch_stop_signals(int rank) {
  is_first_rank = rank == 0 ? 1 : 0;
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  struct sigaction action {};
  action.sa_handler = handle_stop_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const auto& [number, name] : names) {
    sigaddset(&action.sa_mask, number);
  }
  for (const auto& [number, name] : names) {
    if (number == SIGHUP && hangup_is_ignored) {
      std::signal(SIGHUP, SIG_IGN);
    } else {
      sigaction(number, &action, nullptr);
    }
  }
}

void release_stop_signals() {
  for (const auto& [number, name] : names) {
    if (!(number == SIGHUP && hangup_is_ignored)) {
      std::signal(number, SIG_DFL);
    }
  }
  std::signal(SIGCONT, SIG_DFL);
}

void defer_stop_signals() {
  waiting = 0;
  is_continued = 0;
  is_deferred = 1;
  struct sigaction action {};
  action.sa_handler = handle_sigcont;
  action.sa_flags = SA_RESTART;
  sigaction(SIGCONT, &action, nullptr);
}

int stop_signal(MPI_Comm comm) {
  std::array<int, 2> any{is_continued, waiting};
  MPI_Allreduce(MPI_IN_PLACE, any.data(), 2, MPI_INT, MPI_MAX, comm);
  return signal_of(any[0] != 0, any[1]);
}

int until_stopped(MPI_Comm comm, const std::function<void()>& work, bool heeds_sigcont) {
  comm_of_work = comm;
  may_leave_at_sigcont = heeds_sigcont;
  agreed = 0;
  try {
    work();
  } catch (const Stopped&) {
  } catch (...) {
    comm_of_work = MPI_COMM_NULL;
    throw;
  }
  comm_of_work = MPI_COMM_NULL;
  return std::exchange(agreed, 0);
}

bool StopPoint::pass() {
  if (comm_of_work == MPI_COMM_NULL || agreed != 0) {
    return agreed != 0;
  }
  if (--left_ > 0) {
    return false;
  }
  const double now = MPI_Wtime();
  std::array<double, 3> largest{may_leave_at_sigcont && is_continued != 0 ? 1.0 : 0.0, static_cast<double>(waiting),
                                now - last_};
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), 3, MPI_DOUBLE, MPI_MAX, comm_of_work);
  last_ = now;
  agreed = signal_of(largest[0] != 0, static_cast<int>(largest[1]));
  const double wanted = passes_ * time_between / std::max(largest[2], 1e-9);
  passes_ = static_cast<int>(std::clamp(wanted, 1.0, std::min(2.0 * passes_, double(most_passes))));
  left_ = passes_;
  return agreed != 0;
}

void leave_if_stopped() {
  if (agreed != 0) {
    throw Stopped();
  }
}

std::string signal_name(int signal) {
  const std::string name = name_of(signal);
  return name.empty() ? "signal " + std::to_string(signal) : name;
}

}  // namespace pellicle::base
