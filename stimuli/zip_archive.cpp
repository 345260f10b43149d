#include "stimuli/zip_archive.h"

#include <zip.h>

#include <array>
#include <utility>

#include "stimuli/mesh_formats.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 16U;

struct ZipError : zip_error_t {
  ZipError() : zip_error_t{} { zip_error_init(this); }
  ~ZipError() { zip_error_fini(this); }
  ZipError(const ZipError&) = delete;
  ZipError& operator=(const ZipError&) = delete;
};

struct CloseFile {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

}  // namespace

void ZipArchive::Discard::operator()(zip* archive) const { zip_discard(archive); }

ZipArchive::ZipArchive(std::string_view bytes) {
  if (bytes.empty()) throw ZipRefused{"", "a ZIP archive", "an empty file"};
  ZipError error;
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source != nullptr) archive_.reset(zip_open_from_source(source, ZIP_RDONLY, &error));
  if (archive_ == nullptr) {
    std::string why = zip_error_code_zip(&error) == ZIP_ER_NOZIP ? "another file, or one cut off"
                                                                 : zip_error_strerror(&error);
    zip_source_free(source);
    throw ZipRefused{"", "a ZIP archive", std::move(why)};
  }
  const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
  for (zip_uint64_t i = 0; std::cmp_less(i, count); ++i) {
    zip_stat_t about;
    zip_stat_init(&about);
    // A name is taken as its bytes stand.
    if (zip_stat_index(archive_.get(), i, ZIP_FL_ENC_RAW, &about) != 0 ||
        (about.valid & (ZIP_STAT_NAME | ZIP_STAT_SIZE)) != (ZIP_STAT_NAME | ZIP_STAT_SIZE))
      throw ZipRefused{"", "a name and a size of file " + std::to_string(i + 1), "none"};
    const Entry entry{about.name, i, about.size};
    if (entry.unpacked > kLongest - unpacked_)
      throw ZipRefused{in_quotes(entry.name), "at most 2 GiB in all files", "more"};
    unpacked_ += entry.unpacked;
    if (!entries_.try_emplace(key_of(entry.name), entry).second)
      throw ZipRefused{in_quotes(entry.name), "a name that no other file has", "it twice"};
  }
}

std::string ZipArchive::key_of(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  std::string key(name);
  for (char& c : key) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return key;
}

void ZipArchive::read(std::string_view name,
                      const std::function<bool(std::string_view)>& take) const {
  const Entry& entry = entries_.at(key_of(name));
  const auto refuse = [&entry](const char* why) {
    throw ZipRefused{in_quotes(entry.name), "a file that can be unpacked", why};
  };
  const std::unique_ptr<zip_file_t, CloseFile> file(
      zip_fopen_index(archive_.get(), entry.index, 0));
  if (file == nullptr) refuse(zip_strerror(archive_.get()));
  std::array<char, kPiece> piece{};
  std::uint64_t so_far = 0;
  for (;;) {
    const zip_int64_t got = zip_fread(file.get(), piece.data(), piece.size());
    if (got < 0) refuse(zip_file_strerror(file.get()));
    so_far += static_cast<std::uint64_t>(got);
    if (so_far > entry.unpacked || (got == 0 && so_far < entry.unpacked))
      throw ZipRefused{in_quotes(entry.name), std::to_string(entry.unpacked) + " bytes",
                       got == 0 ? std::to_string(so_far) : "more"};
    if (got == 0 || !take({piece.data(), static_cast<std::size_t>(got)})) return;
  }
}

}  // namespace palpate::stimuli
