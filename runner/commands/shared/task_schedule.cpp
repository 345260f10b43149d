#include "runner/commands/shared/task_schedule.h"

#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "protocols/tasks/levels.h"
#include "runner/commands/shared/csv_text.h"
#include "runner/commands/shared/schedule_rows.h"
#include "runner/commands/shared/task_words.h"

namespace palpate::runner {
namespace {

struct ListedTrial {
  const protocols::Trial& trial;
  const protocols::TaskBlock& block;
  std::string stimulus, level;
  int comparison = 0;
  bool example = false;  ///< depends on answers
};

ListedTrial listed(const protocols::Protocol& protocol, const protocols::Trial& trial) {
  const auto& block = protocol.blocks[static_cast<std::size_t>(trial.task_block)];
  return {trial,
          block,
          protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name,
          trial.level ? protocols::level_text(*trial.level) : "",
          comparison_interval(block, trial),
          protocols::is_adaptive(block)};
}

std::string table_text(const protocols::Protocol& protocol,
                       const std::vector<protocols::Trial>& trials) {
  std::ostringstream out;
  int block = 0;
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed(protocol, trial);
    if (trial.block != block) {
      block = trial.block;
      out << (block > 1 ? "\n" : "") << "session " << trial.session << ", block " << block << ", "
          << row.block.name << "\n";
      for (const std::string& line : in_words(protocol, row.block)) out << "  " << line << "\n";
      if (row.example)
        out << "  answers choose the levels; with those of a participant whose threshold is in "
               "the middle:\n";
      out << "  trial  track  renderer  level         comparison  stimulus\n";
    }
    out << "  " << std::right << std::setw(5) << trial.trial << std::setw(7) << trial.track << "  "
        << std::left << std::setw(8) << protocols::to_string(trial.renderer) << "  "
        << std::setw(12) << (trial.catch_trial ? "catch" : row.level) << "  " << std::setw(10)
        << (row.comparison > 0 ? std::to_string(row.comparison) : "") << "  " << row.stimulus
        << "\n";
  }
  return out.str();
}

std::string csv_text(const protocols::Protocol& protocol, int participant,
                     const std::vector<protocols::Trial>& trials) {
  std::vector<std::string> columns = schedule_columns();
  for (const char* more :
       {"task", "block_name", "track", "level", "catch_trial", "comparison_interval", "example"})
    columns.emplace_back(more);
  CsvText table(columns, "\r\n");
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed(protocol, trial);
    const Quat& q = trial.orientation;
    table << participant << trial.session << trial.block << trial.trial
          << protocols::to_string(trial.renderer) << row.stimulus << q.w << q.x << q.y << q.z
          << trial.practice << protocol.sha256 << PALPATE_VERSION
          << protocols::to_string(row.block.task) << row.block.name << trial.track << row.level
          << trial.catch_trial << (row.comparison > 0 ? std::to_string(row.comparison) : "")
          << row.example;
    table.end_row();
  }
  return table.text();
}

std::string json_text(const protocols::Protocol& protocol, int participant,
                      const std::vector<protocols::Trial>& trials) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed(protocol, trial);
    const Quat& q = trial.orientation;
    nlohmann::ordered_json out = {{"session", trial.session},
                                  {"block", trial.block},
                                  {"trial", trial.trial},
                                  {"task", protocols::to_string(row.block.task)},
                                  {"block_name", row.block.name},
                                  {"track", trial.track},
                                  {"renderer", protocols::to_string(trial.renderer)},
                                  {"shape", row.stimulus},
                                  {"level", nullptr},
                                  {"catch_trial", trial.catch_trial},
                                  {"comparison_interval", nullptr},
                                  {"orientation_wxyz", {q.w, q.x, q.y, q.z}},
                                  {"practice", trial.practice},
                                  {"example", row.example}};
    if (trial.level) out["level"] = *trial.level;
    if (row.comparison > 0) out["comparison_interval"] = row.comparison;
    rows.push_back(std::move(out));
  }
  const nlohmann::ordered_json document = {{"protocol", protocol.name},
                                           {"protocol_sha256", protocol.sha256},
                                           {"program_version", PALPATE_VERSION},
                                           {"participant_number", participant},
                                           {"trials", rows}};
  return document.dump(1) + "\n";
}

}  // namespace

std::string task_schedule_text(const protocols::Protocol& protocol, int participant,
                               const std::string& format) {
  const std::vector<protocols::Trial> trials = example_trials(protocol, participant);
  if (format == "csv") return csv_text(protocol, participant, trials);
  if (format == "json") return json_text(protocol, participant, trials);
  return table_text(protocol, trials);
}

}  // namespace palpate::runner
