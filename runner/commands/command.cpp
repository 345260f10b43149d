#include "runner/commands/command.h"

#include <filesystem>
#include <fstream>
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
      std::cout << "Usage: " << usage << "\n\n"
                << summary << "\n\n"
                << options << "\nExamples:\n"
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

void check_outputs(const po::variables_map& values, std::initializer_list<const char*> options) {
  for (const char* option : options) {
    if (!values.count(option)) continue;
    const auto& path = values[option].as<std::string>();
    const std::string named = std::string("--") + option;
    if (path.empty()) throw UsageError(named + ": expected a path");
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) {
      throw UsageError(named + " " + path + ": expected a file; this is a folder");
    }
    if (std::filesystem::is_regular_file(path, error) && !values.count("force")) {
      throw UsageError(path + ": is there already; --force replaces it");
    }
  }
}

void write_whole(const std::string& path, const std::string& text) {
  std::error_code error;
  const bool in_place =
      std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error);
  const std::string target =
      in_place ? path : std::filesystem::weakly_canonical(path, error).string();
  const std::string draft = in_place ? path : target + ".part";
  std::ofstream out(draft, std::ios::binary);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  error.clear();
  if (out && !in_place) std::filesystem::rename(draft, target, error);
  if (!out || error) {
    if (!in_place) std::filesystem::remove(draft, error);
    throw std::runtime_error(path +
                             ": cannot be written; check the folder, its permissions and the disk");
  }
}

}  // namespace palpate
