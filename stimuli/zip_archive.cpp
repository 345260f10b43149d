#include "stimuli/zip_archive.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <utility>

#include "stimuli/mesh_formats.h"

namespace palpate::stimuli {
namespace {

// Signatures and sizes of records (APPNOTE 4.3).
constexpr std::uint32_t kLocalMark = 0x04034b50, kEntryMark = 0x02014b50, kEndMark = 0x06054b50;
constexpr std::uint32_t kLargeEndMark = 0x06064b50, kLargeEndPlaceMark = 0x07064b50;
constexpr std::uint64_t kLocalSize = 30, kEntrySize = 46, kEndSize = 22, kLargeEndPlaceSize = 20;
constexpr std::uint64_t kLongestComment = 0xffff;
constexpr std::uint32_t kIn64Bits = 0xffffffff;  // the number is in the ZIP64 record
constexpr std::uint32_t kStored = 0, kDeflated = 8;

[[noreturn]] void refuse_byte(std::uint64_t at, std::string expected, std::string found) {
  throw ZipRefused{"byte " + std::to_string(at), std::move(expected), std::move(found)};
}

/// Checks a file's size and checksum while it is handed over.
class Unpacked {
 public:
  Unpacked(const std::string& name, std::uint64_t size,
           const std::function<bool(std::string_view)>& take)
      : name_(name), size_(size), take_(take) {}

  /// False: no more is wanted.
  bool add(std::string_view piece) {
    if (piece.size() > size_ - so_far_)
      throw ZipRefused{name_, std::to_string(size_) + " bytes", "more"};
    so_far_ += piece.size();
    sum_ =
        crc32(sum_, reinterpret_cast<const Bytef*>(piece.data()), static_cast<uInt>(piece.size()));
    return take_(piece);
  }

  void check(std::uint32_t checksum) const {
    if (so_far_ != size_)
      throw ZipRefused{name_, std::to_string(size_) + " bytes", std::to_string(so_far_)};
    if (sum_ != checksum)
      throw ZipRefused{name_, "the checksum in the archive's directory",
                       "another (the file is damaged)"};
  }

 private:
  const std::string& name_;
  std::uint64_t size_, so_far_ = 0;
  uLong sum_ = 0;
  const std::function<bool(std::string_view)>& take_;
};

constexpr std::size_t kPiece = std::size_t{1} << 16U;

/// False: no more was wanted.
bool unpack_stored(std::string_view packed, Unpacked& out) {
  for (; !packed.empty(); packed.remove_prefix(std::min(kPiece, packed.size()))) {
    if (!out.add(packed.substr(0, kPiece))) return false;
  }
  return true;
}

bool unpack_deflated(std::string_view packed, const std::string& name, Unpacked& out) {
  struct Stream : z_stream {
    Stream() : z_stream{} {}
    ~Stream() { inflateEnd(this); }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
  } stream;
  constexpr int kWithoutHeader = -MAX_WBITS;
  if (inflateInit2(&stream, kWithoutHeader) != Z_OK)
    throw ZipRefused{name, "memory to unpack it", "none"};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));  // not written to
  stream.avail_in = static_cast<uInt>(packed.size());
  std::array<char, kPiece> piece{};
  for (int result = Z_OK; result != Z_STREAM_END;) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = kPiece;
    result = inflate(&stream, Z_NO_FLUSH);
    const std::size_t got = kPiece - stream.avail_out;
    if ((result != Z_OK && result != Z_STREAM_END) || (got == 0 && result != Z_STREAM_END))
      throw ZipRefused{name, "packed data", "damaged ones"};
    if (!out.add({piece.data(), got})) return false;
  }
  return true;
}

}  // namespace

ZipArchive::ZipArchive(std::string_view bytes) : bytes_(bytes) {
  std::uint64_t at = 0, count = 0;
  find_directory(at, count);
  for (std::uint64_t i = 0; i < count; ++i) at = read_entry(at);
}

std::string ZipArchive::key_of(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  std::string key(name);
  for (char& c : key) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return key;
}

std::uint64_t ZipArchive::number(std::uint64_t at, std::size_t size) const {
  if (at > bytes_.size() || size > bytes_.size() - at) {
    refuse_byte(at, std::to_string(size) + " bytes",
                "the end of the file after " + std::to_string(bytes_.size()));
  }
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;)
    value = value << 8U | static_cast<unsigned char>(bytes_[at + i]);
  return value;
}

// It ends the file, before a comment of any length.
void ZipArchive::find_directory(std::uint64_t& at, std::uint64_t& count) const {
  const std::uint64_t size = bytes_.size();
  std::uint64_t end = size < kEndSize ? 0 : size - kEndSize;
  const std::uint64_t first = end - std::min(end, kLongestComment);
  while (size >= kEndSize && end > first && number(end, 4) != kEndMark) --end;
  if (size < kEndSize || number(end, 4) != kEndMark)
    throw ZipRefused{"", "a ZIP archive", "a file without an archive's directory at its end"};
  count = number(end + 10, 2);
  at = number(end + 16, 4);
  const bool is_large = end >= kLargeEndPlaceSize && (count == 0xffff || at == kIn64Bits);
  if (is_large && number(end - kLargeEndPlaceSize, 4) == kLargeEndPlaceMark) {
    const std::uint64_t large = number(end - kLargeEndPlaceSize + 8, 8);
    if (number(large, 4) != kLargeEndMark)
      refuse_byte(large, "the end of the archive's directory", "something else");
    count = number(large + 32, 8);
    at = number(large + 48, 8);
  }
}

// Returns where the next one is.
std::uint64_t ZipArchive::read_entry(std::uint64_t at) {
  if (number(at, 4) != kEntryMark) refuse_byte(at, "an entry of the directory", "something else");
  Entry entry;
  entry.flags = static_cast<std::uint32_t>(number(at + 8, 2));
  entry.method = static_cast<std::uint32_t>(number(at + 10, 2));
  entry.checksum = static_cast<std::uint32_t>(number(at + 16, 4));
  entry.packed = number(at + 20, 4);
  entry.unpacked = number(at + 24, 4);
  entry.header = number(at + 42, 4);
  const std::uint64_t name_size = number(at + 28, 2), extra = at + kEntrySize + name_size;
  const std::uint64_t comment = extra + number(at + 30, 2), next = comment + number(at + 32, 2);
  if (next > bytes_.size())
    refuse_byte(at, "an entry of the directory", "the end of the file within it");
  entry.name = std::string(bytes_.substr(at + kEntrySize, name_size));
  read_large_sizes(entry, extra, comment);
  if (entry.unpacked > kLongest - unpacked_)
    throw ZipRefused{in_quotes(entry.name), "at most 2 GiB in all files", "more"};
  unpacked_ += entry.unpacked;
  std::string key = key_of(entry.name);
  if (!entries_.try_emplace(std::move(key), entry).second)
    throw ZipRefused{in_quotes(entry.name), "a name that no other file has", "it twice"};
  return next;
}

// The extra field 1 has, in this order, those numbers that need 64 bits.
void ZipArchive::read_large_sizes(Entry& entry, std::uint64_t at, std::uint64_t end) const {
  while (at + 4 <= end) {
    const std::uint64_t kind = number(at, 2), size = number(at + 2, 2);
    const std::uint64_t next = at + 4 + size;
    if (kind == 1) {
      at += 4;
      for (std::uint64_t* value : {&entry.unpacked, &entry.packed, &entry.header}) {
        if (*value != kIn64Bits || at + 8 > std::min(next, end)) continue;
        *value = number(at, 8);
        at += 8;
      }
    }
    at = next;
  }
}

std::string_view ZipArchive::packed_bytes(const Entry& entry) const {
  if (number(entry.header, 4) != kLocalMark)
    refuse_byte(entry.header, "the header of " + in_quotes(entry.name), "something else");
  const std::uint64_t start =
      entry.header + kLocalSize + number(entry.header + 26, 2) + number(entry.header + 28, 2);
  if (start > bytes_.size() || entry.packed > bytes_.size() - start) {
    refuse_byte(start, std::to_string(entry.packed) + " bytes of " + in_quotes(entry.name),
                "the end of the file");
  }
  return bytes_.substr(start, entry.packed);
}

void ZipArchive::read(std::string_view name,
                      const std::function<bool(std::string_view)>& take) const {
  const Entry& entry = entries_.at(key_of(name));
  const std::string shown = in_quotes(entry.name);
  if ((entry.flags & 1U) != 0) throw ZipRefused{shown, "a file without a password", "one with it"};
  Unpacked out(shown, entry.unpacked, take);
  bool is_whole = false;
  if (entry.method == kStored) {
    is_whole = unpack_stored(packed_bytes(entry), out);
  } else if (entry.method == kDeflated) {
    is_whole = unpack_deflated(packed_bytes(entry), shown, out);
  } else {
    throw ZipRefused{shown, "a file that is stored or deflated",
                     "compression method " + std::to_string(entry.method)};
  }
  if (is_whole) out.check(entry.checksum);
}

}  // namespace palpate::stimuli
