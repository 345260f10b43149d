#include "data/files/text_sink.h"

#include <fcntl.h>
#include <libdeflate.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <utility>

#include "data/errors.h"
#include "data/files/output_check.h"

namespace palpate::data {
namespace {

constexpr std::size_t kMember = 512 << 10;  // bytes of text

std::string gzip_member(std::string_view text) {
  constexpr int kLevel = 6;  // files are as large as with zlib's 6; 9 saves another 2 %
  using Compressor = std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)>;
  const Compressor compressor(libdeflate_alloc_compressor(kLevel), libdeflate_free_compressor);
  if (!compressor) throw StoreError("the samples could not be compressed: out of memory");
  std::string packed(libdeflate_gzip_compress_bound(compressor.get(), text.size()), '\0');
  packed.resize(libdeflate_gzip_compress(compressor.get(), text.data(), text.size(), packed.data(),
                                         packed.size()));
  packed.shrink_to_fit();
  return packed;
}

}  // namespace

FileSink::FileSink(const std::string& path)
    : FileSink(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600), path) {}

FileSink::FileSink(int descriptor, std::string path)
    : path_(std::move(path)), descriptor_(descriptor) {
  if (descriptor_ >= 0) return;
  const int error = errno;
  throw StoreError(path_ + ": cannot be created: " + write_fault(error) +
                   "; nothing was exported. Check the folder, its permissions and the free space");
}

FileSink::~FileSink() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FileSink::write(std::string_view text) {
  buffer_ += text;
  constexpr std::size_t kEnough = 1 << 18;
  if (buffer_.size() >= kEnough) flush();
}

void FileSink::close(bool sync) {
  flush();
  if (sync && ::fsync(descriptor_) != 0) fail(errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) fail(errno);
}

void FileSink::flush() {
  for (std::string_view rest = buffer_; !rest.empty();) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(errno);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
}

void FileSink::fail(int error) const {
  throw StoreError(path_ + ": cannot be written: " + write_fault(error) +
                   "; nothing was exported. Check the folder, its permissions and the free space");
}

GzipSink::GzipSink(TextSink& out, int jobs)
    : out_(out), jobs_(static_cast<std::size_t>(jobs > 1 ? jobs : 1)) {}

void GzipSink::write(std::string_view text) {
  text_ += text;
  while (text_.size() >= kMember) {
    std::string rest = text_.substr(kMember);
    text_.resize(kMember);
    begin_member(std::exchange(text_, std::move(rest)));
  }
}

void GzipSink::finish() {
  // A gzip file has one member at least.
  if (!text_.empty() || !any_) begin_member(std::exchange(text_, {}));
  while (!members_.empty()) write_first();
}

void GzipSink::begin_member(std::string text) {
  any_ = true;
  if (jobs_ == 1) {
    out_.write(gzip_member(text));
    return;
  }
  if (members_.size() == jobs_) write_first();
  members_.push_back(
      std::async(std::launch::async, [text = std::move(text)] { return gzip_member(text); }));
}

void GzipSink::write_first() {
  const std::string packed = members_.front().get();
  members_.pop_front();
  out_.write(packed);
}

}  // namespace palpate::data
