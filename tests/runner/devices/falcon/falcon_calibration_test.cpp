#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <utility>

#include "protocols/parse.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/falcon.h"
#include "runner/devices/falcon/kinematics.h"
#include "runner/devices/falcon/packets.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr std::int64_t kNow = 1'793'530'800'000'000'000;  // 2026-11-01T11:00:00Z

Calibration example() {
  Calibration calibration;
  calibration.put({"A1", -4812.5, 0.01, 0.02, 0.3, {0.1, 0.2}, "2026-10-31T11:00:00Z"});
  calibration.put({"B2", -5000, 0.01, 0.02, 0.3, {0.1, 0.2}, "2026-01-31T11:00:00.5Z"});
  const Pose tail_in_tip{{0.1, 0.2, 0.3}, {0.6, 0, 0.8, 0}};
  calibration.put(
      PairRegistration{"A1", "B2", tail_in_tip, 0.12, 0.0004, 8, "2026-10-30T00:00:00Z"});
  return calibration;
}

std::string refusal(const std::string& text) {
  try {
    parse_calibration(text, "c.json");
  } catch (const protocols::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(FalconCalibration, IsReadBackAsWritten) {
  const Calibration there = example();
  const Calibration back = parse_calibration(to_json(there), "c.json");
  ASSERT_EQ(back.forces.size(), 2U);
  EXPECT_EQ(back.force_of("A1")->counts_per_torque, -4812.5);
  EXPECT_EQ(back.force_of("A1")->weights, there.force_of("A1")->weights);
  EXPECT_EQ(back.force_of("C3"), nullptr);
  const PairRegistration* pair = back.pair_of("A1", "B2");
  ASSERT_NE(pair, nullptr);
  EXPECT_EQ(pair->tail_in_tip.position, Vec3(0.1, 0.2, 0.3));
  EXPECT_NEAR(pair->tail_in_tip.orientation.y, 0.8, 1e-15);
  EXPECT_EQ(pair->points, 8);
  EXPECT_EQ(back.pair_of("B2", "A1"), nullptr);  // tip and tail are not the same
  EXPECT_EQ(to_json(back), to_json(there));
}

TEST(FalconCalibration, ANewerOneReplacesTheOld) {
  Calibration calibration = example();
  calibration.put({"A1", -6000, 0, 0, 0, {}, "2026-11-01T00:00:00Z"});
  EXPECT_EQ(calibration.forces.size(), 2U);
  EXPECT_EQ(calibration.force_of("A1")->counts_per_torque, -6000);
}

TEST(FalconCalibration, AMissingFileIsAnEmptyCalibration) {
  EXPECT_TRUE(read_calibration(::testing::TempDir() + "no-such-calibration.json").forces.empty());
}

TEST(FalconCalibration, EveryFaultIsNamed) {
  const std::string text = refusal(R"({"version": 1, "forces": [
    {"serial": "A", "counts_per_newton_metre": 5000, "made_utc": "yesterday"},
    {"serial": "B", "counts_per_newton_metre": "x", "made_utc": "2026-02-30T00:00:00Z",
     "weights_kg": [1, "two"], "colour": "red"}], "pairs": 3})");
  for (const char* place : {"/forces/0/counts_per_newton_metre", "/forces/0/made_utc",
                            "/forces/1/counts_per_newton_metre", "/forces/1/made_utc",
                            "/forces/1/weights_kg/1", "/forces/1/colour", "/pairs"}) {
    EXPECT_NE(text.find(place), std::string::npos) << place << " in\n" << text;
  }
  EXPECT_NE(refusal(R"({"version": 2})").find("/version"), std::string::npos);
  EXPECT_NE(refusal(R"([])"), "");
  EXPECT_NE(refusal(R"({"version": 1)"), "");
}

TEST(FalconCalibration, OnlyScalesPossibleByWeighingAreAccepted) {
  const auto scaled = [](double counts) {
    Calibration calibration;
    calibration.put({"A1", counts, 0.01, 0.02, 0.3, {0.1, 0.2}, "2026-10-31T11:00:00Z"});
    return to_json(calibration);
  };
  for (const double counts : {-1e6, -2.0001e5, -499.9, -100.0, 0.0, 1e4}) {
    EXPECT_NE(refusal(scaled(counts)).find("/forces/0/counts_per_newton_metre"), std::string::npos)
        << counts;
  }
  for (const double counts : {-2e5, -1e4, -500.0}) EXPECT_EQ(refusal(scaled(counts)), "") << counts;
}

TEST(FalconCalibration, AChangedNumberIsRefusedByItsChecksum) {
  const std::string text = to_json(example());
  for (const auto& [there, other] : {std::pair("-4812.5", "-4912.5"),
                                     {"\"A1\"", "\"A2\""},
                                     {"0.12,", "0.13,"},
                                     {"2026-10-31", "2026-11-01"}}) {
    std::string changed = text;
    changed.replace(changed.find(there), std::string(there).size(), other);
    EXPECT_NE(refusal(changed).find("/sha256: expected the checksum"), std::string::npos) << there;
  }
}

TEST(FalconCalibration, StaysStaleWithoutAChecksum) {
  Calibration calibration = example();
  calibration.forces[0].sealed = calibration.pairs[0].sealed = false;
  Calibration back = parse_calibration(to_json(calibration), "c.json");
  for (const CalibrationVerdict& verdict :
       {judge_forces(back, {"A1"}, kNow), judge_pair(back, "A1", "B2", kNow)}) {
    EXPECT_EQ(verdict.state, CalibrationState::stale);
    EXPECT_NE(verdict.text.find("no checksum"), std::string::npos) << verdict.text;
  }
  back.put({"B2", -5000, 0.01, 0.02, 0.3, {0.1}, "2026-11-01T00:00:00Z"});
  EXPECT_EQ(to_json(back).find("sha256"), to_json(back).rfind("sha256"));  // that of B2 alone
}

TEST(FalconCalibration, AScaleFarFromAFalconsIsImplausible) {
  for (const auto& [counts, state] :
       {std::pair(-1e4, CalibrationState::good), std::pair(-2500.0, CalibrationState::good),
        std::pair(-4e4, CalibrationState::good), std::pair(-2400.0, CalibrationState::implausible),
        std::pair(-4.1e4, CalibrationState::implausible)}) {
    Calibration calibration;
    calibration.put({"A1", counts, 0.01, 0.02, 0.3, {0.1, 0.2}, "2026-10-31T11:00:00Z"});
    EXPECT_EQ(plausible(calibration.forces[0]), state == CalibrationState::good) << counts;
    const CalibrationVerdict verdict = judge_forces(calibration, {"A1"}, kNow);
    EXPECT_EQ(verdict.state, state) << counts;
    if (state == CalibrationState::good) continue;
    EXPECT_NE(verdict.text.find(counts > -1e4 ? "4.2 times stronger" : "4.1 times weaker"),
              std::string::npos)
        << verdict.text;
  }
}

TEST(FalconCalibration, AFileThatOthersCanWriteIsRefused) {
  const palpate::testing::TemporaryFolder folder;
  const std::string path = folder / "calibration-of-others.json";
  std::ofstream(path) << to_json(example());
  for (const mode_t mode : {0600, 0644, 0400}) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    EXPECT_EQ(read_calibration(path).forces.size(), 2U);
  }
  for (const mode_t mode : {0660, 0602, 0666}) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    EXPECT_THROW(read_calibration(path), protocols::InputError) << std::oct << mode;
  }
  ASSERT_EQ(::chmod(path.c_str(), 0600), 0);
  if (::chown(path.c_str(), 65534, 65534) == 0 && ::geteuid() != 65534) {  // root alone may
    EXPECT_THROW(read_calibration(path), protocols::InputError);
  }
}

TEST(FalconSerial, IsSanitisedAndTruncated) {
  const auto clean = [](const std::string& text) {
    return clean_serial({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  EXPECT_EQ(clean("FALCON-01.a_b"), "FALCON-01.a_b");
  EXPECT_EQ(clean("\x1b[2J/../x\ny"), "__2J_.._x_y");
  EXPECT_EQ(clean(std::string(200, 'A')), std::string(kMaxSerial, 'A'));
  EXPECT_EQ(clean("    "), "");
  EXPECT_EQ(clean(std::string("\0A", 2)), "");
}

TEST(FalconCalibration, MissingAndStaleAreReported) {
  const Calibration calibration = example();
  EXPECT_EQ(judge_forces(calibration, {"A1"}, kNow).state, CalibrationState::good);
  EXPECT_EQ(judge_forces(calibration, {"A1", "B2"}, kNow).state, CalibrationState::stale);
  const CalibrationVerdict all = judge_forces(calibration, {"A1", "C3", "B2"}, kNow);
  EXPECT_EQ(all.state, CalibrationState::missing);
  EXPECT_NE(all.text.find("C3: none is stored"), std::string::npos) << all.text;
  EXPECT_NE(all.text.find("B2: made 2026-01-31"), std::string::npos) << all.text;
  EXPECT_NE(all.text.find("274 days ago"), std::string::npos) << all.text;
  EXPECT_EQ(judge_pair(calibration, "A1", "B2", kNow).state, CalibrationState::good);
  EXPECT_EQ(judge_pair(calibration, "B2", "A1", kNow).state, CalibrationState::missing);
}

TEST(FalconCalibration, VerdictsNameTheDevicesAndWhatToDo) {
  const Calibration calibration = example();
  EXPECT_EQ(judge_forces(calibration, {"A1"}, kNow).text,
            "force of the Falcon A1: made 2026-10-31T11:00:00Z, 1 days ago");
  EXPECT_EQ(judge_pair(calibration, "A1", "B2", kNow).text,
            "registration of the devices A1 (tip) and B2 (tail): made 2026-10-30T00:00:00Z, 2 days "
            "ago");
  EXPECT_EQ(judge_pair(calibration, "B2", "A1", kNow).text,
            "registration of the devices B2 (tip) and A1 (tail): none is stored; run palpate "
            "devices --calibrate");
  EXPECT_EQ(judge_forces(calibration, {"B2"}, kNow).text,
            "force of the Falcon B2: made 2026-01-31T11:00:00.5Z, 274 days ago; run palpate "
            "devices --calibrate again");
  const CalibrationVerdict all =
      both(judge_forces(calibration, {"A1"}, kNow), judge_pair(calibration, "B2", "A1", kNow));
  EXPECT_EQ(all.state, CalibrationState::missing) << "the worse of both";
  EXPECT_EQ(all.text, judge_forces(calibration, {"A1"}, kNow).text + "\n" +
                          judge_pair(calibration, "B2", "A1", kNow).text);
}

TEST(FalconCalibration, TwoFalconsWithoutARegistrationAreNotOpened) {
  servo::DeviceConfig config;
  config.serials = {"A1", "B2"};
  const auto fault_of = [&] {
    try {
      open_falcon2(config);
    } catch (const protocols::InputError& error) {
      return std::string(error.what());
    }
    return std::string("opened");
  };
  const std::string none = fault_of();
  for (const char* const part :
       {"(no calibration file)", "/pairs", "Falcons A1 (tip) and B2 (tail)",
        "palpate devices --calibrate --device falcon2"})
    EXPECT_NE(none.find(part), std::string::npos) << none;
  config.calibration = ::testing::TempDir() + "no-such-calibration.json";
  EXPECT_NE(fault_of().find(config.calibration), std::string::npos) << fault_of();
}

TEST(FalconCalibration, ACalibrationFromTheFutureIsStale) {
  const std::int64_t before = kNow - 200LL * 86400 * 1'000'000'000;
  const CalibrationVerdict verdict = judge_forces(example(), {"A1"}, before);
  EXPECT_EQ(verdict.state, CalibrationState::stale);
  EXPECT_NE(verdict.text.find("clock"), std::string::npos);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
