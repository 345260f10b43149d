#pragma once

namespace palpate::runner {

/// The settings file, embedded by the build.
extern const char* const kSimulatedDefaults;

}  // namespace palpate::runner
