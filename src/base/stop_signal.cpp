#include "base/stop_signal.h"

#include <mpi.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <utility>

namespace pellicle {
inline namespace base {

namespace {

constexpr std::array<std::pair<int, const char*>, 5> names{
    {{SIGTERM, "SIGTERM"}, {SIGINT, "SIGINT"}, {SIGHUP, "SIGHUP"}, {SIGUSR1, "SIGUSR1"}, {SIGUSR2, "SIGUSR2"}}};

// What the handler reads.
volatile std::sig_atomic_t is_deferred = 0;
volatile std::sig_atomic_t waiting = 0;
volatile std::sig_atomic_t is_first_rank = 1;

void print(const char* text) {
  std::size_t length = 0;
  while (text[length] != '\0') {
    ++length;
  }
  if (write(STDERR_FILENO, text, length) < 0) {
    // There is nobody to read it.
  }
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
  for (const auto& [number, name] : names) {
    if (number == signal) {
      print(name);
    }
  }
  print(is_deferred != 0 ? ", the second signal, within a step; what was kept before is whole\n"
                         : " before the first step\n");
  _exit(128 + signal);
}

/// As it was when the process started: libraries change it later.
bool hangup_is_ignored() {
  static const bool is_ignored = [] {
    struct sigaction before {};
    return sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler == SIG_IGN;
  }();
  return is_ignored;
}

extern "C" void handle_stop_signal(int signal) {
  if (is_deferred != 0 && waiting == 0) {
    waiting = signal;
  } else {
    end_at_once(signal);
  }
}

}  // namespace

void catch_stop_signals(int rank) {
  is_first_rank = rank == 0 ? 1 : 0;
  struct sigaction action {};
  action.sa_handler = handle_stop_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const auto& [number, name] : names) {
    sigaddset(&action.sa_mask, number);
  }
  for (const auto& [number, name] : names) {
    if (number == SIGHUP && hangup_is_ignored()) {
      std::signal(SIGHUP, SIG_IGN);
    } else {
      sigaction(number, &action, nullptr);
    }
  }
}

void release_stop_signals() {
  for (const auto& [number, name] : names) {
    if (!(number == SIGHUP && hangup_is_ignored())) {
      std::signal(number, SIG_DFL);
    }
  }
}

void defer_stop_signals() {
  waiting = 0;
  is_deferred = 1;
}

int stop_signal() {
  int signal = waiting;
  MPI_Allreduce(MPI_IN_PLACE, &signal, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return signal;
}

std::string signal_name(int signal) {
  for (const auto& [number, name] : names) {
    if (number == signal) {
      return name;
    }
  }
  return "signal " + std::to_string(signal);
}

}  // namespace base
}  // namespace pellicle
