// Whatever a file beside a study holds (registration, plan, hypotheses, bundle, cluster, terms of
// use, translation, calibration, delays): it is read, or every fault has the file's name, a place
// and what is expected there.

#include <cstdlib>
#include <functional>
#include <string>

#include "analysis/report/hypotheses.h"
#include "analysis/report/plan_record.h"
#include "protocols/parse.h"
#include "protocols/tasks/texts.h"
#include "runner/devices/device_delay.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/registration/about_file.h"
#include "runner/registration/bundle_contents.h"
#include "runner/registration/registration.h"
#include "runner/sweep/cluster_job.h"

namespace {

namespace registration = palpate::runner::registration;
namespace devices = palpate::runner::devices;

/// Reads a text, and again what is written of it.
void try_form(const std::string& text) {
  const registration::Form form = registration::read_form(text, "form.json");
  if (registration::read_form(registration::form_json(form), "again.json") != form) std::abort();
  const std::string made = registration::markdown_as_made(form, std::string(64, 'a'));
  registration::markdown_changes(form, std::string(64, 'a'), made);
  registration::osf_changes(form, std::string(64, 'a'), text);
}

void try_plan(const std::string& text) {
  for (const auto& curve : palpate::analysis::read_plan(text, "plan.json").curves) {
    if (curve.trials < 1 || curve.trials > 10'000) std::abort();
  }
}

void try_statement(const std::string& text) {
  const registration::Registration read = registration::parse_statement(text, "registration.json");
  if (read.participants > registration::kMostParticipants ||
      read.order_sha256.size() != read.participants || !(read.too_fast > 0 && read.alpha > 0))
    std::abort();
}

void try_delays(const std::string& text) {
  for (const devices::ChainTiming& one : devices::parse_chains(text, "lab.timing.json")) {
    if (!one.sealed || !(one.counted() >= 0 && one.counted() <= 1)) std::abort();
  }
}

void try_translation(const std::string& text) {
  static const palpate::protocols::Protocol protocol = palpate::protocols::parse_protocol_text(
      R"({"version": 1, "name": "p", "renderers": ["point"], "repetitions": 1, "seed": 1,
          "stimuli": [{"name": "a", "shape": "sphere", "radius_m": 0.02},
                      {"name": "b", "shape": "sphere", "radius_m": 0.03}],
          "response": {"keys": {"1": "a", "2": "b"}, "time_out_s": 5}})",
      "p.json");
  palpate::protocols::Protocol translated = protocol;
  palpate::protocols::translate(translated, "de", text, "texts.de.json");
}

const std::function<void(const std::string&)> kReaders[] = {
    try_form,
    try_plan,
    try_statement,
    try_delays,
    try_translation,
    [](const std::string& text) { palpate::analysis::read_hypotheses(text, "h.json", {}); },
    [](const std::string& text) { registration::read_reported(text, "analysis.json"); },
    [](const std::string& text) { registration::parse_record(text, "record.json"); },
    [](const std::string& text) { registration::parse_points(text, "check.json"); },
    [](const std::string& text) { palpate::runner::sweep::parse_job(text, "cluster.json"); },
    [](const std::string& text) { registration::read_about_text(text, "about.json"); },
    [](const std::string& text) { devices::falcon::parse_calibration(text, "lab.json"); },
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (const auto& read : kReaders) {
    try {
      read(text);
    } catch (const palpate::protocols::InputError& error) {
      for (const palpate::protocols::Fault& fault : error.faults()) {
        if (!fault.file.ends_with(".json") || fault.location.empty() || fault.expected.empty())
          std::abort();
      }
    }
  }
  return 0;
}
