// How many trials one QUEST+ of Weber's law over four standards takes, beside four separate ones.
// Usage: field_trials [SEED ...]

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "data/base/random.h"
#include "protocols/procedures/procedure.h"

namespace {

using namespace palpate::protocols;
using palpate::Random;

constexpr double kQuartile = 0.6744897501960817;
constexpr int kPeople = 200;
const std::vector<double> kStandards{100, 200, 400, 800};  // N/m
const std::vector<double> kLapses{0.01, 0.02, 0.04};

std::vector<double> spaced(double from, double to, int count, bool ratios) {
  std::vector<double> out;
  for (int i = 0; i < count; ++i) {
    const double share = static_cast<double>(i) / (count - 1);
    out.push_back(ratios ? from * std::pow(to / from, share) : from + share * (to - from));
  }
  return out;
}

/// A simulated person: JND(S) = w (S + c), with lapses at both ends.
struct Person {
  double w, c, lapse = 0.02;
  explicit Person(Random& random)
      : w(0.12 * std::exp(0.2 * random.normal())), c(60 + 15 * random.normal()) {}
  double jnd(double standard) const { return w * (standard + c); }
  bool chooses(double standard, double x, Random& random) const {
    const double z = kQuartile * (x - standard) / jnd(standard);
    return random.unit() < lapse + (1 - 2 * lapse) * 0.5 * std::erfc(-z / std::sqrt(2.0));
  }
};

/// Errors of the logarithm of the JND, summed over people and standards.
struct Errors {
  double sum = 0, squares = 0;
  int n = 0;
  void add(double error) {
    sum += error;
    squares += error * error;
    ++n;
  }
  double rms() const { return std::sqrt(squares / n); }
  double bias() const { return sum / n; }
};

FieldQuestPlus weber(int trials) {
  FieldQuestPlus spec;
  spec.levels = {kStandards, spaced(50, 1200, 64, true)};
  spec.parameters = {
      {spaced(0.03, 0.5, 20, true), {}}, {spaced(0, 300, 16, false), {}}, {kLapses, {}}};
  spec.interest = {true, true, false};
  spec.stop_trials = trials;
  return spec;
}

/// Of one standard: the same levels about it, JNDs as wide as those of the other.
FieldQuestPlus separate(double standard, int trials) {
  FieldQuestPlus spec = weber(trials);
  spec.levels[0] = {standard};
  // c is 0: w is the JND over the standard, from the least to the most of the form's grid.
  spec.parameters[0].values = spaced(0.03, 0.5 * (standard + 300) / standard, 40, true);
  spec.parameters[1].values = {0};
  return spec;
}

double mean_log_jnd(const FieldQuestPlus& spec, const std::vector<double>& posterior,
                    double standard) {
  double mean = 0;
  std::size_t i = 0;
  for (const double w : spec.parameters[0].values)
    for (const double c : spec.parameters[1].values)
      for (std::size_t l = 0; l < spec.parameters[2].values.size(); ++l)
        mean += posterior[i++] * std::log(w * (standard + c));
  return mean;
}

void run(FieldQuestPlusRun& quest, const Person& person, Random& random) {
  while (const auto point = quest.next_point())
    quest.record({0, person.chooses((*point)[0], (*point)[1], random), *point});
}

/// One QUEST+ over all standards.
void run_one(int trials, std::uint64_t seed) {
  Errors errors;
  const FieldQuestPlus spec = weber(trials);
  const FieldQuestPlusRun fresh(spec);
  for (std::uint64_t i = 0; i < kPeople; ++i) {
    Random random(seed, {i});
    const Person person(random);
    FieldQuestPlusRun quest = fresh;
    run(quest, person, random);
    for (const double standard : kStandards)
      errors.add(mean_log_jnd(spec, quest.posterior(), standard) - std::log(person.jnd(standard)));
  }
  std::printf("seed %llu, %d trials, one QUEST+: rms %.3f, bias %+.3f\n",
              static_cast<unsigned long long>(seed), trials, errors.rms(), errors.bias());
  std::fflush(stdout);
}

/// One for each standard, with a quarter of the trials.
void run_four(int trials, std::uint64_t seed) {
  Errors errors;
  for (const double standard : kStandards) {
    const FieldQuestPlus spec = separate(standard, trials / 4);
    const FieldQuestPlusRun fresh(spec);
    for (std::uint64_t i = 0; i < kPeople; ++i) {
      Random random(seed, {i});
      const Person person(random);
      FieldQuestPlusRun quest = fresh;
      run(quest, person, random);
      errors.add(mean_log_jnd(spec, quest.posterior(), standard) - std::log(person.jnd(standard)));
    }
  }
  std::printf("seed %llu, %d trials, four QUEST+ of %d: rms %.3f, bias %+.3f\n",
              static_cast<unsigned long long>(seed), trials, trials / 4, errors.rms(),
              errors.bias());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::printf("rms error of the log JND at four standards, %d SIMULATED people\n", kPeople);
  std::vector<std::uint64_t> seeds;
  for (int i = 1; i < argc; ++i) seeds.push_back(std::strtoull(argv[i], nullptr, 10));
  if (seeds.empty()) seeds = {1, 2, 3};
  for (const std::uint64_t seed : seeds) {
    for (const int trials : {80, 160}) run_one(trials, seed);
    for (const int trials : {80, 160, 400, 800}) run_four(trials, seed);
  }
}
