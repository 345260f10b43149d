#pragma once
// What the columns and values of a bundle mean follows from its protocols.

#include <string>
#include <vector>

#include "runner/registration/bundle_contents.h"

namespace palpate::runner::registration {

/// Differences between the codebook and one that is made again from the protocols, and between it
/// and the descriptions of columns in the dataset, a line each. \throws UsageError, StoreError
std::vector<std::string> description_faults(const std::string& folder, const BundleFacts& facts);

}  // namespace palpate::runner::registration
