#pragma once
// What the numbers of the simulated participant can be: what a hand, a stylus and a device can be
// at all, and what the model is defined for. Wide: plausible values are the study's affair.

#include <string>

namespace palpate::runner {

/// Why a setting cannot have that value, as "must be ..."; empty: it can, or has no range.
/// \param pointer  JSON pointer into the complete settings, "/hand/mass_kg"
std::string range_fault(const std::string& pointer, double value);

}  // namespace palpate::runner
