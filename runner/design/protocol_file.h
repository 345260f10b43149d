#pragma once
// The file that the page of palpate design writes. It never replaces a content that the page has
// not seen.

#include <optional>
#include <stdexcept>
#include <string>

namespace palpate::runner::design {

/// A file as it is on the disk now.
struct FileState {
  std::string text, sha256;
};

/// A file was not written; the sentence says why.
class NotSaved : public std::runtime_error {
 public:
  explicit NotSaved(const std::string& why, std::optional<FileState> found = std::nullopt)
      : std::runtime_error(why), found_(std::move(found)) {}
  /// The text that another program has written there meanwhile, if that is the reason.
  const std::optional<FileState>& found() const { return found_; }

 private:
  std::optional<FileState> found_;
};

class ProtocolFile {
 public:
  /// \param path  the file need not exist. \throws UsageError, protocols::InputError: what is there
  /// is no protocol that a page could show
  explicit ProtocolFile(const std::string& path);

  const std::string& path() const { return path_; }
  std::string name() const;    ///< "ho2000.json"
  std::string folder() const;  ///< "." if the path names none
  /// nullopt: there is no such file. \throws protocols::InputError, UsageError: it is not UTF-8
  std::optional<FileState> read() const;

  /// Replaces the content, keeps the file's permissions. \param opened  checksum of the content
  /// that the page knows; "": there was no file. \return the new checksum. \throws NotSaved
  std::string save(const std::string& text, const std::string& opened) const;
  /// Writes a new file beside it, "ho2000-2.json". \return its name. \throws NotSaved
  std::string save_copy(const std::string& text) const;

 private:
  std::string path_;
};

/// The content of a file; nullopt: there is none. \throws as ProtocolFile::read
std::optional<FileState> read_state(const std::string& path);
/// As ProtocolFile::save, of any file.
std::string save_state(const std::string& path, const std::string& text, const std::string& opened);
/// Writes a new file: that of the path, or "part-2.stl" where it exists. \return its name.
/// \throws NotSaved
std::string save_beside(const std::string& path, const std::string& bytes);

/// "study.json", or the first of "study-2.json", ... that does not exist.
std::string free_name(const std::string& path);

}  // namespace palpate::runner::design
