#include "analysis/input/trials.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "analysis/input/csv_reader.h"
#include "analysis/input/study_record.h"
#include "analysis/text.h"
#include "data/base/words.h"
#include "data/files/text_sink.h"
#include "data/store/store.h"
#include "data/store/task_text.h"
#include "data/stored_protocol.h"
#include "protocols/parse.h"

namespace palpate::analysis {
namespace {

/// Response time of a time-out with an unknown limit.
constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<std::string_view, 4> kShapes{"sphere", "cone", "cylinder", "cube"};

/// Rank of a shape among the levels: those of Ho, Basdogan & Srinivasan (2000) first, then in the
/// order of the protocol.
std::size_t rank(const std::string& name, const std::vector<std::string>& listed) {
  const auto known = std::find(kShapes.begin(), kShapes.end(), name);
  if (known != kShapes.end()) return static_cast<std::size_t>(known - kShapes.begin());
  const auto found = std::find(listed.begin(), listed.end(), name);
  return kShapes.size() + static_cast<std::size_t>(found - listed.begin());
}

/// Point first, then ray, then all others.
std::size_t renderer_rank(const std::string& name) {
  return name == "point" ? 0 : name == "ray" ? 1 : 2;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Without spaces at the ends, capitals and leading zeros of numbers.
std::string plain_name(std::string_view name) {
  while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
  while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
  std::string plain;
  bool in_number = false;  // past its leading zeros
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (c == '0' && !in_number && i + 1 < name.size() && is_digit(name[i + 1])) continue;
    in_number = is_digit(c);
    plain += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return plain;
}

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

constexpr std::size_t kMaxName = 200;     // bytes; participant codes of palpate have at most 32
constexpr std::size_t kMaxStimuli = 200;  // squared in the confusion matrix
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
  /// \param stimuli  names that are answers although they look like missing values
  CsvTrials(const std::string& path, const std::vector<std::string>& wanted,
            const std::set<std::string>& stimuli = {})
      : path_(path), wanted_(wanted), faults_(path) {
    for (const std::string& name : stimuli) stimuli_.number(name);
  }

  /// Stimuli such as "NA" that were answers in rows before the first that showed them.
  std::set<std::string> misread_answers() const {
    std::set<std::string> names;
    for (const std::string& name : not_answers_) {
      if (stimuli_.contains(name)) names.insert(name);
    }
    return names;
  }

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
    known.emplace_back("task");  // marks a table of tasks
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
    if (!wanted_.empty() && at_[protocol_sha256] == kAbsent)
      faults_.add(line(reader), "expected a column 'protocol_sha256', as --protocol is given");
  }

  std::string_view field(Column column) const { return (*fields_)[at_[column]]; }

  void fault(Column column, std::string_view expected) {
    ok_ = false;
    // Format listed faults only: a file may have millions of bad rows.
    if (faults_.count() >= kMaxFaults) return faults_.add({}, {});
    faults_.add(
        line(*reader_) + ", column " + std::string(kColumns[column]),
        "expected " + std::string(expected) + "; found '" + printable(field(column), 40) + "'");
  }

  /// A name, without the apostrophe that guards exports against spreadsheet formulas.
  std::string_view name(Column column, const Interner& known) {
    const std::string_view text = data::unguarded(field(column));
    if (known.contains(text)) return text;
    if (text.empty() || text.size() > kMaxName || !is_plain_utf8(text)) {
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

  bool truth(Column column) {
    if (at_[column] == kAbsent) return false;
    const std::optional<bool> value = truth_of(field(column));
    if (!value) fault(column, "0 or 1 (or TRUE, FALSE)");
    return value.value_or(false);
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
    const auto is_shown = [&](const std::string& one) {
      return is_protocol(one, "", field(protocol_sha256));
    };
    if (!wanted_.empty() && std::ranges::none_of(wanted_, is_shown)) return;
    ok_ = true;
    StudyTrial& raw = row_;
    raw.participant = name(participant_id, names_);
    raw.session = number(session);
    raw.block = number(block);
    raw.trial = number(trial);
    raw.renderer = name(renderer, renderers_);
    raw.shape = name(shape, stimuli_);
    const std::string_view answer = field(response);
    raw.response.clear();
    if (!is_missing(answer) || answer == field(shape) || stimuli_.contains(answer))
      raw.response = name(response, stimuli_);
    else if (!answer.empty())
      not_answers_.emplace(answer);
    raw.timed_out = at_[timed_out] == kAbsent ? raw.response.empty() : truth(timed_out);
    // Time and correctness of a time-out may be missing.
    raw.correct = !(raw.timed_out && is_missing(field(correct))) && truth(correct);
    raw.response_time.reset();
    if (!raw.timed_out || !is_missing(field(response_time)))
      raw.response_time = time(response_time);
    raw.practice = truth(practice);
    raw.simulated = truth(simulated);
    std::optional<bool> driven;
    if (at_[torque_driven] != kAbsent && !is_missing(field(torque_driven)))
      driven = truth(torque_driven);
    raw.line = reader.line();
    if (!ok_ || too_many_) return;
    names_.number(raw.participant);
    renderers_.number(raw.renderer);
    stimuli_.number(raw.shape);
    if (!raw.response.empty()) stimuli_.number(raw.response);
    if (!within_limits()) return;
    if (at_[protocol_sha256] != kAbsent) raw.protocol_sha256 = field(protocol_sha256);
    if (at_[protocol_sha256] != kAbsent) note_shown(field(protocol_sha256), protocols_);
    if (at_[program_version] != kAbsent) note_shown(field(program_version), versions_);
    if (faults_.count() == 0) builder_.add(raw);
    if (!raw.practice) torque_.add(raw.renderer, driven);
  }

  /// Whether the numbers of names are within the limits. Exceeding them is a single fault; later
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
      faults_.add("file", protocols_.empty() && !wanted_.empty()
                              ? "expected trials of the protocol " + printable(wanted_.front()) +
                                    "; a table has the checksums of protocols, not their names"
                              : error.what());
    }
    faults_.throw_if_any();
    return {};
  }

  std::string path_;
  std::vector<std::string> wanted_;  ///< protocols; empty: all
  Faults faults_;
  const CsvReader* reader_ = nullptr;
  const std::vector<std::string_view>* fields_ = nullptr;
  StudyTrial row_;  ///< under way: its texts keep their memory
  std::array<std::size_t, n_columns> at_{};
  std::size_t n_fields_ = 0, n_rows_ = 0;
  bool ok_ = true, too_many_ = false;
  /// Names in valid rows, practice included; each is checked once.
  Interner names_, renderers_, stimuli_;
  std::vector<std::string> protocols_, versions_, warnings_;
  std::set<std::string> not_answers_;  ///< texts of answers that were read as missing
  TrialTableBuilder builder_;
  TorqueCounts torque_;
};

}  // namespace

std::vector<RendererPair> renderer_pairs(const std::vector<std::string>& renderers) {
  if (renderers.empty()) return {};
  const std::string& first = renderers.front();
  if (renderers.size() == 1) {
    if (first == "ray") return {{"point", "ray", std::nullopt, 0}};
    return {{first, first == "point" ? "ray" : "another renderer", 0, std::nullopt}};
  }
  std::vector<RendererPair> pairs;
  pairs.reserve(renderers.size() - 1);
  for (std::size_t r = 1; r < renderers.size(); ++r) pairs.push_back({first, renderers[r], 0, r});
  return pairs;
}

std::string with_article(const std::string& renderer) {
  return renderer == "point" || renderer == "ray" ? "the " + renderer : renderer;
}

std::string difference_name(const RendererPair& pair) {
  return pair.renderer + " − " + pair.reference;
}

bool is_missing(std::string_view text) {
  constexpr std::array<std::string_view, 6> kNothing{"", "NA", "n/a", "N/A", "NaN", "nan"};
  return std::ranges::find(kNothing, text) != kNothing.end();
}

std::optional<bool> truth_of(std::string_view text) {
  if (text == "1" || text == "TRUE" || text == "True" || text == "true") return true;
  if (text == "0" || text == "FALSE" || text == "False" || text == "false") return false;
  return std::nullopt;
}

void warn_of_alike(const std::string& what, const std::deque<std::string>& names,
                   std::vector<std::string>& warnings) {
  constexpr std::size_t kMostGroups = 10;
  std::map<std::string, std::vector<std::string>> alike;
  for (const std::string& name : names) alike[plain_name(name)].push_back(name);
  std::size_t groups = 0;
  for (const auto& [plain, group] : alike) {
    if (group.size() < 2 || ++groups > kMostGroups) continue;
    std::string text;
    for (std::size_t i = 0; i < group.size(); ++i) {
      text += (i == 0                  ? " '"
               : i + 1 == group.size() ? " and '"
                                       : ", '") +
              printable(group[i], 40) + "'";
    }
    warnings.push_back(what + text +
                       " look alike; they count as different. Write one name in one way.");
  }
}

void note_once(const std::string& value, std::vector<std::string>& known) {
  if (!value.empty() && std::ranges::find(known, value) == known.end()) known.push_back(value);
}

void note_shown(std::string_view value, std::vector<std::string>& known) {
  constexpr std::size_t kMostShown = 8, kLongest = 80;
  if (!known.empty() && known.back() == value) return;  // as in most rows
  if (known.size() < kMostShown) note_once(printable(value, kLongest), known);
}

std::uint32_t Interner::number(std::string_view name) {
  if (!names_.empty() && names_[last_] == name) return last_;
  const auto found = numbers_.find(name);
  if (found != numbers_.end()) return last_ = found->second;
  last_ = static_cast<std::uint32_t>(names_.size());
  numbers_.emplace(names_.emplace_back(name), last_);
  return last_;
}

void TrialTableBuilder::add(const StudyTrial& trial) {
  if (trial.practice) {
    ++n_practice_;
    return;
  }
  const bool correct = trial.correct.value_or(false);
  TrialRow row;
  row.participant = participants_.number(trial.participant);
  row.renderer = static_cast<std::uint16_t>(renderers_.number(trial.renderer));
  row.shape = static_cast<std::uint16_t>(stimuli_.number(trial.shape));
  if (!trial.response.empty())
    row.answer = static_cast<std::int32_t>(stimuli_.number(trial.response));
  row.timed_out = trial.timed_out;
  row.correct = correct && !trial.timed_out;
  row.response_time = trial.response_time.value_or(kNoTime);
  shown_.resize(stimuli_.names().size());
  if (shown_[row.shape] == 0) shown_[row.shape] = ++n_shown_;
  n_simulated_ += trial.simulated;
  n_contradicting_ += trial.task == data::TaskRecord().task && !trial.timed_out &&
                      correct != (trial.response == trial.shape);
  n_late_answers_ += trial.timed_out && (correct || !trial.response.empty());
  keys_.push_back({row.participant, trial.session, trial.block, trial.trial,
                   protocols_.number(trial.protocol_sha256),
                   static_cast<std::uint32_t>(rows_.size())});
  rows_.push_back(row);
  if (trial.line > 0) lines_.push_back(static_cast<std::uint32_t>(trial.line));
}

void TrialTableBuilder::number_trials() {
  std::sort(keys_.begin(), keys_.end());
  std::uint32_t position = 0;
  std::vector<std::uint32_t> exposures(renderers_.names().size());
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (i == 0 || keys_[i].participant != keys_[i - 1].participant) {
      position = 0;
      std::fill(exposures.begin(), exposures.end(), 0U);
    }
    TrialRow& row = rows_[keys_[i].row];
    row.position = ++position;
    row.exposure = ++exposures[row.renderer];
  }
}

std::string TrialTableBuilder::lines_of(
    const std::vector<std::pair<std::uint32_t, std::uint32_t>>& rows) const {
  constexpr std::size_t kShown = 10;
  if (lines_.size() != rows_.size()) return "";
  std::string text;
  for (std::size_t i = 0; i < std::min(rows.size(), kShown); ++i) {
    text += (i == 0 ? " (lines " : ", ") + std::to_string(lines_[rows[i].first]) + " and " +
            std::to_string(lines_[rows[i].second]);
  }
  if (rows.size() > kShown) text += ", and " + std::to_string(rows.size() - kShown) + " more";
  return text + ")";
}

void TrialTableBuilder::check_repeated_trials(TrialTable& table) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> repeated, identical;
  const auto same_time = [](double x, double y) {
    return x == y || (std::isnan(x) && std::isnan(y));
  };
  for (std::size_t i = 1; i < keys_.size(); ++i) {
    const TrialKey &a = keys_[i - 1], &b = keys_[i];
    if (a.participant != b.participant || a.session != b.session || a.block != b.block ||
        a.trial != b.trial || a.protocol != b.protocol) {
      continue;
    }
    repeated.emplace_back(a.row, b.row);
    const TrialRow &x = rows_[a.row], &y = rows_[b.row];
    if (x.renderer == y.renderer && x.shape == y.shape && x.answer == y.answer &&
        same_time(x.response_time, y.response_time)) {
      identical.emplace_back(a.row, b.row);
    }
  }
  if (!identical.empty()) {
    throw std::runtime_error(
        counted(identical.size(), "row appears", "rows appear") + " twice" + lines_of(identical) +
        ": the same participant, session, block, trial, answer and time; expected each trial once");
  }
  if (!repeated.empty()) {
    table.warnings.push_back(counted(repeated.size(), "row repeats", "rows repeat") +
                             " the participant, session, block and trial of another row" +
                             lines_of(repeated) + ".");
  }
}

void TrialTableBuilder::fill_times(TrialTable& table) {
  std::size_t unknown = 0;
  double limit = 0, longest = 0;
  for (const TrialRow& row : rows_) {
    if (std::isnan(row.response_time)) {
      ++unknown;
    } else {
      longest = std::max(longest, row.response_time);
      if (row.timed_out) limit = std::max(limit, row.response_time);
    }
  }
  if (unknown == 0) return;
  if (!(longest > 0)) throw std::runtime_error("expected the time of one trial at least, above 0");
  const double taken = limit > 0 ? limit : longest;
  for (TrialRow& row : rows_) {
    if (std::isnan(row.response_time)) row.response_time = taken;
  }
  table.warnings.push_back(counted(unknown, "time-out has", "time-outs have") +
                           " no time; their limit was assumed to be " + fixed(taken, 3) +
                           " s, the " +
                           (limit > 0 ? "longest of the other time-outs."
                                      : "longest time of all trials, a lower bound."));
}

TrialTable TrialTableBuilder::finish(Provenance provenance,
                                     const std::vector<std::string>& listed) {
  if (rows_.empty()) throw std::runtime_error("expected at least one trial that is not practice");
  TrialTable table;
  number_trials();
  check_repeated_trials(table);
  fill_times(table);
  table.provenance = std::move(provenance);
  table.participants.assign(participants_.names().begin(), participants_.names().end());
  table.n_practice = n_practice_;
  table.simulated = n_simulated_ == 0              ? Simulated::no
                    : n_simulated_ == rows_.size() ? Simulated::yes
                                                   : Simulated::mixed;

  // Orders the levels: order[new index] = old index, new_index[old index] = new index.
  const auto& names = stimuli_.names();
  std::vector<std::uint32_t> order(names.size()), new_index(names.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto level = [&](std::uint32_t i) {
    return std::tuple(shown_[i] == 0, rank(names[i], listed), shown_[i], i);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return level(a) < level(b); });
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    new_index[order[i]] = i;
    table.answers.push_back(names[order[i]]);
    if (shown_[order[i]] > 0) table.shapes.push_back(names[order[i]]);
  }
  std::vector<std::uint32_t> renderers(renderers_.names().size()),
      new_renderer_index(renderers.size());
  std::iota(renderers.begin(), renderers.end(), 0U);
  std::ranges::stable_sort(renderers, {},
                           [&](std::uint32_t i) { return renderer_rank(renderers_.names()[i]); });
  for (std::uint32_t i = 0; i < renderers.size(); ++i) {
    new_renderer_index[renderers[i]] = i;
    table.renderers.push_back(renderers_.names()[renderers[i]]);
  }
  for (TrialRow& row : rows_) {
    row.shape = static_cast<std::uint16_t>(new_index[row.shape]);
    if (row.answer >= 0) {
      row.answer = static_cast<std::int32_t>(new_index[static_cast<std::size_t>(row.answer)]);
    }
    row.renderer = static_cast<std::uint16_t>(new_renderer_index[row.renderer]);
  }
  table.rows = std::move(rows_);

  warn_of_alike("Participants", participants_.names(), table.warnings);
  warn_of_alike("Renderers", renderers_.names(), table.warnings);
  warn_of_alike("Stimuli and answers", stimuli_.names(), table.warnings);
  if (n_contradicting_ > 0) {
    table.warnings.push_back("In " + counted(n_contradicting_, "row", "rows") +
                             " `correct` contradicts shape and response; `correct` was used.");
  }
  if (n_late_answers_ > 0) {
    table.warnings.push_back(counted(n_late_answers_, "time-out has", "time-outs have") +
                             " an answer or is marked correct; time-outs count as wrong.");
  }
  return table;
}

TrialTable read_trials_csv(const std::string& path, const std::vector<std::string>& protocols) {
  CsvTrials trials(path, protocols);
  TrialTable table = trials.read();
  const std::set<std::string> misread = trials.misread_answers();
  return misread.empty() ? std::move(table) : CsvTrials(path, protocols, misread).read();
}

TrialTable read_trials_csv(const std::string& path, const std::string& protocol) {
  return read_trials_csv(
      path, protocol.empty() ? std::vector<std::string>() : std::vector<std::string>{protocol});
}

void order_shapes(TrialTable& table, const std::vector<std::string>& order) {
  if (!std::ranges::is_permutation(order, table.shapes)) return;
  std::vector<std::size_t> place(table.shapes.size());
  for (std::size_t i = 0; i < place.size(); ++i) {
    place[i] = static_cast<std::size_t>(std::ranges::find(order, table.shapes[i]) - order.begin());
  }
  for (TrialRow& row : table.rows) {
    row.shape = static_cast<std::uint16_t>(place[row.shape]);
    if (row.answer >= 0 && static_cast<std::size_t>(row.answer) < place.size())
      row.answer = static_cast<std::int32_t>(place[static_cast<std::size_t>(row.answer)]);
  }
  table.shapes = order;
  std::ranges::copy(order, table.answers.begin());
}

std::string pooled_protocols(const Provenance& provenance) {
  constexpr std::size_t kDigits = 12;
  std::string names = provenance.protocol_name;
  if (names.empty()) {
    for (const std::string& sha256 : provenance.protocol_sha256)
      names += (names.empty() ? "" : ", ") + sha256.substr(0, kDigits);
  }
  return "Trials of " + std::to_string(provenance.protocol_sha256.size()) +
         " different protocols (" + names + ") are pooled; --protocol chooses one.";
}

bool is_protocol(std::string_view wanted, std::string_view name, std::string_view sha256) {
  constexpr std::size_t kDigits = 6;
  return wanted.empty() || wanted == name ||
         (wanted.size() >= kDigits && sha256.starts_with(wanted));
}

TrialTable read_trials_store(data::Store& store, const std::string& protocol) {
  const std::string& path = store.path();
  Provenance provenance;
  provenance.source = path;
  std::vector<std::string> stimuli, protocol_names, observers;
  for (const data::ProtocolInfo& one : store.protocols()) {
    if (!is_protocol(protocol, one.name, one.sha256)) continue;
    for (const std::string& name : data::read_stored_protocol(one.text).stimuli)
      note_once(name, stimuli);
  }
  TrialTableBuilder builder;
  const data::TorqueNotes notes(store);
  TorqueCounts torque;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (!is_protocol(protocol, trial.protocol_name, trial.protocol_sha256)) return;
    const data::TrialRecord& record = trial.record;
    if (record.renderer != "point" && record.renderer != "ray") {
      throw protocols::InputError({{path, "participant " + trial.participant.code,
                                    "expected the renderer 'point' or 'ray'; found '" +
                                        printable(record.renderer, 40) + "'"}});
    }
    StudyTrial one = study_trial_of(trial.participant.code, record);
    one.correct = record.correct;
    one.practice = record.practice;
    one.simulated = trial.participant.simulated;
    one.protocol_sha256 = trial.protocol_sha256;
    builder.add(one);
    if (!record.practice) torque.add(record.renderer, notes.driven(trial));
    note_once(trial.protocol_name, protocol_names);
    note_once(trial.protocol_sha256, provenance.protocol_sha256);
    note_once(trial.run.program_version, provenance.program_versions);
    note_once(trial.run.observer_sha256, observers);
  });
  provenance.protocol_name = listed(protocol_names);
  provenance.observer_sha256 = listed(observers);
  try {
    TrialTable table = builder.finish(std::move(provenance), stimuli);
    torque.warn(table.warnings);
    return table;
  } catch (const std::runtime_error& error) {
    std::string fault = error.what();
    if (protocol_names.empty() && !protocol.empty())
      fault += " of the protocol " + printable(protocol);
    throw protocols::InputError({{path, "trials", fault}});
  }
}

}  // namespace palpate::analysis
