#include "runner/commands/command.h"

#include <iostream>
#include <optional>

namespace palpate {

namespace po = boost::program_options;

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
    po::store(po::command_line_parser(args).options(all).positional(positional).run(), values);
    if (values.count("help")) {
      std::cout << "Usage: " << usage << "\n\n" << summary << "\n\n" << options << "\nExamples:\n"
                << example << "\n";
      return std::nullopt;
    }
    po::notify(values);
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

}  // namespace palpate
