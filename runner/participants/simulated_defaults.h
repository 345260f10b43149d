#pragma once

namespace palpate::runner {

/// A frozen settings file, embedded by the build.
struct FrozenSettings {
  int version;
  const char* text;  ///< JSON
};
/// Ascending; ends with version 0.
extern const FrozenSettings kFrozenSettings[];

}  // namespace palpate::runner
