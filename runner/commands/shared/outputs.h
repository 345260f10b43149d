#pragma once
// The files that a command writes: looked at before its work begins, then written, all or none.

#include <boost/program_options.hpp>
#include <initializer_list>
#include <string>
#include <vector>

#include "data/files/output_check.h"
#include "stimuli/object_spec.h"

namespace palpate::runner {

/// Writes one file whole, private (0600), in place of one that may be there. For what a command
/// keeps up to date itself (calibrations). \throws StoreError.
void write_whole(const std::string& path, const std::string& text);

class Outputs {
 public:
  /// Looks at the files of those options that were given. A file that is there is replaced with
  /// --force alone; what the options `inputs` name, a database, a device or a folder never is.
  /// \param folder an option that names a folder of files, or none
  /// \throws UsageError with every fault; std::runtime_error: a folder cannot be written to.
  Outputs(const boost::program_options::variables_map& values,
          std::initializer_list<const char*> options, std::initializer_list<const char*> inputs,
          const char* folder = nullptr);

  /// The mesh files of an object are read as well, though no option names them. \throws UsageError.
  void keep(const stimuli::ObjectSpec& object);

  bool wanted(const char* option) const { return values_.count(option) > 0; }
  /// The text for an option's file; no effect where the option was not given.
  void put(const std::string& option, std::string text);
  /// A file in the folder, where one was given.
  void put_into_folder(const std::string& name, std::string text);

  /// All are whole under their names when this returns; when it throws, none has changed.
  void write();

 private:
  struct Output {
    std::string option, path, text;
  };
  void check() const;
  const boost::program_options::variables_map& values_;
  bool force_ = false;
  data::ProtectedFiles inputs_;
  std::vector<Output> outputs_;
  std::string folder_option_, folder_;
};

}  // namespace palpate::runner
