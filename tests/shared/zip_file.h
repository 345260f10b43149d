#pragma once
// Writes ZIP archives, put together from the specification (APPNOTE 6.3.10, 4.3).

#include <zlib.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace palpate::testing {

struct ZipForm {
  bool deflated = true, large = false;  ///< large: sizes and places in ZIP64 records
  std::string comment = {};
};

inline std::string raw_deflated(const std::string& text) {
  z_stream stream{};
  if (deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("deflate");
  std::string packed(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// \param files  names and contents
inline std::string zip_file(const std::vector<std::pair<std::string, std::string>>& files,
                            const ZipForm& form = {}) {
  const auto word = [](std::uint64_t value, int size) {
    std::string bytes;
    for (int b = 0; b < size; ++b) bytes += static_cast<char>(value >> (8 * b) & 255U);
    return bytes;
  };
  constexpr std::uint64_t kElsewhere = 0xffffffff;
  std::string out, directory;
  for (const auto& [name, text] : files) {
    const std::string packed = form.deflated ? raw_deflated(text) : text;
    const std::uint64_t sum =
        crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
    const std::string how = word(0, 2) + word(form.deflated ? 8 : 0, 2) + word(0, 4) + word(sum, 4);
    const auto sizes = [&, &body = text](bool elsewhere) {
      return elsewhere ? word(kElsewhere, 4) + word(kElsewhere, 4)
                       : word(packed.size(), 4) + word(body.size(), 4);
    };
    const std::string large_sizes = word(text.size(), 8) + word(packed.size(), 8);
    const std::string extra_local = form.large ? word(1, 2) + word(16, 2) + large_sizes : "";
    const std::string extra =
        form.large ? word(1, 2) + word(24, 2) + large_sizes + word(out.size(), 8) : "";
    directory += word(0x02014b50, 4) + word(45, 2) + word(45, 2) + how + sizes(form.large) +
                 word(name.size(), 2) + word(extra.size(), 2) + word(0, 2) + word(0, 2) +
                 word(0, 2) + word(0, 4) + word(form.large ? kElsewhere : out.size(), 4) + name +
                 extra;
    out += word(0x04034b50, 4) + word(45, 2) + how + sizes(form.large) + word(name.size(), 2) +
           word(extra_local.size(), 2) + name + extra_local + packed;
  }
  const std::uint64_t start = out.size(), count = files.size();
  out += directory;
  if (form.large) {
    const std::uint64_t end = out.size();
    out += word(0x06064b50, 4) + word(44, 8) + word(45, 2) + word(45, 2) + word(0, 4) + word(0, 4) +
           word(count, 8) + word(count, 8) + word(directory.size(), 8) + word(start, 8);
    out += word(0x07064b50, 4) + word(0, 4) + word(end, 8) + word(1, 4);
  }
  const std::uint64_t shown_count = form.large ? 0xffff : count;
  out += word(0x06054b50, 4) + word(0, 2) + word(0, 2) + word(shown_count, 2) +
         word(shown_count, 2) + word(directory.size(), 4) +
         word(form.large ? kElsewhere : start, 4) + word(form.comment.size(), 2) + form.comment;
  return out;
}

}  // namespace palpate::testing
