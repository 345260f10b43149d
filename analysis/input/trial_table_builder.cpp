#include "analysis/input/trial_table_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::array<std::string_view, 4> kShapes{"sphere", "cone", "cylinder", "cube"};

/// Rank of a shape among the levels: those of Ho, Basdogan & Srinivasan (2000), then as the
/// protocol lists them.
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

}  // namespace

std::uint32_t Interner::number(std::string_view name) {
  if (!names_.empty() && names_[last_] == name) return last_;
  const auto found = numbers_.find(name);
  if (found != numbers_.end()) return last_ = found->second;
  last_ = static_cast<std::uint32_t>(names_.size());
  numbers_.emplace(names_.emplace_back(name), last_);
  return last_;
}

void TrialTableBuilder::add(const RawTrial& raw) {
  if (raw.practice) {
    ++n_practice_;
    return;
  }
  TrialRow row;
  row.participant = participants_.number(raw.participant);
  row.renderer = static_cast<std::uint16_t>(renderers_.number(raw.renderer));
  row.shape = static_cast<std::uint16_t>(stimuli_.number(raw.shape));
  if (!raw.response.empty()) row.answer = static_cast<std::int32_t>(stimuli_.number(raw.response));
  row.timed_out = raw.timed_out;
  row.correct = raw.correct && !raw.timed_out;
  row.response_time = raw.response_time;
  shown_.resize(stimuli_.names().size());
  if (shown_[row.shape] == 0) shown_[row.shape] = ++n_shown_;
  n_simulated_ += raw.simulated;
  n_contradicting_ += raw.correct != (raw.response == raw.shape) && !raw.timed_out;
  n_late_answers_ += raw.timed_out && (raw.correct || !raw.response.empty());
  keys_.push_back({row.participant, raw.session, raw.block, raw.trial,
                   static_cast<std::uint32_t>(rows_.size())});
  rows_.push_back(row);
  if (raw.line > 0) lines_.push_back(static_cast<std::uint32_t>(raw.line));
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
        a.trial != b.trial) {
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

}  // namespace palpate::analysis
