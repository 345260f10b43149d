#include "runner/commands/shared/command.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <optional>
#include <sstream>
#include <typeinfo>

#include "data/base/text.h"
#include "data/files/file_permissions.h"

namespace palpate::runner::commands {

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

namespace po = boost::program_options;

namespace {

/// Refuses what Boost accepts: "-1" for an unsigned number (2^64 - 1), "nan" and "inf".
void check_number(const std::string& option, const std::string& text, const boost::any& value) {
  const auto refuse = [&](const char* expected) {
    throw UsageError("--" + option + ": expected " + expected + ", found '" + printable(text, 60) +
                     "'");
  };
  const auto is = [&](const auto& example) { return value.type() == typeid(example); };
  const bool no_sign = is(0U) || is(0UL) || is(0ULL);
  if (no_sign && text.find('-') != std::string::npos) refuse("a whole number from 0");
  if (is(0.0) && !std::isfinite(boost::any_cast<double>(value))) refuse("a finite number");
}

/// "; did you mean '--jobs'?", or "".
std::string option_meant(const std::string& given, const po::options_description& options) {
  constexpr std::size_t kLongestOption = 40;  // longest option to correct
  const std::size_t begin = std::min(given.find_first_not_of('-'), given.size());
  const std::string word = given.substr(begin, given.find('=') - begin);
  if (word.size() > kLongestOption) return "";
  std::vector<std::string> names;
  for (const auto& option : options.options()) names.push_back(option->long_name());
  const std::string meant = nearest_word(word, names);
  return meant.empty() ? "" : "; did you mean '--" + meant + "'?";
}

void check_numbers(const po::parsed_options& parsed, const po::variables_map& values) {
  for (const auto& option : parsed.options) {
    if (option.unregistered || option.value.empty()) continue;
    const auto stored = values.find(option.string_key);
    if (stored != values.end())
      check_number(option.string_key, option.value.front(), stored->second.value());
  }
}

}  // namespace

std::optional<po::variables_map> CommandLine::parse(const std::vector<std::string>& args) {
  options.add_options()("help,h", "show this help");
  po::options_description all;
  all.add(options);
  po::options_description hidden;
  for (const auto& name : positional_names) {
    hidden.add_options()(name.c_str(), po::value<std::string>());
    positional.add(name.c_str(), 1);
  }
  all.add(hidden);
  po::variables_map values;
  try {
    const po::parsed_options parsed =
        po::command_line_parser(args).options(all).positional(positional).run();
    po::store(parsed, values);
    if (values.count("help")) {
      std::cout << "Usage: " << usage << "\n\n"
                << summary << "\n\n"
                << options << "\nExamples:\n"
                << example << "\n";
      return std::nullopt;
    }
    check_numbers(parsed, values);
    po::notify(values);
  } catch (const po::unknown_option& error) {
    throw UsageError(error.what() + option_meant(error.get_option_name(), options) +
                     "\nUsage: " + usage + "\nMore: add --help");
  } catch (const po::error& error) {
    throw UsageError(std::string(error.what()) + "\nUsage: " + usage + "\nMore: add --help");
  }
  for (const auto& name : positional_names) {
    if (!values.count(name)) {
      throw UsageError("missing " + name + "\nUsage: " + usage + "\nMore: add --help");
    }
  }
  return values;
}

std::string text_of(const po::variables_map& values, const char* option) {
  return values.count(option) > 0 ? values[option].as<std::string>() : std::string();
}

void warn_of_exposure(const std::string& database) {
  const std::string exposure = data::access_warning(database);
  if (!exposure.empty()) std::cerr << "warning: " << printable(exposure) << "\n";
}

}  // namespace palpate::runner::commands
