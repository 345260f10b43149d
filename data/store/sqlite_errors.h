#pragma once
// Internal to data/: SQLite's error codes as sentences that say what to do.

#include <SQLiteCpp/Exception.h>

#include <string>
#include <utility>

namespace palpate::data {

/// Throws the StoreRefused or StoreError that `error` amounts to.
[[noreturn]] void raise_store_error(const std::string& path, const SQLite::Exception& error);

/// Calls `work`; SQLite's exceptions come out as ours.
template <class Work>
decltype(auto) guarded(const std::string& path, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const SQLite::Exception& error) {
    raise_store_error(path, error);
  }
}

}  // namespace palpate::data
