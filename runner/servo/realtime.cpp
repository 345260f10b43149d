#include "runner/servo/realtime.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

namespace palpate::runner::servo {
namespace {

constexpr std::int64_t kOneSecond_ns = 1'000'000'000;

void add(std::string& list, const std::string& sentence) {
  list += (list.empty() ? "" : " ") + sentence;
}

bool may_lock_any_memory() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> sets{};
  return syscall(SYS_capget, &header, sets.data()) == 0 &&
         (sets[CAP_TO_INDEX(CAP_IPC_LOCK)].effective & CAP_TO_MASK(CAP_IPC_LOCK)) != 0;
}

/// Locks all present memory. If no limit can make that fail, also locks future memory when touched.
bool lock_memory() {
  if (mlockall(MCL_CURRENT) != 0) return false;
  rlimit limit{};
  const bool unlimited = getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY;
  if (unlimited || may_lock_any_memory()) mlockall(MCL_FUTURE | MCL_ONFAULT);
  return true;
}

}  // namespace

std::int64_t RealClock::now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kOneSecond_ns + now.tv_nsec;
}

void RealClock::wait_until(std::int64_t when_ns) noexcept {
  const timespec when{when_ns / kOneSecond_ns, when_ns % kOneSecond_ns};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

AwakeProcessors::AwakeProcessors(bool wanted) noexcept {
  if (!wanted) return;
  file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t longest_us = 0;
  if (file_ >= 0 && write(file_, &longest_us, sizeof longest_us) != sizeof longest_us) {
    close(file_);
    file_ = -1;
  }
}

AwakeProcessors::~AwakeProcessors() {
  if (file_ >= 0) close(file_);
}

RealtimeRights request_realtime(const RealtimeSettings& settings) {
  RealtimeRights rights;
  // The kernel may prolong an ordinary thread's sleep by 50 us to save wake-ups. Turning that off
  // needs no right.
  prctl(PR_SET_TIMERSLACK, 1UL);
  if (settings.priority > 0) {
    sched_param param{};
    param.sched_priority = settings.priority;
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
    rights.fifo = error == 0;
    if (error != 0) {
      add(rights.missing,
          std::string("No real-time priority (") + std::strerror(error) +
              "): other programs can make ticks late; grant CAP_SYS_NICE or a limit 'rtprio' of " +
              std::to_string(settings.priority) +
              " (members of the package's group 'palpate' have it).");
    }
  }
  if (settings.lock_memory) {
    rights.locked_memory = lock_memory();
    if (!rights.locked_memory) {
      add(rights.missing,
          std::string("Memory is not locked (") + std::strerror(errno) +
              "): a page fetched from disk can make a tick late; grant CAP_IPC_LOCK or raise the "
              "limit 'memlock' (members of the package's group 'palpate' have it).");
    }
  }
  if (settings.core >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    if (settings.core < CPU_SETSIZE) CPU_SET(settings.core, &set);
    const int error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    if (error == 0) {
      rights.core = settings.core;
    } else {
      add(rights.missing, "Processor " + std::to_string(settings.core) + " was not given (" +
                              std::strerror(error) + "): the thread may move between processors.");
    }
  }
  return rights;
}

}  // namespace palpate::runner::servo
