#pragma once
// Folders of files that appear under their name complete, or not at all: filled under a temporary
// name beside the target and renamed. Exports that are folders, new databases and backups use them.

#include <functional>
#include <string>

namespace palpate::data {

/// The temporary folder is ".NAME.palpate-XXXXXX", private (0700) and locked while its process
/// lives. One that a killed process left is removed by the next AtomicFolder for the same target.
class AtomicFolder {
 public:
  /// \throws StoreError: the temporary folder cannot be created.
  explicit AtomicFolder(const std::string& target);
  ~AtomicFolder();  ///< removes the temporary folder
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  std::string operator/(const std::string& name) const { return temporary_ + "/" + name; }
  /// The path of a file in the temporary folder; creates the folders on the way.
  std::string prepare(const std::string& name) const;

  /// Syncs the file system, renames the folder to the target, and deletes the previous target. That
  /// must not exist, or be an empty folder, unless `replace`.
  void commit(bool replace);

 private:
  [[noreturn]] void fail(const char* what, int error) const;
  std::string target_, temporary_;
  int descriptor_ = -1;  // locked while it is being written
};

/// Whether an export may be written to `target`. \param ours whether an export of the same format
/// has such a file, by its path within the folder; other files would be lost. \throws StoreRefused:
/// something exists and `force` is not given; with it: what exists is not a folder that palpate
/// exported, or contains other files.
void require_replaceable(const std::string& target, bool force,
                         const std::function<bool(const std::string&)>& ours);

}  // namespace palpate::data
