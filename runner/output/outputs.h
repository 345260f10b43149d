#pragma once
// The files that a command writes: checked before it works, then written all together or not at
// all.

#include <array>
#include <boost/program_options.hpp>
#include <concepts>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "data/files/output_check.h"
#include "stimuli/shapes.h"

namespace palpate::runner::output {

/// CSV with 17 significant digits, so that numbers are read back exactly everywhere. Fields are
/// appended to a row from left to right and are never quoted: texts are names of
/// letters, digits, '-' and '+'.
class CsvText {
 public:
  /// \param names  names of the columns. \param line_end  "\n" or "\r\n"
  CsvText(const auto& names, std::string line_end) : line_end_(std::move(line_end)) {
    for (const auto& name : names) *this << std::string_view(name);
    end_row();
  }
  CsvText& operator<<(double value) {
    std::array<char, 40> digits{};
    const int length = std::snprintf(digits.data(), digits.size(), "%.17g", value);
    return *this << std::string_view(digits.data(), static_cast<std::size_t>(length));
  }
  CsvText& operator<<(std::string_view text) {
    if (!first_) text_ += ',';
    text_ += text;
    first_ = false;
    return *this;
  }
  CsvText& operator<<(const char* text) { return *this << std::string_view(text); }
  CsvText& operator<<(bool value) { return *this << std::string_view(value ? "1" : "0"); }
  CsvText& operator<<(std::integral auto value) {
    return *this << std::string_view(std::to_string(value));
  }
  void end_row() {
    text_ += line_end_;
    first_ = true;
  }
  const std::string& text() const { return text_; }

 private:
  std::string line_end_, text_;
  bool first_ = true;  ///< the next field is the first of its row
};

/// Writes one file atomically, private (0600), replacing an existing one. For files that a command
/// updates (calibrations). \throws StoreError.
void write_whole(const std::string& path, const std::string& text);

class Outputs {
 public:
  /// Checks the files of the given options. "-" is standard output: until destruction, everything
  /// else that goes there goes to standard error. An existing file is replaced only with --force.
  /// The files of the options `inputs`, databases, devices and folders are never replaced. \param
  /// folder an option that names a folder of files, or nullptr \throws UsageError with every fault;
  /// std::runtime_error if a folder is not writable.
  Outputs(const boost::program_options::variables_map& values,
          std::initializer_list<const char*> options, std::initializer_list<const char*> inputs,
          const char* folder = nullptr);
  ~Outputs();
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  /// Protects all files from which the meshes of an object were read; no option names them.
  /// \throws UsageError.
  void protect(const stimuli::ObjectSpec& object);

  bool wanted(const char* option) const { return values_.count(option) > 0; }
  /// Sets the text of an option's file; no effect if the option was not given.
  void put(const std::string& option, std::string text);
  /// Adds a file in the folder, if one was given.
  void put_into_folder(const std::string& name, std::string text);

  /// Writes all files. If it throws, none has changed.
  void write();

 private:
  struct Output {
    std::string option, path, text;
  };
  void check() const;
  void take_standard_output();
  void protect_files(const stimuli::ObjectSpec& object);
  const boost::program_options::variables_map& values_;
  bool force_ = false;
  data::ProtectedFiles inputs_;
  std::vector<Output> outputs_;
  std::string folder_option_, folder_;
  int standard_output_ = -1;  ///< where "-" goes, if an option has it
};

}  // namespace palpate::runner::output
