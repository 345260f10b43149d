#include "analysis/statistics/describe.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace palpate::analysis {

namespace {

std::optional<double> proportion(std::size_t part, std::size_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

bool used_for_times(const TrialRow& row, double too_fast) {
  return row.correct && row.answer >= 0 && row.response_time >= too_fast;
}

/// Usable response times by cell and participant (counting sort): those of c begin at
/// times[start[c]].
struct Buckets {
  std::vector<std::size_t> start;
  std::vector<double> times;
};

Buckets sort_times(const TrialTable& table, double too_fast) {
  const std::size_t n_shapes = table.shapes.size(), n_participants = table.participants.size();
  const auto cell = [&](const TrialRow& row) {
    return (row.renderer * n_shapes + row.shape) * n_participants + row.participant;
  };
  Buckets buckets;
  buckets.start.resize(table.renderers.size() * n_shapes * n_participants + 1);
  for (const TrialRow& row : table.rows) {
    if (used_for_times(row, too_fast)) ++buckets.start[cell(row) + 1];
  }
  std::partial_sum(buckets.start.begin(), buckets.start.end(), buckets.start.begin());
  buckets.times.resize(buckets.start.back());
  std::vector<std::size_t> next(buckets.start.begin(), buckets.start.end() - 1);
  for (const TrialRow& row : table.rows) {
    if (used_for_times(row, too_fast)) buckets.times[next[cell(row)]++] = row.response_time;
  }
  return buckets;
}

/// Replaces the times by their logs.
void describe_participant(std::vector<double>& times, ParticipantCell& cell) {
  cell.n_used = times.size();
  if (times.empty()) return;
  cell.mean = mean(times);
  cell.median = median(times);
  double logs = 0;
  for (double& time : times) logs += time = std::log(time);
  cell.mean_log = logs / static_cast<double>(times.size());
  for (const double log : times) {
    cell.sum_of_squares_log += (log - cell.mean_log) * (log - cell.mean_log);
  }
}

TimesCell describe_times(const std::vector<ParticipantCell>& participants) {
  TimesCell cell;
  std::vector<double> means, medians, logs;
  for (const ParticipantCell& participant : participants) {
    if (participant.n_used == 0) continue;
    cell.n_trials += participant.n_used;
    means.push_back(participant.mean);
    medians.push_back(participant.median);
    logs.push_back(participant.mean_log);
  }
  cell.n_participants = means.size();
  if (means.empty()) return cell;
  cell.mean_of_participant_means = mean(means);
  cell.sd_of_participant_means = standard_deviation(means);
  cell.mean_of_participant_medians = mean(medians);
  cell.mean_of_participant_mean_logs = mean(logs);
  cell.geomean_of_participant_geomeans = std::exp(*cell.mean_of_participant_mean_logs);
  cell.sd_of_participant_mean_logs = standard_deviation(logs);
  return cell;
}

void finish_accuracy(const std::vector<ParticipantCell>& participants, AccuracyCell& cell) {
  cell.accuracy = proportion(cell.n_correct, cell.n_trials);
  cell.accuracy_answered = proportion(cell.n_correct, cell.n_trials - cell.n_timeouts);
  std::vector<double> accuracies;
  for (const ParticipantCell& participant : participants) {
    if (const auto accuracy = proportion(participant.n_correct, participant.n_trials)) {
      accuracies.push_back(*accuracy);
    }
  }
  if (!accuracies.empty()) cell.mean_of_participant_accuracies = mean(accuracies);
}

}  // namespace

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::optional<double> standard_deviation(const std::vector<double>& values) {
  if (values.size() < 2) return std::nullopt;
  const double centre = mean(values);
  double squares = 0;
  for (const double value : values) squares += (value - centre) * (value - centre);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*std::max_element(values.begin(), middle) + *middle) / 2;
}

Description describe(const TrialTable& table, double too_fast) {
  const std::size_t n_renderers = table.renderers.size(), n_shapes = table.shapes.size(),
                    n_participants = table.participants.size(), n_answers = table.answers.size();
  Description out;
  out.accuracy.assign(n_renderers, std::vector<AccuracyCell>(n_shapes));
  out.times.assign(n_renderers, std::vector<TimesCell>(n_shapes));
  out.confusion.assign(n_renderers, std::vector<std::vector<std::size_t>>(
                                        n_shapes, std::vector<std::size_t>(n_answers + 1)));
  out.participant_cells.assign(n_renderers,
                               std::vector<std::vector<ParticipantCell>>(
                                   n_shapes, std::vector<ParticipantCell>(n_participants)));

  for (const TrialRow& row : table.rows) {
    AccuracyCell& cell = out.accuracy[row.renderer][row.shape];
    ParticipantCell& participant = out.participant_cells[row.renderer][row.shape][row.participant];
    const bool answered = row.answer >= 0 && !row.timed_out;
    const bool fast = answered && row.response_time < too_fast;
    ++cell.n_trials;
    ++participant.n_trials;
    cell.n_correct += row.correct;
    participant.n_correct += row.correct;
    cell.n_timeouts += row.timed_out;
    cell.n_too_fast += fast;
    cell.n_correct_too_fast += fast && row.correct;
    ++out.confusion[row.renderer][row.shape]
                   [answered ? static_cast<std::size_t>(row.answer) : n_answers];
  }

  const Buckets buckets = sort_times(table, too_fast);
  std::vector<double> times;
  std::size_t bucket = 0;
  for (std::size_t r = 0; r < n_renderers; ++r) {
    for (std::size_t s = 0; s < n_shapes; ++s) {
      for (std::size_t p = 0; p < n_participants; ++p, ++bucket) {
        const auto at = [&](std::size_t i) {
          return buckets.times.begin() + static_cast<std::ptrdiff_t>(buckets.start[i]);
        };
        times.assign(at(bucket), at(bucket + 1));
        describe_participant(times, out.participant_cells[r][s][p]);
      }
      AccuracyCell& cell = out.accuracy[r][s];
      finish_accuracy(out.participant_cells[r][s], cell);
      out.times[r][s] = describe_times(out.participant_cells[r][s]);
      out.counts.n_trials += cell.n_trials;
      out.counts.n_correct += cell.n_correct;
      out.counts.n_timeouts += cell.n_timeouts;
      out.counts.n_too_fast += cell.n_too_fast;
      out.counts.n_used_for_times += out.times[r][s].n_trials;
    }
  }
  out.counts.n_participants = n_participants;
  out.counts.accuracy = proportion(out.counts.n_correct, out.counts.n_trials);
  return out;
}

}  // namespace palpate::analysis
