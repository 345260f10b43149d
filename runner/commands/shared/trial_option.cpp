#include "runner/commands/shared/trial_option.h"

#include <charconv>
#include <sstream>

#include "runner/commands/shared/command.h"

namespace palpate::runner {

data::TrialName parse_trial_name(const std::string& text) {
  const auto bad = [] {
    return UsageError("--trial: expected CODE/SESSION/TRIAL, e.g. P03/1/12, the numbers from 1");
  };
  data::TrialName name;
  std::istringstream parts(text);
  std::string session, trial;
  if (!std::getline(parts, name.code, '/') || !std::getline(parts, session, '/') ||
      !std::getline(parts, trial) || name.code.empty()) {
    throw bad();
  }
  const auto number = [&](const std::string& digits) {
    int value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size() || value < 1) throw bad();
    return value;
  };
  name.session = number(session);
  name.trial = number(trial);
  return name;
}

}  // namespace palpate::runner
