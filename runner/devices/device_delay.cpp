#include "runner/devices/device_delay.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/files/atomic_file.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"

namespace palpate::runner::devices {
namespace {

using nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr std::size_t kMostChains = 100;
constexpr double kMostTime = 1e9;  // ns; beyond a second no chain is usable

ordered_json to_json(const Percentiles& of) {
  return {{"median", of.median}, {"p99", of.p99}, {"p99.9", of.p999}, {"max", of.max}};
}

void read_percentiles(protocols::ObjectReader& root, const char* key, Percentiles& out) {
  const auto read = [&out](protocols::ObjectReader& object) {
    const auto number = [&object](const char* name, std::int64_t& value) {
      double found = 0;
      object.number(name, found, {0, kMostTime, "ns"}, protocols::Presence::required);
      value = std::llround(found);
    };
    number("median", out.median);
    number("p99", out.p99);
    number("p99.9", out.p999);
    number("max", out.max);
    if (out.median > out.p99 || out.p99 > out.p999 || out.p999 > out.max)
      object.faults().add(object.pointer(), "expected median, p99, p99.9 and max to ascend");
  };
  root.section(key, read, protocols::Presence::required);
}

void read_count(protocols::ObjectReader& root, const char* key, std::uint64_t& out) {
  double read = 0;
  root.number(key, read, {0, 1e15}, protocols::Presence::required);
  out = static_cast<std::uint64_t>(std::llround(read));
}

ChainTiming read_chain(protocols::ObjectReader& root, bool unsealed) {
  constexpr std::size_t kMostWord = 200;
  ChainTiming out;
  out.sealed = root.sealed();
  if (!out.sealed && !unsealed)
    root.faults().add(root.pointer("sha256"),
                      "missing, since an older version of palpate stored it; measure again with "
                      "palpate devices --timing --calibration");
  root.text("device", out.device, kMostWord);
  root.text("serial", out.serial, kMostWord);
  root.number("rate_hz", out.rate, {1, 1e5, "Hz"}, protocols::Presence::required);
  read_count(root, "ticks", out.ticks);
  read_count(root, "lost_readings", out.lost);
  read_count(root, "late_readings", out.late);
  read_count(root, "forces_not_sent_in_their_tick", out.unsent);
  read_percentiles(root, "reading_ns", out.reading);
  read_percentiles(root, "pose_age_ns", out.age);
  read_percentiles(root, "force_wait_ns", out.wait);
  read_percentiles(root, "delay_ns", out.delay);
  root.text("made_utc", out.made_utc);
  return out;
}

}  // namespace

ordered_json to_json(const ChainTiming& chain) {
  return {{"device", chain.device},
          {"serial", chain.serial},
          {"rate_hz", chain.rate},
          {"ticks", chain.ticks},
          {"lost_readings", chain.lost},
          {"late_readings", chain.late},
          {"forces_not_sent_in_their_tick", chain.unsent},
          {"reading_ns", to_json(chain.reading)},
          {"pose_age_ns", to_json(chain.age)},
          {"force_wait_ns", to_json(chain.wait)},
          {"delay_ns", to_json(chain.delay)},
          {"made_utc", chain.made_utc}};
}

servo::DeviceCapabilities with_delay(servo::DeviceCapabilities device, double delay, double rate) {
  const double half = 0.5 / rate, share = half / (half + delay);
  device.max_stiffness *= share;
  device.damping *= share;
  return device;
}

std::string chain_file(const std::string& calibration) {
  return std::filesystem::path(calibration).replace_extension(".timing.json").string();
}

std::vector<ChainTiming> parse_chains(const std::string& text, const std::string& path,
                                      bool unsealed) {
  protocols::FaultList faults(path);
  const nlohmann::json read = protocols::read_json(text, faults);
  protocols::ObjectReader root(read, "", faults);
  int version = 0;
  root.integer("version", version, {kVersion, kVersion}, protocols::Presence::required);
  std::vector<ChainTiming> out;
  if (const auto* list = root.array("chains", 0, kMostChains, protocols::Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      protocols::ObjectReader one((*list)[i], protocols::child_pointer("/chains", i), faults);
      out.push_back(read_chain(one, unsealed));
      one.refuse_unknown_keys();
    }
  }
  root.refuse_unknown_keys();
  faults.throw_if_any();
  return out;
}

std::string to_json(const std::vector<ChainTiming>& all) {
  ordered_json chains = ordered_json::array();
  for (const ChainTiming& one : all) {
    ordered_json& object = chains.emplace_back(to_json(one));
    if (one.sealed) object["sha256"] = json_checksum(nlohmann::json(object));
  }
  return ordered_json{{"version", kVersion}, {"chains", chains}}.dump(2) + "\n";
}

std::vector<ChainTiming> stored_chains(const std::string& path) {
  if (!std::filesystem::exists(path)) return {};
  return parse_chains(protocols::read_text_file(path), path);
}

void store_chain(const std::string& path, const ChainTiming& timing) {
  std::vector<ChainTiming> all;
  if (std::filesystem::exists(path))
    all = parse_chains(protocols::read_text_file(path), path, true);
  std::erase_if(all, [&timing](const ChainTiming& one) { return one.device == timing.device; });
  all.push_back(timing);
  data::AtomicFile file(path);
  file.write(to_json(all));
  file.sync();
  file.commit(true);
}

}  // namespace palpate::runner::devices
