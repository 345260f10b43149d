// `palpate devices --sound NAME --loopback IN`: how late contacts are heard.

#include "runner/sound/loopback.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

#include "data/base/text.h"
#include "runner/commands/devices/devices.h"
#include "runner/station/opening.h"
#include "runner/station/sound_timing.h"

namespace palpate::runner::commands {
namespace {

constexpr int kClicks = 200;

}  // namespace

int measure_sound(const std::string& device, const std::string& input,
                  const std::string& calibration, nlohmann::ordered_json& report) {
  servo::HeardTicks ticks(station::kHeardTicks);
  sound::SoundSettings settings{.device = device};
  settings.ticks = &ticks;
  settings.realtime = station::real_time_for_sound;
  try {
    sound::SoundPlayer player(std::move(settings));
    const auto in = sound::open_sound_input(input);
    if (isatty(STDERR_FILENO) != 0)
      std::fprintf(stderr, "Playing %d clicks on %s, about 40 s ...\n", kClicks,
                   printable(device).c_str());
    const sound::LoopbackTiming timing = sound::measure_loopback(player, ticks, *in, kClicks);
    if (timing.missed > kClicks / 10) {
      std::fprintf(stderr,
                   "%d of %d clicks were not heard at '%s': lead a cable from the output '%s' to "
                   "it, and turn both up\n",
                   timing.missed, timing.clicks, printable(input).c_str(),
                   printable(device).c_str());
      return 1;
    }
    std::printf(
        "from contact to sound: median %.1f ms, 99 %% within %.1f ms (%d clicks, %d not heard)\n"
        "of which the program and its buffer %.1f ms; the rest is the card's way out and back in\n",
        1e3 * timing.median, 1e3 * timing.p99, timing.clicks, timing.missed,
        1e3 * player.latency());
    if (timing.median > data::HeardRecord::kMostLag)
      std::printf(
          "more than 12 ms, half of what people notice: sessions with it are refused unless the "
          "protocol accepts it\n");
    report["sound"] = {{"device", device},
                       {"input", input},
                       {"clicks", timing.clicks},
                       {"missed", timing.missed},
                       {"latency_median_s", timing.median},
                       {"latency_p99_s", timing.p99},
                       {"of_program_s", player.latency()}};
    if (calibration.empty()) return 0;
    const std::string path = station::sound_timing_file(calibration);
    station::store_sound_timing(
        path, {device, input, timing.clicks, timing.missed, timing.median, timing.p99, now_utc()});
    std::printf("stored in %s: palpate run --calibration %s uses it\n", printable(path).c_str(),
                printable(calibration).c_str());
    return 0;
  } catch (const sound::SoundError& error) {
    std::fprintf(stderr, "%s\n", printable_lines(error.what()).c_str());
    return 1;
  }
}

}  // namespace palpate::runner::commands
