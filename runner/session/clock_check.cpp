#include "runner/session/clock_check.h"

#include <cmath>

#include "data/files/utc.h"

namespace palpate::runner {
namespace {

constexpr double kSecond = 1e9, kDay = 86400 * kSecond, kYear = 365.25 * kDay;  // ns
// 2024-01-01, before there was this program: what a computer without a battery wakes up with.
constexpr std::int64_t kBeforeThisProgram_ns = 1'704'067'200'000'000'000;
// Clocks are set right by a second or so now and then; disks of other systems keep local time.
constexpr double kRecordSlack = 2 * kSecond, kFileSlack = kDay;
constexpr double kStudyRests = 2 * kYear, kProtocolRests = 5 * kYear;

std::string span(double ns) {
  const auto words = [](double value, const char* unit) {
    const auto whole = std::lround(value);
    return std::to_string(whole) + " " + unit + (whole == 1 ? "" : "s");
  };
  if (ns >= kYear) return words(ns / kYear, "year");
  if (ns >= kDay) return words(ns / kDay, "day");
  if (ns >= 3600 * kSecond) return words(ns / (3600 * kSecond), "hour");
  return ns >= 60 * kSecond ? words(ns / (60 * kSecond), "minute") : words(ns / kSecond, "second");
}

std::string day_and_minute(std::int64_t ns) {
  std::string text = data::format_utc(ns).substr(0, 16);
  text[10] = ' ';
  return text + " UTC";
}

}  // namespace

std::string clock_warning(const ClockEvidence& evidence) {
  const std::int64_t now = evidence.now_ns;
  const auto doubt = [now](const std::string& why) {
    return "the computer's clock says " + day_and_minute(now) + ", " + why +
           "; every date on record follows it: if it is wrong, end here and set it (timedatectl)";
  };
  // As doubles: the difference of two dates of a damaged file need not fit.
  const auto ahead = [now](std::int64_t then) {
    return static_cast<double>(now) - static_cast<double>(then);
  };
  if (const auto& record = evidence.newest_record_ns) {
    const std::string of = "the newest record of this database (" + day_and_minute(*record) + ")";
    if (ahead(*record) < -kRecordSlack) return doubt(span(-ahead(*record)) + " before " + of);
    if (ahead(*record) > kStudyRests) return doubt(span(ahead(*record)) + " after " + of);
  }
  if (now < kBeforeThisProgram_ns) return doubt("which is before this program existed");
  if (const auto& file = evidence.newest_file_ns) {
    const std::string of =
        "the protocol or the program was written last (" + day_and_minute(*file) + ")";
    if (ahead(*file) < -kFileSlack) return doubt(span(-ahead(*file)) + " before " + of);
    if (!evidence.newest_record_ns && ahead(*file) > kProtocolRests)
      return doubt(span(ahead(*file)) + " after " + of);
  }
  return "";
}

}  // namespace palpate::runner
