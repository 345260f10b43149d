#include "data/export/clock.h"

#include <algorithm>
#include <limits>
#include <regex>

#include "data/files/utc.h"

namespace palpate::data {
namespace {

constexpr std::int64_t kYear1900 = -2'208'988'800'000'000'000;  // ns since 1970

/// a - b, saturated: the values may come from a damaged file.
std::int64_t difference(std::int64_t a, std::int64_t b) {
  std::int64_t out = 0;
  if (!__builtin_sub_overflow(a, b, &out)) return out;
  return a < b ? std::numeric_limits<std::int64_t>::min()
               : std::numeric_limits<std::int64_t>::max();
}

/// The factors of all protocols, each once, with the levels of all; a level that protocols set in
/// different ways has all of them.
std::vector<StoredFactor> factors_of(const std::vector<StoredProtocol>& protocols) {
  std::vector<StoredFactor> out;
  for (const StoredProtocol& protocol : protocols) {
    for (const StoredFactor& factor : protocol.factors) {
      auto known = std::ranges::find(out, factor.name, &StoredFactor::name);
      if (known == out.end()) known = out.insert(out.end(), {factor.name, {}});
      for (const auto& level : factor.levels) {
        const auto same = std::ranges::find(known->levels, level.first,
                                            &std::pair<std::string, std::string>::first);
        if (same == known->levels.end())
          known->levels.push_back(level);
        else if ((", " + same->second + ",").find(", " + level.second + ",") == std::string::npos)
          same->second += ", in another protocol " + level.second;
      }
    }
  }
  return out;
}

/// The dimensions of the levels of all protocols, each once.
std::vector<std::string> dimensions_of(const std::vector<StoredProtocol>& protocols) {
  std::vector<std::string> out;
  for (const StoredProtocol& protocol : protocols) {
    for (const StoredBlock& block : protocol.blocks) {
      for (const std::string& name : block.dimensions)
        if (std::ranges::find(out, name) == out.end()) out.push_back(name);
    }
  }
  return out;
}

}  // namespace

ExportClock::ExportClock(const std::vector<ProtocolInfo>& protocols, Times times)
    : times_(times), groups_(protocols) {
  std::vector<StoredProtocol> stored;
  for (const ProtocolInfo& protocol : protocols) {
    stored.push_back(read_stored_protocol(protocol.text));
    protocols_.emplace(protocol.sha256, stored.back());
  }
  factors_ = factors_of(stored);
  dimensions_ = dimensions_of(stored);
}

ExportClock::ExportClock(Store& store, Times times) : ExportClock(store.protocols(), times) {
  torque_ = TorqueNotes(store);
  groups_ = ParticipantGroups(store);
  if (relative()) firsts_ = store.first_onsets();
}

std::string ExportClock::onset_utc(const StoredTrial& trial) const {
  if (!relative()) return trial.record.onset_utc;
  return utc(trial.participant, to_unix_ns(trial.run.clock, trial.record.onset_ns));
}

double ExportClock::elapsed(const StoredTrial& trial) const {
  return static_cast<double>(
             since_first(trial.participant, to_unix_ns(trial.run.clock, trial.record.onset_ns))) /
         1e9;
}

std::string ExportClock::utc(const Participant& person, std::int64_t unix_ns) const {
  if (!relative()) return format_utc(unix_ns);
  return format_utc(to_unix_ns({.utc_ns = kYear1900}, since_first(person, unix_ns)));
}

std::string ExportClock::without_dates(const std::string& text) const {
  static const std::regex date(R"(\d{4}-\d{2}-\d{2}([T ][0-9:.]+Z?)?)");
  return relative() ? std::regex_replace(text, date, "(date left out)") : text;
}

std::int64_t ExportClock::since_first(const Participant& person, std::int64_t unix_ns) const {
  const auto first = firsts_.find(person.code);
  return first == firsts_.end() ? 0 : difference(unix_ns, first->second);
}

}  // namespace palpate::data
