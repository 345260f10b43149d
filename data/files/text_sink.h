#pragma once
// Output streams for the text of exports, with errors that name the file, and protection against
// formula injection.

#include <deque>
#include <future>
#include <string>
#include <string_view>

namespace palpate::data {

namespace formula {
constexpr bool starts_formula(std::string_view text) {
  return !text.empty() && (text[0] == '=' || text[0] == '+' || text[0] == '-' || text[0] == '@' ||
                           text[0] == '\t' || text[0] == '\r' || text[0] == '\n');
}
constexpr bool starts_formula_behind_quotes(std::string_view text) {
  while (!text.empty() && text[0] == '\'') text.remove_prefix(1);
  return starts_formula(text);
}
}  // namespace formula

/// Whether a text cell of a CSV or TSV file gets a leading ', because a spreadsheet would evaluate
/// it as a formula (https://owasp.org/www-community/attacks/CSV_Injection): it begins with = + - @
/// tab CR or LF, or would be read back as a guarded one ('=1). Numbers are never guarded.
constexpr bool needs_guard(std::string_view text) {
  return !text.empty() && (text[0] == '\'' ? formula::starts_formula_behind_quotes(text.substr(1))
                                           : formula::starts_formula(text));
}

/// The original of a guarded text; any other text unchanged.
constexpr std::string_view unguarded(std::string_view text) {
  const bool guarded =
      !text.empty() && text[0] == '\'' && formula::starts_formula_behind_quotes(text.substr(1));
  return guarded ? text.substr(1) : text;
}

class TextSink {
 public:
  virtual ~TextSink() = default;
  virtual void write(std::string_view text) = 0;
};

/// A buffered file, mode 0600. \throws StoreError, naming the file.
class FileSink : public TextSink {
 public:
  explicit FileSink(const std::string& path);  ///< must not exist
  /// Takes ownership of an open file. \param path for messages
  FileSink(int descriptor, std::string path);
  ~FileSink() override;  ///< without close(): discards what is buffered
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  void write(std::string_view text) override;
  void close(bool sync);  ///< \param sync fsync first

 private:
  void flush();
  [[noreturn]] void fail(int error) const;
  std::string path_, buffer_;
  int descriptor_ = -1;
};

/// Compresses into another sink, as a gzip file (RFC 1952) without name and time: a member for each
/// 512 KiB of text, so that several threads can work on one file. The same text gives the same
/// bytes, however it is written and by how many threads.
class GzipSink : public TextSink {
 public:
  /// \param jobs  members that are compressed at the same time; 1: in this thread
  explicit GzipSink(TextSink& out, int jobs = 1);
  GzipSink(const GzipSink&) = delete;
  GzipSink& operator=(const GzipSink&) = delete;

  void write(std::string_view text) override;
  void finish();

 private:
  void begin_member(std::string text);
  void write_first();
  TextSink& out_;
  std::size_t jobs_;
  std::string text_;
  bool any_ = false;
  std::deque<std::future<std::string>> members_;  ///< under way, in order
};

}  // namespace palpate::data
