#include "runner/design/study_data.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <system_error>

#include "data/base/checksum.h"
#include "data/base/text.h"
#include "data/store/store.h"
#include "protocols/difference.h"
#include "protocols/parse.h"

namespace palpate::runner::design {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostDatabases = 20;  // of a folder, the latest ones

/// The latest first.
std::vector<std::string> databases_in(const std::string& folder) {
  std::vector<fs::directory_entry> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    std::error_code none;
    if (entry.path().extension() == ".db" && entry.is_regular_file(none)) found.push_back(entry);
  }
  const auto time = [](const fs::directory_entry& one) {
    std::error_code none;
    return one.last_write_time(none);
  };
  std::ranges::sort(found, std::greater<>(), time);
  std::vector<std::string> out;
  for (const fs::directory_entry& one : found) {
    if (out.size() < kMostDatabases) out.push_back(one.path().string());
  }
  return out;
}

/// \param sha256  of the text
void add_data(const protocols::Protocol& now, const std::string& text, const std::string& sha256,
              const std::string& database, Json& out) {
  data::Store store = data::Store::open(database, data::Store::Mode::read_only);
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.name != now.name) continue;
    const std::vector<data::Participant> people = store.participants(info.sha256);
    if (people.empty()) continue;
    Json& one = out.emplace_back();
    one = {{"database", printable(fs::path(database).filename().string())},
           {"participants", people.size()},
           {"simulated", std::ranges::all_of(people, &data::Participant::simulated)},
           {"same", info.sha256 == sha256}};
    if (info.sha256 == sha256) continue;
    const protocols::ProtocolDifference differs = protocols::difference(info.text, text);
    one["differs"] =
        differs.nothing() ? "layout alone" : printable(protocols::in_words(differs), 300);
    one["only_texts"] = differs.only_texts();
  }
}

}  // namespace

Json study_data(const std::string& text, const ProtocolFile& file,
                const std::vector<std::string>& databases) {
  const protocols::Protocol now = protocols::parse_protocol_text(text, file.path());
  const std::string sha256 = checksum_hex(text);
  std::vector<std::string> all = databases;
  for (const std::string& one : databases_in(file.folder())) {
    const auto is_same = [&one](const std::string& given) {
      std::error_code none;
      return fs::equivalent(given, one, none);
    };
    if (std::ranges::none_of(databases, is_same)) all.push_back(one);
  }
  Json out = Json::array();
  for (const std::string& database : all) {
    try {
      add_data(now, text, sha256, database, out);
    } catch (const std::exception&) {
      // Another program's file, or one that is being made.
    }
  }
  return out;
}

}  // namespace palpate::runner::design
