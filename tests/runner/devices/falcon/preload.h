#pragma once
// umockdev's library must be loaded before libc: a program that mocks a bus restarts itself with it
// preloaded.

namespace palpate::runner::devices::falcon::testing {

/// Starts the program again with umockdev's library (and a sanitizer's before it) preloaded, unless
/// it is. Returns whether it is.
bool rerun_preloaded(char** argv);

}  // namespace palpate::runner::devices::falcon::testing
