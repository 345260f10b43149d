#include "runner/session/replay.h"

#include <array>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "data/base/text.h"
#include "data/store/store.h"
#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/session/recorded_trial.h"
#include "runner/session/replay_comparison.h"

namespace palpate::runner::commands {

namespace {

using Json = nlohmann::ordered_json;

template <class... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string in_words(const session::ForceSummary& shown, const char* how) {
  const std::string first =
      shown.first_contact ? formatted("%.3f s", *shown.first_contact) : "never";
  return formatted(
      "  %-5s (%s): first contact %s, in contact %.1f %% of the time, force rms %.3f N, "
      "at most %.3f N, %.2f mm deep\n",
      shown.renderer.c_str(), how, first.c_str(), 100 * shown.time_in_contact, shown.rms_force,
      shown.max_force, 1e3 * shown.max_depth);
}

std::string verdict(const session::RecordedTrial& trial, const session::ReplayComparison& found) {
  const std::size_t ticks = found.ticks.size();
  if (found.equal_ticks == ticks)
    return "Rendered again: all " + std::to_string(ticks) +
           " ticks equal the record, bit by bit.\n";
  std::string text =
      "Rendered again: " + std::to_string(ticks - found.equal_ticks) + " of " +
      std::to_string(ticks) + " ticks differ from the record, the first is tick " +
      std::to_string(found.first_difference.value_or(0)) +
      (found.intervals.size() > 1 ? " of interval " + std::to_string(found.differing_interval)
                                  : "") +
      ". Recorded with palpate " + printable(trial.stored.run.program_version) +
      ", replayed with " PALPATE_VERSION ".\n";
  if (!found.periods_known)
    text += "The record does not hold the ticks' periods, on which damping depends.\n";
  return text;
}

Json to_json(const session::ForceSummary& shown) {
  return {{"renderer", shown.renderer},
          {"share_in_contact", shown.time_in_contact},
          {"first_contact_s", shown.first_contact ? Json(*shown.first_contact) : Json()},
          {"rms_force_n", shown.rms_force},
          {"max_force_n", shown.max_force},
          {"max_depth_m", shown.max_depth}};
}

void put(std::string& row, double value) {
  row += formatted(",%.17g", value == 0 ? 0.0 : value);  // no minus before a zero
}

template <class Vector>
void put_vector(std::string& row, const Vector& v) {
  for (int i = 0; i < 3; ++i) put(row, v[i]);
}

void put(std::string& row, const session::RenderedForce& shown) {
  put_vector(row, shown.force);
  put_vector(row, shown.torque);
  put(row, shown.depth);
}

/// Empty cells in an interval without a moving object.
void put(std::string& row, const std::optional<data::BodyRecord>& body) {
  if (!body) {
    row += std::string(13, ',');
    return;
  }
  put_vector(row, body->centre);
  for (const double q : body->orientation_wxyz) put(row, q);
  put_vector(row, body->velocity);
  put_vector(row, body->spin);
}

/// A line for each interval of a trial of version 2.
std::string intervals_text(const session::ReplayComparison& found) {
  std::string text;
  for (std::size_t i = 0; i < found.intervals.size(); ++i) {
    const session::ReplayedInterval& one = found.intervals[i];
    text += "  interval " + std::to_string(i + 1) + ": " +
            (one.stimulus.empty() ? "nothing" : printable(one.stimulus)) + ", " +
            printable(one.renderer) + (one.level ? formatted(", level %.12g", *one.level) : "") +
            (one.standard ? ", standard" : "") +
            formatted(": %zu of %zu ticks equal\n", one.equal_ticks, one.ticks);
  }
  return text;
}

Json intervals_json(const session::ReplayComparison& found) {
  Json all = Json::array();
  for (const session::ReplayedInterval& one : found.intervals)
    all.push_back({{"stimulus", one.stimulus.empty() ? Json() : Json(one.stimulus)},
                   {"renderer", one.renderer},
                   {"level", one.level ? Json(*one.level) : Json()},
                   {"standard", one.standard},
                   {"ticks", one.ticks},
                   {"equal_ticks", one.equal_ticks}});
  return all;
}

std::string csv_header(bool with_other, bool with_intervals, bool with_body) {
  std::string header = with_intervals ? "interval,tick,t" : "tick,t";
  const auto add = [&header](const std::string& vector) {
    for (const char* axis : {"_x", "_y", "_z"}) header += "," + vector + axis;
  };
  for (const char* vector : {"tip", "tail", "recorded_force", "recorded_torque"}) add(vector);
  header += ",recorded_depth";
  for (const std::string whose : {"again", "other"}) {
    if (whose == "other" && !with_other) break;
    add(whose + "_force");
    add(whose + "_torque");
    header += "," + whose + "_depth";
  }
  if (with_body) {
    for (const char* column :
         {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"})
      header += std::string(",recorded_body_") + column;
  }
  return header + "\n";
}

/// \param name  "P03/1/12", as the trial was named
std::string to_text(const std::string& name, const session::RecordedTrial& trial,
                    const session::ReplayComparison& found) {
  const data::TrialRecord& record = trial.stored.record;
  std::string text = trial.stored.participant.simulated ? "SIMULATED " : "";
  text += "trial " + printable(name) + " of " + printable(trial.stored.protocol_name) + ": " +
          printable(record.shape) + ", " + printable(record.renderer) + ", " +
          (record.timed_out ? "no answer" : "answered " + printable(record.response)) +
          formatted(" after %.3f s", record.response_time) + "\n";
  if (trial.limited)
    text += "With the materials as they were limited to what the device can show.\n";
  text += verdict(trial, found);
  if (!record.task.intervals.empty()) text += intervals_text(found);
  text += in_words(found.recorded, "recorded");
  if (found.other) {
    text += in_words(*found.other, "same way") +
            formatted("  their forces differ by %.3f N rms, at most %.3f N\n", found.rms_difference,
                      found.max_difference);
  }
  return text;
}

std::string to_json_text(const std::string& name, const session::RecordedTrial& trial,
                         const session::ReplayComparison& found) {
  Json result = {{"version", 1},
                 {"trial", name},
                 {"protocol", trial.stored.protocol_name},
                 {"simulated", trial.stored.participant.simulated},
                 {"recorded_with", trial.stored.run.program_version},
                 {"replayed_with", PALPATE_VERSION},
                 {"ticks", found.ticks.size()},
                 {"equal_ticks", found.equal_ticks},
                 {"periods_on_record", found.periods_known},
                 {"material_limited", trial.limited},
                 {"recorded", to_json(found.recorded)}};
  if (!trial.stored.record.task.intervals.empty()) {
    result["task"] = trial.stored.record.task.task;
    result["intervals"] = intervals_json(found);
  }
  if (found.other) {
    result["other"] = to_json(*found.other);
    result["rms_difference_n"] = found.rms_difference;
    result["max_difference_n"] = found.max_difference;
  }
  return result.dump(1) + "\n";
}

/// A row for each tick: s, m, N, N m; the other renderer's columns if requested. For a trial of
/// version 2 `interval` comes first, and t counts within it.
std::string to_csv(const session::RecordedTrial& trial, const session::ReplayComparison& found) {
  const data::TrialRecord& record = trial.stored.record;
  const bool with_intervals = !record.task.intervals.empty();
  const bool with_body = !record.bodies.empty();
  std::string text = csv_header(found.other.has_value(), with_intervals, with_body);
  for (const session::ReplayedTick& tick : found.ticks) {
    const data::SampleRecord& was = *tick.recorded;
    if (with_intervals) text += std::to_string(tick.interval) + ",";
    text += std::to_string(was.tick);
    put(text, tick.time);
    for (const auto& v : {was.tip, was.tail, was.force, was.torque}) put_vector(text, v);
    put(text, was.depth);
    put(text, tick.again);
    if (found.other) put(text, tick.other);
    if (with_body) put(text, data::body_of(record, was));
    text += "\n";
  }
  return text;
}

}  // namespace

// `palpate replay`: runs a stored trial through the servo and its renderer again.

int replay_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate replay --db FILE --trial CODE/SESSION/TRIAL [--compare] [--out FILE.csv]";
  line.summary =
      "Renders a stored trial again, through the servo. In each interval of the trial the forces\n"
      "must equal the recorded ones, bit by bit. Needs servo samples (\"samples\": true in the\n"
      "protocol). Status 1 when a tick differs.";
  line.example =
      "  palpate replay --db study.db --trial P03/1/12\n"
      "  palpate replay --db study.db --trial P03/1/12 --compare --out both.csv   (and what the\n"
      "      other renderer would have shown on the same way, tick by tick)\n"
      "  palpate watch --db study.db --trial P03/1/12 --out trial.html   (a page that shows it)";
  std::string db, trial, protocol, out, json, folder;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("db", po::value(&db)->value_name("FILE")->required(), "the study's database; only read");
  add("trial", po::value(&trial)->value_name("CODE/SESSION/TRIAL")->required(), "the trial");
  add("protocol", po::value(&protocol)->value_name("NAME"),
      "the protocol, if the code is in several");
  add("meshes", po::value(&folder)->value_name("DIR"),
      "folder of the protocol's mesh files, for an old database that does not have them; default: "
      "the working directory");
  add("compare", "also show what the other renderer would have shown");
  add("out", po::value(&out)->value_name("FILE.csv"), "write every tick");
  add("json", po::value(&json)->value_name("FILE"), "write the figures as JSON");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  output::Outputs outputs(*values, {"out", "json"}, {"db"});
  const data::TrialName name = parse_trial_name(trial);
  data::Store store = data::Store::open(db, data::Store::Mode::read_only);
  const session::RecordedTrial recorded =
      session::load_recorded_trial(store, name, protocol, folder);
  for (const protocols::StimulusSpec& stimulus : recorded.protocol.stimuli)
    outputs.protect(stimulus.object);
  const session::ReplayComparison found = session::compare_with_record(
      recorded.protocol, recorded.stored.record, values->count("compare") > 0);
  if (outputs.wanted("out")) outputs.put("out", to_csv(recorded, found));
  if (outputs.wanted("json")) outputs.put("json", to_json_text(trial, recorded, found));
  outputs.write();
  std::cout << to_text(trial, recorded, found);
  return found.equal_ticks == found.ticks.size() ? 0 : 1;
}

}  // namespace palpate::runner::commands
