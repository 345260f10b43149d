#pragma once
// Internal to data/: output streams for the text of exports, with errors that name the file.

#include <memory>
#include <string>
#include <string_view>

namespace palpate::data {

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
