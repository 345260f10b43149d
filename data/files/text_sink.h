#pragma once
// Internal to data/: output streams for the text of exports, with errors that name the file.

#include <memory>
#include <string>
#include <string_view>

namespace palpate::data {

// Protection against formula injection: text cells of CSV and TSV files that a spreadsheet would
// evaluate as a formula get a leading apostrophe
// (https://owasp.org/www-community/attacks/CSV_Injection).

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

/// Whether a text cell gets a leading ': it begins with = + - @ tab CR or LF, or would be read back
/// as a guarded one ('=1). Numbers are never guarded.
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

/// Compresses into another sink, as a gzip stream (RFC 1952) without name and time: the same text
/// gives the same bytes.
class GzipSink : public TextSink {
 public:
  explicit GzipSink(TextSink& out);
  ~GzipSink() override;
  GzipSink(const GzipSink&) = delete;
  GzipSink& operator=(const GzipSink&) = delete;

  void write(std::string_view text) override;
  void finish();

 private:
  struct Stream;
  void deflate_some(std::string_view text, int flush);
  TextSink& out_;
  std::unique_ptr<Stream> stream_;
};

}  // namespace palpate::data
