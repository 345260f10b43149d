#pragma once
// The files that a command writes: checked before its work begins, then written together or not at
// all.

#include <boost/program_options.hpp>
#include <initializer_list>
#include <string>
#include <vector>

#include "data/files/output_check.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

/// Writes one file atomically, private (0600), replacing an existing one. For files that a command
/// updates (calibrations). \throws StoreError.
void write_whole(const std::string& path, const std::string& text);

class Outputs {
 public:
  /// Checks the files of the options that were given. An existing file is replaced only with
  /// --force; never what the options `inputs` name, a database, a device or a folder. \param folder
  /// an option that names a folder of files, or nullptr \throws UsageError with every fault;
  /// std::runtime_error if a folder is not writable.
  Outputs(const boost::program_options::variables_map& values,
          std::initializer_list<const char*> options, std::initializer_list<const char*> inputs,
          const char* folder = nullptr);

  /// Protects all files that the meshes of an object were read from, which no option names.
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
  void protect_files(const stimuli::ObjectSpec& object);
  const boost::program_options::variables_map& values_;
  bool force_ = false;
  data::ProtectedFiles inputs_;
  std::vector<Output> outputs_;
  std::string folder_option_, folder_;
};

}  // namespace palpate::runner
