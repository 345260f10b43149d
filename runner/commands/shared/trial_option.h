#pragma once

#include <string>

#include "data/store/store.h"

namespace palpate::runner {

/// The trial that an option names, "P03/1/12". \throws UsageError
data::TrialName parse_trial_name(const std::string& text);

}  // namespace palpate::runner
