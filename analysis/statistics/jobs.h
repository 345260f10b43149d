#pragma once
// Work of equal parts, several at a time.

#include <cstddef>
#include <functional>

namespace palpate::analysis {

/// Calls one(i) for each i below `n`, `jobs` at a time and in no order. \param progress  called in
/// this thread with the share that is done; may be empty. An exception of one() is thrown here,
/// after the parts that run have ended; the others are left out.
void do_jobs(std::size_t n, std::size_t jobs, const std::function<void(std::size_t)>& one,
             const std::function<void(double)>& progress);

}  // namespace palpate::analysis
