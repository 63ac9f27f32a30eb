#include "base/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "base/error.h"

namespace pellicle::base {

namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();

/// The number in a file of the kernel; no number, or a word such as "max", means no limit.
double number_in(const std::string& path) {
  double value = 0;
  return std::ifstream(path) >> value ? value : no_limit;
}

/// MemAvailable of the machine: free memory and caches that can be dropped.
double machine_memory() {
  std::ifstream file("/proc/meminfo");
  std::string word;
  while (file >> word) {
    double kibibytes = 0;
    if (word == "MemAvailable:" && file >> kibibytes) {
      return 1024 * kibibytes;
    }
  }
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// Bytes that a control group may still take: its limit less its use. Each number is in a file of the kernel; without
/// one of them there is no limit.
double left_of(const std::string& limit, const std::string& used) {
  const double all = number_in(limit);
  const double in_use = number_in(used);
  return all < no_limit && in_use < no_limit ? all - in_use : no_limit;
}

/// Bytes that the process's own control group may still take; containers and batch systems set such limits.
double control_group_memory() {
  std::ifstream file("/proc/self/cgroup");
  double left = no_limit;
  for (std::string line; std::getline(file, line);) {
    const std::size_t second = line.find(':', line.find(':') + 1);
    if (second == std::string::npos) {
      continue;
    }
    const std::string controllers = line.substr(0, second);
    // In a container the group's path is not visible, and its files lie at the root.
    for (const std::string& path : {line.substr(second + 1), std::string("/")}) {
      if (controllers == "0:") {
        const std::string folder = "/sys/fs/cgroup" + path;
        left = std::min(left, left_of(folder + "/memory.max", folder + "/memory.current"));
      } else if (controllers.find(":memory") != std::string::npos) {
        const std::string folder = "/sys/fs/cgroup/memory" + path;
        left = std::min(left, left_of(folder + "/memory.limit_in_bytes", folder + "/memory.usage_in_bytes"));
      }
    }
  }
  return left;
}

/// Bytes of the address space that remain under `ulimit -v`.
double address_space() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return no_limit;
  }
  const double pages = number_in("/proc/self/statm");
  return static_cast<double>(limit.rlim_cur) - pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

double available_memory() {
  return std::max(0.0, std::min({machine_memory(), control_group_memory(), address_space()}));
}

void require_memory(const std::string& what, double bytes) {
  constexpr double gigabyte = 1e9;
  const double available = available_memory();
  if (!(bytes <= available)) {
    throw Error(
        fmt::format("{} needs about {:.2g} GB of memory, expected no more than the {:.2g} GB that are available", what,
                    bytes / gigabyte, available / gigabyte));
  }
}

}  // namespace pellicle::base
