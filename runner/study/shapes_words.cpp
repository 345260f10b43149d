// The study of shapes: a table of its own, and no columns of tasks.

#include <algorithm>
#include <array>
#include <cstddef>
#include <iomanip>
#include <sstream>

#include "data/base/text.h"
#include "data/base/words.h"
#include "runner/output/outputs.h"
#include "runner/study/duration.h"
#include "runner/study/schedule_text.h"
#include "runner/study/study_words.h"

namespace palpate::runner::study {
namespace {

using nlohmann::ordered_json;

std::string shapes_summary(const protocols::Protocol& protocol) {
  const std::vector<protocols::Trial> trials = protocols::schedule(protocol, 1);
  const long long counted = protocols::main_trials(protocol);
  const int sessions = protocol.sessions.count;
  std::vector<std::string> renderers, stimuli;
  for (const protocols::RendererKind kind : protocol.renderers)
    renderers.emplace_back(protocols::to_string(kind));
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) stimuli.push_back(stimulus.name);
  constexpr std::array kOrders = {"in this order", "counterbalanced", "interleaved"};
  const Duration duration = duration_of(protocol);
  const double trial = duration.usual / static_cast<double>(trials.size()) - protocol.home.rest;

  std::ostringstream out;
  out << protocol.name << (protocol.title.empty() ? "" : ": " + printable(protocol.title)) << "\n"
      << "  renderers   " << listed(renderers) << " ("
      << kOrders[static_cast<std::size_t>(protocol.renderer_order)] << ")\n"
      << "  stimuli     " << listed(stimuli) << "\n"
      << "  trials      " << counted << " for each participant ("
      << counted / static_cast<long long>(protocol.renderers.size()) << " with each renderer), "
      << trials.size() - static_cast<std::size_t>(counted) << " of practice and warm-up besides\n"
      << "  blocks      " << trials.back().block << ", in " << sessions
      << (sessions == 1 ? " session\n" : " sessions\n") << "  duration    about "
      << time_in_words(duration.usual) << " at " << trial << " s a trial, at most "
      << time_in_words(duration.longest) << "; breaks"
      << (protocol.practice.criterion ? " and further rounds of practice besides\n" : " besides\n")
      << heard_lines(protocol) << "  seed        " << protocol.seed << "\n"
      << "  sha256      " << protocol.sha256 << "\n";
  return out.str();
}

const std::string& shape_of(const protocols::Protocol& protocol, const protocols::Trial& trial) {
  return protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
}

std::string shapes_table(const protocols::Protocol& protocol,
                         const std::vector<protocols::Trial>& trials) {
  std::size_t width = 5;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    width = std::max(width, stimulus.name.size());
  const auto shape_width = static_cast<int>(width);
  std::ostringstream out;
  out << "session  block  trial  renderer  " << std::left << std::setw(shape_width) << "shape"
      << "  orientation (w x y z)\n";
  out << std::fixed << std::setprecision(3);
  for (const protocols::Trial& trial : trials) {
    const Quat& q = trial.orientation;
    out << std::right << std::setw(7) << trial.session << std::setw(7) << trial.block
        << std::setw(7) << trial.trial << "  " << std::left << std::setw(8)
        << protocols::to_string(trial.renderer) << "  " << std::setw(shape_width)
        << shape_of(protocol, trial) << std::right;
    for (const double part : {q.w, q.x, q.y, q.z}) out << std::setw(8) << part;
    out << (trial.practice ? "  practice\n" : "\n");
  }
  return out.str();
}

std::string shapes_csv(const protocols::Protocol& protocol, int participant,
                       const std::vector<protocols::Trial>& trials) {
  output::CsvText table(schedule_columns(), "\r\n");
  for (const protocols::Trial& trial : trials) put_scheduled(table, protocol, trial, participant);
  return table.text();
}

ordered_json shapes_rows(const protocols::Protocol& protocol,
                         const std::vector<protocols::Trial>& trials) {
  ordered_json rows = ordered_json::array();
  for (const protocols::Trial& trial : trials) {
    const Quat& q = trial.orientation;
    rows.push_back({{"session", trial.session},
                    {"block", trial.block},
                    {"trial", trial.trial},
                    {"renderer", protocols::to_string(trial.renderer)},
                    {"shape", shape_of(protocol, trial)},
                    {"orientation_wxyz", {q.w, q.x, q.y, q.z}},
                    {"practice", trial.practice}});
  }
  return rows;
}

}  // namespace

constexpr StudyWords kWordsOfShapes{shapes_summary, protocols::schedule, shapes_table, shapes_csv,
                                    shapes_rows};

}  // namespace palpate::runner::study
