#include "analysis/statistics/jobs.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace palpate::analysis {

void do_jobs(std::size_t n, std::size_t jobs, const std::function<void(std::size_t)>& one,
             const std::function<void(double)>& progress) {
  std::atomic<std::size_t> next{0}, done{0};
  std::mutex mutex;
  std::exception_ptr failed;
  const auto work = [&](bool reports) {
    for (std::size_t i = next++; i < n; i = next++) {
      try {
        one(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failed) failed = std::current_exception();
        next = n;
      }
      const std::size_t so_far = ++done;
      if (reports && progress) progress(static_cast<double>(so_far) / static_cast<double>(n));
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < jobs; ++i) threads.emplace_back([&work] { work(false); });
    work(true);
  }
  if (failed) std::rethrow_exception(failed);
}

}  // namespace palpate::analysis
