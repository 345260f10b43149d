// Compression of exports: any reader gets the text back, and threads and pieces change no byte.

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <string_view>

#include "data/files/text_sink.h"

namespace palpate::data {
namespace {

class Kept final : public TextSink {
 public:
  void write(std::string_view text) override { all += text; }
  std::string all;
};

/// Member after member, as gzip readers do.
std::string unpacked(const std::string& packed) {
  std::string out;
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string room(1 << 16, '\0');
  while (stream.avail_in > 0) {
    stream.next_out = reinterpret_cast<Bytef*>(room.data());
    stream.avail_out = static_cast<uInt>(room.size());
    const int status = inflate(&stream, Z_NO_FLUSH);
    out.append(room.data(), room.size() - stream.avail_out);
    if (status == Z_STREAM_END) {
      inflateReset(&stream);
    } else if (status != Z_OK) {
      ADD_FAILURE() << "status " << status;
      break;
    }
  }
  inflateEnd(&stream);
  return out;
}

std::string packed(const std::string& text, std::size_t piece, int jobs) {
  Kept kept;
  GzipSink sink(kept, jobs);
  for (std::size_t at = 0; at < text.size(); at += piece) sink.write(text.substr(at, piece));
  sink.finish();
  return kept.all;
}

std::string rows(std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i)
    text += std::to_string(i * 7919 % 100003) + "\t" + std::to_string(i) + "\n";
  return text;
}

TEST(GzipSink, GivesTheTextBack) {
  for (const std::size_t count : {0, 1, 1000, 1'000'000}) {
    const std::string text = rows(count);
    EXPECT_EQ(unpacked(packed(text, 1 << 16, 1)), text) << count;
  }
}

TEST(GzipSink, DependsOnNeitherThreadsNorPieces) {
  const std::string text = rows(1'000'000);  // more than three members
  ASSERT_GT(text.size(), 12U << 20);
  const std::string one = packed(text, 100, 1);
  EXPECT_EQ(packed(text, text.size(), 1), one);
  for (const int jobs : {2, 3, 16}) EXPECT_EQ(packed(text, 777, jobs), one) << jobs;
}

TEST(GzipSink, MakesAFileOfNothing) {
  const std::string empty = packed("", 1, 4);
  EXPECT_FALSE(empty.empty());
  EXPECT_EQ(unpacked(empty), "");
}

}  // namespace
}  // namespace palpate::data
