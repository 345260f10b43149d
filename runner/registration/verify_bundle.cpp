#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/export/study_about.h"
#include "runner/registration/bundle_contents.h"
#include "runner/registration/sealed_folder.h"
#include "runner/registration/verify_descriptions.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

namespace fs = std::filesystem;

/// Prints what was compared, and counts differences.
class Comparison {
 public:
  void same(const std::string& what) { std::cout << "same     " << what << "\n"; }
  void differs(const std::string& what) {
    std::cout << "DIFFERS  " << printable(what) << "\n";
    ++differences_;
  }
  /// \param faults  differences; none: `what` is the same
  void result(const std::string& what, const std::vector<std::string>& faults) {
    constexpr std::size_t kMost = 20;
    for (std::size_t i = 0; i < std::min(kMost, faults.size()); ++i) differs(faults[i]);
    if (faults.size() > kMost) differs("and " + std::to_string(faults.size() - kMost) + " more");
    if (faults.empty()) same(what);
  }
  bool all_same() const { return differences_ == 0; }

 private:
  std::size_t differences_ = 0;
};

/// The number of the first differing line, from 1.
std::size_t first_different_line(const std::string& a, const std::string& b) {
  std::size_t line = 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()) && a[i] == b[i]; ++i)
    line += a[i] == '\n' ? 1 : 0;
  return line;
}

/// "2026-11-25" of a stored description; "": it has none.
std::string date_of_crate(const std::string& text) {
  const auto json = json_or_discarded(text);
  if (!json.is_object() || !json.contains("@graph") || !json["@graph"].is_array()) return "";
  static const std::regex date(R"(\d{4}-\d\d-\d\d)");
  for (const auto& entity : json["@graph"]) {
    if (!entity.is_object() || !entity.contains("datePublished")) continue;
    const auto& published = entity["datePublished"];
    if (published.is_string() && published.get_ref<const std::string&>().size() == 10 &&
        std::regex_match(published.get<std::string>(), date))
      return published;
  }
  return "";
}

/// Compares files that follow from the base with those of the folder.
void compare_derived(const std::string& folder, const BundleFacts& facts, Comparison& out) {
  std::map<std::string, std::string> made = derived_files(facts);
  const std::vector<std::string> there = files_below(folder);
  std::string crate;
  if (std::ranges::binary_search(there, kCrate)) crate = read_member(folder, kCrate);
  made[kCrate] = crate_text(folder, facts, date_of_crate(crate));
  std::vector<std::string> figures;
  std::size_t same_figures = 0;
  for (const auto& [name, text] : made) {
    if (!std::ranges::binary_search(there, name)) {
      out.differs(name + " is missing");
      continue;
    }
    const std::string stored = read_member(folder, name);
    if (stored != text) {
      out.differs(name + ", made again, from line " +
                  std::to_string(first_different_line(stored, text)));
    } else if (name.starts_with("figures/")) {
      ++same_figures;
    } else {
      out.same(name + ", made again" + (name == "analysis.json" ? " from data/trials.csv" : ""));
    }
  }
  for (const std::string& name : there) {
    if (name.starts_with("figures/") && !made.contains(name))
      out.differs(name + " is none of the analysis");
    if (name.starts_with("check.") && !facts.checked)
      out.differs(name + " is there without a registration");
  }
  if (same_figures > 0) out.same("figures/, " + std::to_string(same_figures) + " made again");
}

void note_other_version(const std::string& folder) {
  const auto json = json_or_discarded(read_member(folder, "analysis.json"));
  const auto version =
      json.is_object() ? json.value("program_version", nlohmann::json()) : nlohmann::json();
  if (version != PALPATE_VERSION)
    std::cout << "It was made with palpate " << json_excerpt(version)
              << ", this is " PALPATE_VERSION "\n";
}

// The tables of the dataset. Each row of trials.csv must be in one of them, once, with the same
// fields.

/// A trial: protocol, participant, session, trial.
using TrialKey = std::tuple<std::string, std::string, std::string, std::string>;

class DatasetTables {
 public:
  explicit DatasetTables(const TextTable& trials) : trials_(trials) {
    for (std::size_t i = 0; i < trials.rows.size(); ++i)
      row_of_[{field(i, "protocol_sha256"), field(i, "participant_id"), field(i, "session"),
               field(i, "trial")}] = i;
  }

  /// \param participant  of a table without a column for it \param missing  how it writes ""
  void compare(const std::string& name, const TextTable& table, const std::string& participant,
               const std::string& missing) {
    const auto value = [&](std::size_t row, std::string_view column) {
      const std::size_t at = table.column(column);
      return at < table.header.size() ? table.rows[row][at] : std::string();
    };
    std::vector<std::pair<std::size_t, std::size_t>> columns;  // of the table, of trials.csv
    for (std::size_t i = 0; i < table.header.size(); ++i) {
      const std::size_t at = trials_.column(table.header[i]);
      if (at < trials_.header.size()) columns.emplace_back(i, at);
    }
    // Of a table of BIDS, participants.tsv has the person's columns.
    const std::size_t of_person =
        participant.empty() ? 0 : 1 + (trials_.column("group") < trials_.header.size() ? 1 : 0);
    if (columns.size() + of_person != trials_.header.size())
      faults_.push_back(name + ": has other columns than data/trials.csv");
    std::optional<Begin> first;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::string where = name + ", row " + std::to_string(row + 1);
      const auto found =
          row_of_.find({value(row, "protocol_sha256"),
                        participant.empty() ? value(row, "participant_id") : participant,
                        value(row, "session"), value(row, "trial")});
      if (found == row_of_.end()) {
        faults_.push_back(where + ": its trial is not in data/trials.csv, or twice in the dataset");
        continue;
      }
      const std::vector<std::string>& trial = trials_.rows[found->second];
      for (const auto& [mine, theirs] : columns) {
        const std::string& there = table.rows[row][mine];
        if (there != (trial[theirs].empty() ? missing : trial[theirs]))
          faults_.push_back(where + ": " + table.header[mine] + " is " + there +
                            ", in data/trials.csv " + trial[theirs]);
      }
      if (participant.empty()) {
        row_of_.erase(found);
        continue;
      }
      compare_duration(where, value(row, "duration"), trial);
      const Begin begin{number(value(row, "onset")), begin_of(trial)};
      if (!first) first = begin;
      if (!(std::fabs((begin.onset - first->onset) - (begin.elapsed - first->elapsed)) <= kTick))
        faults_.push_back(where + ": onset is " + value(row, "onset") +
                          ", in data/trials.csv elapsed is " + trial_field(trial, "elapsed"));
      row_of_.erase(found);
    }
  }

  const std::vector<std::string>& finish() {
    for (const auto& [key, row] : row_of_)
      faults_.push_back("data/trials.csv, trial " + std::to_string(row + 1) +
                        ": is not in the dataset");
    return faults_;
  }

 private:
  const std::string& field(std::size_t row, std::string_view name) const {
    static const std::string none;
    const std::size_t at = trials_.column(name);
    return at < trials_.header.size() ? trials_.rows[row][at] : none;
  }

  static constexpr double kTick = 2e-3;  // s; onsets may be rounded to ticks of the servo

  /// The first tick of a trial with forces on, in s: in a table of BIDS, and in trials.csv.
  struct Begin {
    double onset, elapsed;
  };

  static double number(const std::string& text) {
    double value = NAN;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
  }

  std::string trial_field(const std::vector<std::string>& trial, const char* name) const {
    const std::size_t at = trials_.column(name);
    return at < trial.size() ? trial[at] : std::string();
  }

  /// From the first to the last interval, s; 0: one interval, or none.
  double last_onset(const std::vector<std::string>& trial) const {
    const std::string onsets = trial_field(trial, "interval_onsets");
    const std::size_t end = onsets.find_last_not_of(';');
    if (end == std::string::npos) return 0;
    const std::size_t before = onsets.rfind(';', end);
    const std::size_t begin = before == std::string::npos ? 0 : before + 1;
    return number(onsets.substr(begin, end + 1 - begin));
  }

  /// `elapsed` is that of the last interval.
  double begin_of(const std::vector<std::string>& trial) const {
    return number(trial_field(trial, "elapsed")) - last_onset(trial);
  }

  /// BIDS has it in place of a column of trials.csv.
  void compare_duration(const std::string& where, const std::string& duration,
                        const std::vector<std::string>& trial) {
    const std::string response_time = trial_field(trial, "response_time");
    const double expected = number(response_time) + last_onset(trial);
    if (trial_field(trial, "timed_out") == "0" &&
        !(std::fabs(number(duration) - expected) <= kTick))
      faults_.push_back(where + ": duration is " + duration +
                        ", in data/trials.csv response_time " + response_time);
  }

  const TextTable& trials_;
  std::map<TrialKey, std::size_t> row_of_;
  std::vector<std::string> faults_;
};

/// A table of BIDS: tabs, no quotes.
TextTable split_tsv(const std::string& text) {
  TextTable out;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::vector<std::string> row(1);
    for (const char c : text.substr(begin, end - begin)) {
      if (c == '\t') {
        row.emplace_back();
      } else {
        row.back() += c;
      }
    }
    begin = end + 1;
    if (out.header.empty()) {
      out.header = std::move(row);
    } else {
      row.resize(out.header.size());
      out.rows.push_back(std::move(row));
    }
  }
  return out;
}

/// Participants of participants.tsv, their groups, and whether they are simulated.
void compare_people(const std::string& folder, const TextTable& trials,
                    std::vector<std::string>& faults) {
  const TextTable table = split_tsv(read_member(folder, "data/bids/participants.tsv"));
  const auto said_of_person = [](const TextTable& of, const std::vector<std::string>& row) {
    std::vector<std::string> out;
    for (const char* const name : {"participant_id", "simulated", "group"}) {
      const std::size_t at = of.column(name);
      out.push_back(at < row.size() ? row[at] : "");
      if (out.back() == "n/a") out.back().clear();
    }
    return out;
  };
  std::set<std::vector<std::string>> there, expected;
  for (const auto& row : table.rows) there.insert(said_of_person(table, row));
  for (const auto& row : trials.rows) {
    std::vector<std::string> person = said_of_person(trials, row);
    person.front().insert(0, "sub-");
    expected.insert(std::move(person));
  }
  if (there != expected)
    faults.push_back("data/bids/participants.tsv: has other participants than data/trials.csv");
}

void compare_tables(const std::string& folder, const BundleFacts& facts, Comparison& out) {
  const std::string base = "data/" + facts.format + "/";
  static const std::regex psych_ds(
      R"(data/psych-ds/data/subject-[^/]+/study-[0-9A-Za-z]+_subject-[0-9A-Za-z]+_data\.csv)");
  static const std::regex bids(R"(data/bids/sub-([0-9A-Za-z]+)/.*_beh\.tsv)");
  DatasetTables tables(facts.trials);
  std::vector<std::string> faults;
  for (const std::string& name : files_below(folder)) {
    std::smatch match;
    if (std::regex_match(name, psych_ds)) {
      tables.compare(name, read_text_table((fs::path(folder) / name).string()), "", "");
    } else if (std::regex_match(name, match, bids)) {
      tables.compare(name, split_tsv(read_member(folder, name)), match[1], "n/a");
    }
  }
  if (facts.format == "bids") compare_people(folder, facts.trials, faults);
  const auto& found = tables.finish();
  faults.insert(faults.end(), found.begin(), found.end());
  out.result(base + ", its tables of trials, by data/trials.csv", faults);
}

/// Attempts, protocols and terms of use, which a dataset repeats.
void compare_copies(const std::string& folder, const BundleFacts& facts, Comparison& out) {
  const std::string base = "data/" + facts.format + "/";
  const std::vector<std::string> there = files_below(folder);
  std::vector<std::string> faults;
  std::string attempts;
  for (const std::string& name : there) {
    if (name.starts_with("data/") && !name.starts_with(base) && name.ends_with("attempts.csv"))
      attempts = read_member(folder, name);
  }
  const std::set<std::string> protocols = [&] {
    std::set<std::string> texts;
    for (const analysis::ProtocolText& one : facts.record.protocols) texts.insert(one.text);
    return texts;
  }();
  for (const std::string& name : there) {
    if (!name.starts_with(base)) continue;
    const bool lists_attempts =
        name.ends_with("/attempts.csv") || name.ends_with("_description-attempts_data.csv");
    if (lists_attempts && read_member(folder, name) != attempts)
      faults.push_back(name + ": differs from the attempts beside data/trials.csv");
    if (name.ends_with("_protocol.json") && !protocols.contains(read_member(folder, name)))
      faults.push_back(name + ": is no protocol of " + std::string(kRecord));
  }
  out.result(base + ", its attempts and protocols", faults);

  faults.clear();
  const nlohmann::json stated =
      json_or_discarded(read_member(folder, base + "dataset_description.json"));
  data::StudyAbout whole;  // names every term
  whole.authors = {{"x", "x", "x"}};
  whole.license = whole.doi = whole.acknowledgements = whole.how_to_acknowledge = "x";
  whole.funding = {{"x", "x"}};
  whole.ethics_approvals = whole.references = {"x"};
  const auto terms = [&](const data::StudyAbout& about) {
    return nlohmann::json(facts.format == "bids" ? data::bids_fields(about)
                                                 : data::schema_org_terms(about));
  };
  // items() refers to its value, which must outlive the loop.
  const nlohmann::json expected = terms(facts.about), every = terms(whole);
  for (const auto& [key, unused] : every.items()) {
    const nlohmann::json found =
        stated.is_object() ? stated.value(key, nlohmann::json()) : nlohmann::json();
    if (found != expected.value(key, nlohmann::json()))
      faults.push_back(base + "dataset_description.json: " + key + " is " + json_excerpt(found) +
                       ", by about.json " + json_excerpt(expected.value(key, nlohmann::json())));
  }
  const std::string readme = base + (facts.format == "bids" ? "README" : "README.md");
  if (read_member(folder, readme).find(data::about_text(facts.about)) == std::string::npos)
    faults.push_back(readme + ": states other authors or terms than about.json");
  out.result(base + ", its authors and license, by about.json", faults);
}

void compare_digest(const BundleFacts& facts, const std::string& digest, Comparison& out) {
  std::vector<std::string> faults;
  if (!facts.checked) {
    faults.emplace_back("registration/: there is none, and so no digest");
  } else if (digest != facts.checked->registered.digest) {
    faults.emplace_back("registration/: its digest is not the given one");
  }
  out.result("registration/, by the given digest", faults);
}

}  // namespace

void print_conclusion(const BundleFacts& facts) {
  if (facts.checked)
    std::cout << "Digest of the registration " << facts.checked->registered.digest << "\n";
  std::cout << conclusion_of(facts) << "\n";
  if (!facts.checked) return;
  for (const auto& [one, judgement] : facts.checked->check.hypotheses)
    std::cout << one.id << ": " << analysis::to_string(judgement.verdict) << "\n";
}

int verify_bundle(const std::string& folder, const std::string& digest) {
  Comparison out;
  out.result("every file, by its checksum", checksum_faults(folder));
  const auto facts_read = [&]() -> std::optional<BundleFacts> {
    try {
      const std::string check = (fs::path(folder) / "check.json").string();
      const bool registered = fs::exists(fs::path(folder) / "registration");
      return bundle_facts(folder, registered
                                      ? parse_points(read_member(folder, "check.json"), check)
                                      : std::vector<CheckPoint>());
    } catch (const std::runtime_error& error) {  // UsageError and InputError, too
      out.differs(error.what());
      return std::nullopt;
    }
  }();
  if (!facts_read) return 1;
  const BundleFacts& facts = *facts_read;
  compare_derived(folder, facts, out);
  compare_tables(folder, facts, out);
  compare_copies(folder, facts, out);
  out.result("the meanings of columns and values, by the protocols",
             description_faults(folder, facts));
  if (!digest.empty()) compare_digest(facts, digest, out);
  if (!out.all_same()) note_other_version(folder);
  print_conclusion(facts);
  return out.all_same() ? 0 : 1;
}

}  // namespace palpate::runner::registration
