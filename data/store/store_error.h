#pragma once
// SQLite's result codes (https://www.sqlite.org/rescode.html) as messages that name a remedy.

#include <SQLiteCpp/Exception.h>

#include <string>
#include <utility>

namespace palpate::data {

/// \throws StoreRefused: the file is damaged or not a database; StoreError: any other `error`.
[[noreturn]] void raise_store_error(const std::string& path, const SQLite::Exception& error);

/// Calls `work` and converts SQLite's exceptions to StoreError and StoreRefused.
template <class Work>
decltype(auto) guarded(const std::string& path, Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const SQLite::Exception& error) {
    raise_store_error(path, error);
  }
}

}  // namespace palpate::data
