// Whatever became of a database's bytes: it is refused, or all that it holds can be read. The input
// is a list of changes to a sound one: three bytes of place, one of value.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "data/base/checksum.h"
#include "data/store/store.h"
#include "tests/fuzz/input_file.h"

namespace {

using namespace palpate;

constexpr const char* kText = "{\"version\": 1}\n";

data::TrialRecord a_trial(int number) {
  data::TrialRecord trial;
  trial.trial = number;
  trial.renderer = "ray";
  trial.shape = "cube";
  trial.response = "cone";
  trial.response_time = 1.5;
  trial.first_contact_time = 0.5;
  trial.onset_ns = 6'000'000'000 + number * 5'000'000'000LL;
  trial.response_ns = trial.onset_ns + 1'500'000'000;
  trial.ticks = 1500;
  trial.samples.resize(20);
  for (std::size_t i = 0; i < trial.samples.size(); ++i) {
    trial.samples[i].tick = static_cast<std::uint32_t>(i);
  }
  return trial;
}

/// The bytes of a database with two trials, one that was cut off, and notes.
std::string sound_database() {
  const testing::InputFile folder("sound.db");
  const std::uint8_t nothing = 0;
  const std::string path = folder.write(&nothing, 0);
  std::filesystem::remove(path);
  {
    data::Store store = data::Store::open(path, data::Store::Mode::write_or_create);
    const data::Participant participant =
        store.enrol({"quick", kText, checksum_hex(kText), {}}, "P01");
    data::RunInfo info;
    info.clock = {1'700'000'000'000'000'000, 5'000'000'000};
    info.program_version = "0.1.0";
    info.device = "simulated";
    const data::Run run = store.begin_run(participant, info);
    for (int number = 1; number <= 3; ++number) {
      data::TrialRecord trial = a_trial(number);
      trial.attempt = store.begin_attempt(run, trial, trial.onset_ns - 1);
      if (number < 3) {
        store.finish_attempt(run, trial);
      } else {
        store.cut_off_attempt(run, "the device was lost");
      }
      store.add_note(run, trial.response_ns, "note " + std::to_string(number));
    }
    store.end_run(run, data::RunEnd::paused, 30'000'000'000);
  }
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::filesystem::remove(path);
  return bytes;
}

void read_all(const std::string& path) {
  data::Store store = data::Store::open(path, data::Store::Mode::read_only);
  store.counts();
  store.for_each_trial([](const data::StoredTrial&) {}, true);
  store.for_each_cut_off([](const data::StoredTrial&) {});
  store.notes();
  store.runs();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string sound = sound_database();
  static const testing::InputFile file("changed.db");
  std::string bytes = sound;
  for (std::size_t i = 0; i + 3 < size; i += 4) {
    const std::size_t place = data[i] + 256U * data[i + 1] + 65536U * data[i + 2];
    bytes[place % bytes.size()] = static_cast<char>(data[i + 3]);
  }
  const auto* const changed = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const std::string& path = file.write(changed, bytes.size());
  try {
    read_all(path);
  } catch (const data::StoreError&) {
    if (bytes == sound) throw;
  }
  for (const char* beside : {"-wal", "-shm", "-journal"}) std::filesystem::remove(path + beside);
  return 0;
}
