#include "data/store/task_text.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "data/base/json_text.h"

namespace palpate::data {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
void put_if(Json& out, const char* key, const std::optional<T>& value) {
  if (value) out[key] = *value;
}

template <class T>
void take_if(const Json& in, const char* key, std::optional<T>& value) {
  if (in.contains(key)) value = in.at(key).get<T>();
}

Json interval_json(const IntervalRecord& interval) {
  Json out = {{"stimulus", interval.stimulus}, {"renderer", interval.renderer}};
  put_if(out, "level", interval.level);
  out["standard"] = interval.standard;
  out["onset_ns"] = interval.onset_ns;
  out["end_ns"] = interval.end_ns;
  return out;
}

IntervalRecord interval_of(const Json& in) {
  IntervalRecord interval;
  interval.stimulus = in.at("stimulus").get<std::string>();
  interval.renderer = in.at("renderer").get<std::string>();
  take_if(in, "level", interval.level);
  interval.standard = in.at("standard").get<bool>();
  interval.onset_ns = in.at("onset_ns").get<std::int64_t>();
  interval.end_ns = in.at("end_ns").get<std::int64_t>();
  return interval;
}

/// The names of a reach's measures, in text and columns.
template <class Record, class Visit>
void for_each_measure(Record& reach, Visit visit) {
  visit("duration", reach.duration);
  visit("peak_speed", reach.peak_speed);
  visit("deviation", reach.deviation);
  visit("largest_deviation", reach.largest_deviation);
  visit("path_ratio", reach.path_ratio);
  visit("endpoint_error", reach.endpoint_error);
  visit("side_force", reach.side_force);
  visit("adaptation", reach.adaptation);
}

/// Only the point renderer has no side; it gives force only.
bool gives_torque(const std::string& renderer) { return !renderer.empty() && renderer != "point"; }

}  // namespace

bool is_storable(const TaskRecord& task) {
  return task.of_block() || task.task == TaskRecord().task;
}

std::optional<std::string> task_text(const TaskRecord& task) {
  if (!task.of_block()) return std::nullopt;
  Json out = {{"task", task.task}, {"block_name", task.block_name}, {"track", task.track}};
  put_if(out, "level", task.level);
  put_if(out, "standard_level", task.standard_level);
  for (const auto& [name, value] : task.dimensions) out["levels"][name] = value;
  out["catch_trial"] = task.catch_trial;
  if (task.intervals.empty()) return out.dump();
  out["intervals"] = Json::array();
  for (const IntervalRecord& interval : task.intervals)
    out["intervals"].push_back(interval_json(interval));
  out["success"] = task.success;
  put_if(out, "number", task.number);
  put_if(out, "confidence", task.confidence);
  put_if(out, "confidence_ns", task.confidence_ns);
  if (task.reach) {
    Json& reach = out["reach"] = {{"kind", task.reach->kind}};
    for_each_measure(*task.reach,
                     [&](const char* key, const auto& value) { put_if(reach, key, value); });
  }
  if (task.seen) {
    out["seen"] = {{"frames", task.seen->frames},
                   {"dropped", task.seen->dropped},
                   {"lag_s", task.seen->lag},
                   {"lag_p99_s", task.seen->lag_p99}};
    if (task.seen->first_ns != 0) out["seen"]["first_ns"] = task.seen->first_ns;
    if (!task.seen->frames_sha256.empty()) out["seen"]["frames_sha256"] = task.seen->frames_sha256;
  }
  if (task.heard)
    out["heard"] = {{"knocks", task.heard->knocks},
                    {"lag_s", task.heard->lag},
                    {"first_ns", task.heard->first_ns}};
  return out.dump();
}

TaskRecord parse_task_text(const std::optional<std::string>& text) {
  if (!text) return {};
  try {
    const Json in = read_ordered_json(*text);
    TaskRecord task;
    task.task = in.at("task").get<std::string>();
    task.block_name = in.at("block_name").get<std::string>();
    if (!task.of_block()) throw std::invalid_argument("its task is damaged: it names no block");
    task.track = in.at("track").get<int>();
    take_if(in, "level", task.level);
    take_if(in, "standard_level", task.standard_level);
    if (in.contains("levels")) {
      for (const auto& [name, value] : in.at("levels").items())
        task.dimensions.emplace_back(name, value.get<double>());
    }
    task.catch_trial = in.at("catch_trial").get<bool>();
    if (!in.contains("intervals")) return task;
    for (const Json& interval : in.at("intervals")) task.intervals.push_back(interval_of(interval));
    task.success = in.at("success").get<bool>();
    take_if(in, "number", task.number);
    take_if(in, "confidence", task.confidence);
    take_if(in, "confidence_ns", task.confidence_ns);
    if (in.contains("seen")) {
      const Json& seen = in.at("seen");
      task.seen = {seen.at("frames").get<int>(),
                   seen.at("dropped").get<int>(),
                   seen.at("lag_s").get<double>(),
                   seen.at("lag_p99_s").get<double>(),
                   seen.value("first_ns", std::int64_t{0}),
                   seen.value("frames_sha256", "")};
    }
    if (in.contains("heard")) {
      const Json& heard = in.at("heard");
      task.heard = {heard.at("knocks").get<int>(), heard.at("lag_s").get<double>(),
                    heard.at("first_ns").get<std::int64_t>()};
    }
    if (!in.contains("reach")) return task;
    const Json& reach = in.at("reach");
    task.reach.emplace().kind = reach.at("kind").get<std::string>();
    for_each_measure(*task.reach,
                     [&](const char* key, auto& value) { take_if(reach, key, value); });
    return task;
  } catch (const JsonError& error) {
    throw std::invalid_argument(std::string("its task is damaged: ") + error.what());
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("its task is damaged: ") + error.what());
  }
}

TorqueNotes::TorqueNotes(Store& store) {
  for (const StoredNote& note : store.notes()) {
    if (note.text == kTorqueLeftOutNote)
      runs_.emplace(note.participant.id, note.session, note.run_clock.utc_ns,
                    note.run_clock.monotonic_ns);
  }
}

bool TorqueNotes::left_out(const Participant& participant, const RunInfo& run) const {
  return any() && runs_.contains(RunKey(participant.id, run.session, run.clock.utc_ns,
                                        run.clock.monotonic_ns));
}

std::optional<bool> TorqueNotes::driven(const StoredTrial& trial) const {
  const bool given =
      gives_torque(trial.record.renderer) ||
      std::ranges::any_of(trial.record.task.intervals, [](const IntervalRecord& interval) {
        return gives_torque(interval.renderer);
      });
  if (!given) return std::nullopt;
  return !left_out(trial.participant, trial.run);
}

}  // namespace palpate::data
