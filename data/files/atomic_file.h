#pragma once
// A file that appears whole, under its name, or not at all. Everything that palpate writes for its
// users but databases and whole folders goes this way.

#include <deque>
#include <string>
#include <string_view>

namespace palpate::data {

/// A draft is private (0600), beside its target, and locked while its program lives. The folder is
/// looked up once: who moves it meanwhile moves nothing of this.
class AtomicFile {
 public:
  /// \throws StoreRefused, StoreError: it cannot be made there.
  explicit AtomicFile(const std::string& target);
  ~AtomicFile();  ///< removes the draft unless it has got its name; then what it replaced
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  int descriptor() const { return descriptor_; }  ///< open for writing; stays the draft's
  void write(std::string_view text);
  void sync();  ///< on the disk when it returns

  /// \param replace a file that is there may go; without it, one that came meanwhile is left alone.
  void commit(bool replace);
  /// All is as before commit.
  void roll_back();

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
bool rename_if_absent(const std::string& draft, const std::string& path);

/// All of them or none. They have been synced.
void commit_all(std::deque<AtomicFile>& drafts, bool replace);

}  // namespace palpate::data
