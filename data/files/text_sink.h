#pragma once
// Internal to data/: where the text of an export goes.

#include <memory>
#include <string>
#include <string_view>

namespace palpate::data {

class TextSink {
 public:
  virtual ~TextSink() = default;
  virtual void write(std::string_view text) = 0;
};

/// A file of its own, created 0600, written in large pieces. \throws StoreError, naming the file.
class FileSink : public TextSink {
 public:
  explicit FileSink(const std::string& path);  ///< must not be there yet
  /// Takes over an open file. \param path for messages
  FileSink(int descriptor, std::string path);
  ~FileSink() override;  ///< without close(): as it is
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  void write(std::string_view text) override;
  void close(bool sync);  ///< \param sync on the disk when it returns

 private:
  void flush();
  [[noreturn]] void fail(int error) const;
  std::string path_, buffer_;
  int descriptor_ = -1;
};

/// Text into another sink, as a gzip stream with no name and no time in it: the same text gives the
/// same bytes.
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
