#pragma once
// How much memory a piece of work needs at its peak.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>
#include <optional>
#include <string>

namespace palpate {

/// Bytes that `work` adds at its peak to what the process has; in a child process, as the kernel
/// counts. None where the child died of it.
template <class Work>
std::optional<std::size_t> peak_memory(const Work& work) {
  const auto high_water = [] {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmHWM:")) return std::stoul(line.substr(6)) * 1024;
    }
    return 0UL;
  };
  int ends[2];
  if (::pipe(ends) != 0) return std::nullopt;
  const pid_t child = fork();
  if (child == 0) {
    std::ofstream("/proc/self/clear_refs") << 5;  // the high-water mark starts from here
    const std::size_t before = high_water();
    work();
    const std::size_t added = high_water() - before;
    const bool told = ::write(ends[1], &added, sizeof added) == sizeof added;
    _exit(told ? 0 : 1);
  }
  close(ends[1]);
  std::size_t added = 0;
  const bool heard = child > 0 && ::read(ends[0], &added, sizeof added) == sizeof added;
  close(ends[0]);
  int status = 0;
  if (child > 0) waitpid(child, &status, 0);
  if (!heard || status != 0) return std::nullopt;
  return added;
}

}  // namespace palpate
