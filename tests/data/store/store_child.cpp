// The process that durability_test.cpp kills. Every line it prints is written at once.
//
//   store_child hold DB                    holds the writer's lock until it is killed
//   store_child session DB TRIALS SEED     a live session, resumed where it stands
//   store_child forget DB CODE             a withdrawal
//   store_child simulate DB TRIALS SEED    a simulated one, in small batches

#include <unistd.h>

#include <chrono>
#include <iostream>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace {

using namespace palpate::data;
using palpate::data::testing::a_protocol;
using palpate::data::testing::a_record;
using palpate::data::testing::a_run;

void say(const std::string& line) {
  const std::string text = line + "\n";
  if (::write(STDOUT_FILENO, text.data(), text.size()) < 0) ::_exit(3);
}

class Pause {
 public:
  explicit Pause(unsigned seed) : random_(seed) {}
  void operator()(unsigned at_most_us) {
    std::this_thread::sleep_for(std::chrono::microseconds(random_() % at_most_us));
  }

 private:
  std::mt19937 random_;
};

int run_session(Store& store, int trials, unsigned seed) {
  Pause pause(seed);
  const Participant person = store.enrol(a_protocol(), "P1");
  const SessionProgress progress = store.progress(person, 1);
  std::set<int> done;
  for (const auto& record : progress.completed) done.insert(record.trial);
  if (progress.last_end == RunEnd::done) return 0;
  const Run run = store.begin_run(person, a_run());
  say("run");
  for (int trial = 1; trial <= trials; ++trial) {
    if (done.contains(trial)) continue;
    TrialRecord record = a_record(trial);
    record.samples.resize(static_cast<std::size_t>(trial % 5) * 100);
    record.attempt = store.begin_attempt(run, record, record.onset_ns);
    say("begun " + std::to_string(trial) + " " + std::to_string(record.attempt));
    pause(2000);
    store.finish_attempt(run, record);
    say("acknowledged " + std::to_string(trial));
    pause(500);
  }
  store.end_run(run, RunEnd::done, 1);
  return 0;
}

int run_simulation(Store& store, int trials, unsigned seed) {
  Pause pause(seed);
  const Participant person = store.enrol(a_protocol(), "S1", {}, true, 1);
  const SessionProgress progress = store.progress(person, 1);
  if (progress.last_end == RunEnd::done) return 0;
  const Run run = store.begin_run(person, a_run());
  int trial = static_cast<int>(progress.completed.size()) + 1;
  while (trial <= trials) {
    std::vector<TrialRecord> batch;
    for (int i = 0; i < 7 && trial <= trials; ++i) batch.push_back(a_record(trial++));
    pause(1000);
    store.record_simulated(run, batch);
    say("acknowledged " + std::to_string(trial - 1));
  }
  store.end_run(run, RunEnd::done, 1);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> words(argv + 1, argv + argc);
    Store store = Store::open(words.at(1), Store::Mode::write_or_create);
    if (words[0] == "hold") {
      say("held");
      ::pause();
      return 0;
    }
    if (words[0] == "forget") {
      say("open");
      store.forget(words.at(2));
      return 0;
    }
    const int trials = std::stoi(words.at(2));
    const auto seed = static_cast<unsigned>(std::stoul(words.at(3)));
    return words[0] == "session" ? run_session(store, trials, seed)
                                 : run_simulation(store, trials, seed);
  } catch (const std::exception& error) {
    std::cerr << "store_child: " << error.what() << "\n";
    return 1;
  }
}
