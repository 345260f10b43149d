#pragma once
// A file that appears whole, under its name, or not at all. Everything that palpate writes for its
// users but databases and whole folders goes this way.

#include <deque>
#include <string>
#include <string_view>

namespace palpate::data {

/// ".NAME.palpate-" beside the target: how the names of all drafts for it begin; six letters
/// follow.
std::string draft_stem(const std::string& target);

/// Removes drafts for `target`, files and folders, that are ours and that nobody holds a lock on:
/// their program is dead.
void remove_dead_drafts(const std::string& target);
/// The same for all targets in a folder.
void remove_dead_drafts_in(const std::string& folder);

struct FollowedPath {
  std::string path;   ///< absolute, without links
  std::string fault;  ///< why it was not followed, in words that follow the path; "" where it was
};

/// Where `path` leads when links are followed: those of this user and of the system alone. What
/// another user laid in a shared folder could carry a text anywhere. The last name need not exist.
FollowedPath follow_own_links(const std::string& path);

/// A draft is private (0600), beside its target, and locked while its program lives. The folder is
/// looked up once: who moves it meanwhile moves nothing of this.
class DraftFile {
 public:
  /// \throws StoreRefused, StoreError: it cannot be made there.
  explicit DraftFile(const std::string& target);
  ~DraftFile();  ///< removes the draft unless it has got its name; then what it replaced
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;

  int descriptor() const { return descriptor_; }  ///< open for writing; stays the draft's
  void write(std::string_view text);
  void sync();  ///< on the disk when it returns

  /// \param replace a file that is there may go; without it, one that came meanwhile is left alone.
  void give_name(bool replace);
  /// All is as before give_name.
  void take_back();

 private:
  enum class State { draft, named, exchanged, replaced };
  void open_folder(const std::string& path);
  void make();
  [[noreturn]] void fail(const char* what, int error) const;
  std::string target_;        ///< as given, for messages
  std::string name_, draft_;  ///< in the folder
  int folder_ = -1, descriptor_ = -1;
  State state_ = State::draft;
};

/// Gives a file its name where nothing has it, on the disk when it returns. False: something has.
/// \throws StoreError
bool name_new_file(const std::string& draft, const std::string& path);

/// All of them or none. They have been synced.
void give_names(std::deque<DraftFile>& drafts, bool replace);

}  // namespace palpate::data
