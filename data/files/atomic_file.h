#pragma once
// Files that appear under their name complete, or not at all: written to a temporary file in the
// same folder, synced, and renamed (rename(2) is atomic). Everything that palpate writes for its
// users goes this way, except databases (schema.h) and folders (atomic_folder.h).

#include <deque>
#include <string>
#include <string_view>

namespace palpate::data {

/// How names of temporary files and folders begin: ".NAME.palpate-" in the folder of the target;
/// six random characters follow.
std::string temporary_prefix(const std::string& target);

/// Removes the temporary files and folders for `target` that belong to this user and that no
/// process has locked: their process was killed.
void remove_stale_temporaries(const std::string& target);
/// The same for all targets in a folder.
void remove_stale_temporaries_in(const std::string& folder);

/// Six random characters, as mkstemp puts at the end of a name.
std::string random_letters();

/// The temporary file has mode 0600 and is locked (flock) while its process lives. Works on a
/// descriptor of the folder, so that the folder may be renamed meanwhile.
class AtomicFile {
 public:
  /// \throws StoreRefused, StoreError: a temporary file cannot be created there.
  explicit AtomicFile(const std::string& target);
  ~AtomicFile();  ///< removes the temporary file, or after a commit the replaced file
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  int descriptor() const { return descriptor_; }  ///< open for writing; owned by this object
  void write(std::string_view text);
  void sync();  ///< fsync

  /// Renames the temporary file to the target. \param replace an existing file; without it an
  /// existing file is an error.
  void commit(bool replace);
  /// Undoes commit(): the previous file has its name again.
  void roll_back();

 private:
  enum class State {
    temporary,
    renamed,    ///< there was no file
    exchanged,  ///< the previous file has the temporary name: roll_back() can restore it
    replaced,   ///< the previous file is lost: the file system cannot exchange names
  };
  void open_folder(const std::string& path);
  void create();
  [[noreturn]] void fail(const char* what, int error) const;
  std::string target_;            ///< as given, for messages
  std::string name_, temporary_;  ///< in the folder
  int folder_ = -1, descriptor_ = -1;
  State state_ = State::temporary;
};

/// Renames a file unless `path` exists, and syncs the folder. \return false: `path` exists.
/// \throws StoreError
bool rename_if_absent(const std::string& temporary, const std::string& path);

/// Commits all, or rolls back all. Call sync() of each before.
void commit_all(std::deque<AtomicFile>& files, bool replace);

}  // namespace palpate::data
