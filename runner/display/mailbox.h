#pragma once
// Queues between the session's thread and the display's. Locks are held only while pointers are
// swapped, so a stalled display blocks no other thread.

#include <cstddef>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace palpate::runner::display {

/// Holds the newest value only.
template <class T>
class Mailbox {
 public:
  void put(T value) {
    std::optional<T> old(std::move(value));  // the old value is freed outside of the lock
    const std::lock_guard lock(mutex_);
    newest_.swap(old);
  }
  std::optional<T> take() {
    std::optional<T> out;
    const std::lock_guard lock(mutex_);
    out.swap(newest_);
    return out;
  }

 private:
  std::mutex mutex_;
  std::optional<T> newest_;
};

/// Keeps every value, in order, up to a bound: a key held down must not fill the memory.
template <class T>
class EventQueue {
 public:
  void add(T value) {
    const std::lock_guard lock(mutex_);
    if (values_.size() < kMost) values_.push_back(std::move(value));
  }
  std::vector<T> take() {
    std::vector<T> out;
    const std::lock_guard lock(mutex_);
    out.swap(values_);
    return out;
  }

 private:
  static constexpr std::size_t kMost = 10000;
  std::mutex mutex_;
  std::vector<T> values_;
};

}  // namespace palpate::runner::display
