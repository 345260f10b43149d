#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "analysis/input/column_names.h"
#include "analysis/input/csv_reader.h"
#include "analysis/input/torque_counts.h"
#include "analysis/input/trial_table_builder.h"
#include "analysis/input/trials.h"
#include "analysis/text.h"
#include "data/files/formula_guard.h"
#include "protocols/parse.h"

namespace palpate::analysis {

namespace {

enum Column {
  participant_id,
  session,
  block,
  trial,
  renderer,
  shape,
  response,
  correct,
  response_time,
  practice,
  timed_out,
  simulated,
  protocol_sha256,
  program_version,
  torque_driven,
  n_columns
};
constexpr std::array<std::string_view, n_columns> kColumns{
    "participant_id", "session",   "block",           "trial",           "renderer",
    "shape",          "response",  "correct",         "response_time",   "practice",
    "timed_out",      "simulated", "protocol_sha256", "program_version", "torque_driven"};
constexpr int kNeeded = response_time + 1;
constexpr std::size_t kAbsent = static_cast<std::size_t>(-1);

constexpr std::size_t kMaxName = 200;     // bytes; codes of our own participants have at most 32
constexpr std::size_t kMaxStimuli = 200;  // the confusion matrix has the square of it
constexpr std::size_t kMaxParticipants = 10000;
constexpr std::size_t kMaxRenderers = 20;
constexpr std::size_t kMaxCells = 4'000'000;  // participants x renderers x stimuli: some 500 MB
constexpr std::string_view kNoResponse = "no_response";  // a key in the JSON results
constexpr double kMaxTime = 1e6;                         // s, 11 days; bounds every sum of squares

/// Collects faults: the first kMaxFaults in full, further ones as a number.
class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}
  void add(const std::string& location, const std::string& expected) {
    if (++count_ <= kMaxFaults) faults_.push_back({file_, location, expected});
  }
  std::size_t count() const { return count_; }
  void throw_if_any() {
    if (count_ == 0) return;
    if (count_ > kMaxFaults) {
      faults_.push_back(
          {file_, "further lines",
           "and " + std::to_string(count_ - kMaxFaults) + " more faults of these kinds"});
    }
    throw protocols::InputError(std::move(faults_));
  }

 private:
  std::string file_;
  std::vector<protocols::Fault> faults_;
  std::size_t count_ = 0;
};

/// Parses one file into a TrialTable.
class CsvTrials {
 public:
  explicit CsvTrials(const std::string& path) : path_(path), faults_(path) {}

  TrialTable read() {
    std::optional<CsvReader> reader;
    try {
      reader.emplace(path_);
    } catch (const std::runtime_error& error) {
      faults_.add("file", std::string("expected a CSV file that can be read; ") + error.what());
      faults_.throw_if_any();
    }
    if (reader->next() && reader->fault().empty()) {
      read_header(*reader);
      faults_.throw_if_any();  // rows cannot be read without their columns
      while (reader->next()) read_row(*reader);
    }
    if (!reader->fault().empty()) faults_.add(line(*reader), reader->fault());
    if (faults_.count() == 0 && n_rows_ == 0) {
      faults_.add("file", "expected a header and at least one trial");
    }
    faults_.throw_if_any();
    return finish();
  }

 private:
  static std::string line(const CsvReader& reader) {
    return reader.line() == 0 ? "file" : "line " + std::to_string(reader.line());
  }

  void read_header(const CsvReader& reader) {
    const auto& names = reader.fields();
    n_fields_ = names.size();
    at_.fill(kAbsent);
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto found = std::find(kColumns.begin(), kColumns.end(), names[i]);
      if (found == kColumns.end()) continue;
      auto& at = at_[static_cast<std::size_t>(found - kColumns.begin())];
      if (at != kAbsent) {
        faults_.add(line(reader) + ", column " + std::string(names[i]),
                    "expected each column once; found as columns " + std::to_string(at + 1) +
                        " and " + std::to_string(i + 1));
      } else {
        at = i;
      }
    }
    std::vector<std::string_view> known(kColumns.begin(), kColumns.end());
    known.emplace_back("task");  // a table with it is one of tasks
    const std::vector<AlikeColumn> alike =
        alike_columns(std::vector<std::string>(names.begin(), names.end()), known);
    for (const AlikeColumn& one : alike) warnings_.push_back(sentence(one));
    std::string hint;
    if (names.size() == 1) hint = " (one column only: are the fields separated by commas?)";
    for (std::size_t i = 0; i < kNeeded; ++i) {
      if (at_[i] == kAbsent) {
        faults_.add(line(reader), "expected a column '" + std::string(kColumns[i]) + "'" + hint +
                                      hint_for(kColumns[i], alike));
      }
    }
  }

  std::string_view field(Column column) const { return (*fields_)[at_[column]]; }

  void fault(Column column, std::string_view expected) {
    ok_ = false;
    // Only faults that are listed are formatted: a file may have millions of bad rows.
    if (faults_.count() >= kMaxFaults) return faults_.add({}, {});
    faults_.add(line(*reader_) + ", column " + std::string(kColumns[column]),
                "expected " + std::string(expected) + "; found '" +
                    stimuli::printable(field(column), 40) + "'");
  }

  /// A name; an apostrophe that an export put before it against spreadsheet formulas is removed.
  std::string_view name(Column column, const Interner& known) {
    const std::string_view text = data::unguarded(field(column));
    if (known.contains(text)) return text;
    if (text.empty() || text.size() > kMaxName || !stimuli::is_plain_utf8(text)) {
      fault(column, "a name of 1 to 200 bytes of UTF-8 without control characters");
    }
    if (text == kNoResponse) {
      fault(column, column == renderer ? "a renderer; this name is taken"
                                       : "a stimulus; empty where there was no response");
    }
    return text;
  }

  int number(Column column) {
    const std::string_view text = field(column);
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || value < 1) {
      fault(column, "a whole number from 1");
    }
    return value;
  }

  /// How R, pandas, BIDS and spreadsheets write a missing value.
  static bool missing(std::string_view text) {
    for (const std::string_view nothing : {"", "NA", "n/a", "N/A", "NaN", "nan"}) {
      if (text == nothing) return true;
    }
    return false;
  }

  bool truth(Column column) {
    if (at_[column] == kAbsent) return false;
    const std::string_view text = field(column);
    if (text != "0" && text != "1") fault(column, "0 or 1");
    return text == "1";
  }

  double time(Column column) {
    const std::string_view text = field(column);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    // from_chars reports underflow and overflow alike: both are faults.
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value) ||
        value < 0 || value > kMaxTime) {
      fault(column,
            "a time in s, 0 to 1000000, with a decimal point (empty or NA for a time-out alone)");
    }
    return value;
  }

  void read_row(const CsvReader& reader) {
    ++n_rows_;
    if (!reader.fault().empty()) return faults_.add(line(reader), reader.fault());
    if (reader.fields().size() != n_fields_) {
      return faults_.add(line(reader), "expected " + std::to_string(n_fields_) +
                                           " fields, as in the header; found " +
                                           std::to_string(reader.fields().size()));
    }
    reader_ = &reader;
    fields_ = &reader.fields();
    ok_ = true;
    RawTrial raw;
    raw.participant = name(participant_id, names_);
    raw.session = number(session);
    raw.block = number(block);
    raw.trial = number(trial);
    raw.renderer = name(renderer, renderers_);
    raw.shape = name(shape, stimuli_);
    if (!missing(field(response)) || stimuli_.contains(field(response)))
      raw.response = name(response, stimuli_);
    raw.timed_out = at_[timed_out] == kAbsent ? raw.response.empty() : truth(timed_out);
    // Time and correctness of a time-out may be missing.
    raw.correct = !(raw.timed_out && missing(field(correct))) && truth(correct);
    raw.response_time =
        raw.timed_out && missing(field(response_time)) ? kNoTime : time(response_time);
    raw.practice = truth(practice);
    raw.simulated = truth(simulated);
    std::optional<bool> driven;
    if (at_[torque_driven] != kAbsent && !missing(field(torque_driven)))
      driven = truth(torque_driven);
    raw.line = reader.line();
    if (!ok_ || too_many_) return;
    names_.number(raw.participant);
    renderers_.number(raw.renderer);
    stimuli_.number(raw.shape);
    if (!raw.response.empty()) stimuli_.number(raw.response);
    if (!within_limits()) return;
    if (at_[protocol_sha256] != kAbsent) remember(field(protocol_sha256), protocols_);
    if (at_[program_version] != kAbsent) remember(field(program_version), versions_);
    if (faults_.count() == 0) builder_.add(raw);
    if (!raw.practice) torque_.add(raw.renderer, driven);
  }

  /// Whether the numbers of names are within the limits; exceeding them is one fault, after which
  /// rows are ignored.
  bool within_limits() {
    const std::size_t participants = names_.names().size(), renderers = renderers_.names().size(),
                      stimuli = stimuli_.names().size();
    if (participants > kMaxParticipants || stimuli > kMaxStimuli) {
      fault(participants > kMaxParticipants ? participant_id : shape,
            "at most 10000 different participants and 200 different stimuli");
    } else if (renderers > kMaxRenderers) {
      fault(renderer, "at most 20 different renderers");
    } else if (participants * renderers * stimuli > kMaxCells) {
      fault(participant_id, "at most 4000000 cells (participants x renderers x stimuli)");
    } else {
      return true;
    }
    too_many_ = true;
    return false;
  }

  /// Values of provenance are displayed only: made printable, at most eight are kept.
  static void remember(std::string_view text, std::vector<std::string>& known) {
    if (text.empty() || (!known.empty() && known.back() == text)) return;
    const std::string shown = stimuli::printable(text, 80);
    if (known.size() < 8 && std::find(known.begin(), known.end(), shown) == known.end()) {
      known.push_back(shown);
    }
  }

  TrialTable finish() {
    Provenance provenance;
    provenance.source = path_;
    provenance.protocol_sha256 = protocols_;
    provenance.program_versions = versions_;
    try {
      TrialTable table = builder_.finish(std::move(provenance));
      table.warnings.insert(table.warnings.begin(), warnings_.begin(), warnings_.end());
      torque_.warn(table.warnings);
      return table;
    } catch (const std::runtime_error& error) {
      faults_.add("file", error.what());
    }
    faults_.throw_if_any();
    return {};
  }

  std::string path_;
  Faults faults_;
  const CsvReader* reader_ = nullptr;
  const std::vector<std::string_view>* fields_ = nullptr;
  std::array<std::size_t, n_columns> at_{};
  std::size_t n_fields_ = 0, n_rows_ = 0;
  bool ok_ = true, too_many_ = false;
  /// Names of valid rows, practice included: each is checked once.
  Interner names_, renderers_, stimuli_;
  std::vector<std::string> protocols_, versions_, warnings_;
  TrialTableBuilder builder_;
  TorqueCounts torque_;
};

}  // namespace

TrialTable read_trials_csv(const std::string& path) { return CsvTrials(path).read(); }

}  // namespace palpate::analysis
