// The closed loop against theory: cases that must agree, and cases with a bound.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "runner/evidence/stability/boundary.h"
#include "runner/evidence/stability/integrators.h"
#include "runner/evidence/stability/soft_rest.h"
#include "runner/servo/passivity.h"

namespace palpate::runner::stability {
namespace {

TEST(Stability, APlainWallBecomesUnstableWhereTheoryPredicts) {
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const double rate : {500.0, 1000.0, 10000.0}) {
      for (const int delay : {0, 1}) {
        for (const double stiffness : {10.0, 1000.0, 1e5}) {
          evidence::LoopCase loop;
          loop.renderer = renderer;
          loop.heavy = true;
          loop.settings.rate = rate;
          loop.settings.delay = delay;
          const evidence::BoundaryPoint p = evidence::boundary_at(loop, stiffness);
          EXPECT_DOUBLE_EQ(p.theory, stiffness / rate * (0.5 + delay));
          EXPECT_NEAR(p.measured / p.theory, 1, 0.05)
              << protocols::to_string(renderer) << ", " << rate << " Hz, delay " << delay << ", "
              << stiffness;
        }
      }
    }
  }
}

TEST(Stability, HoldsWhereTheoryPromisesPassivity) {
  std::vector<evidence::LoopCase> loops;
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const evidence::ContactCase contact_case : evidence::kContactCases) {
      for (const double damping : {0.0, 1.0}) {
        evidence::LoopCase loop;
        loop.contact_case = contact_case;
        loop.renderer = renderer;
        loop.virtual_damping = damping;
        loops.push_back(loop);
      }
    }
  }
  evidence::LoopCase held, rough;
  held.settings.hand = {1000, 10, 0.05};
  rough.settings.friction = 0.5;
  rough.settings.resolution = 3e-5;
  loops.push_back(held);
  loops.push_back(rough);
  for (const evidence::LoopCase& loop : loops) {
    for (const double stiffness : {30.0, 3000.0, 30000.0}) {
      const evidence::BoundaryPoint p = evidence::boundary_at(loop, stiffness);
      EXPECT_TRUE(p.promised);
      EXPECT_FALSE(p.unsafe()) << evidence::to_string(loop.contact_case) << ", "
                               << protocols::to_string(loop.renderer) << ", B "
                               << loop.virtual_damping << ", " << stiffness << ": " << p.measured
                               << " of " << p.theory;
    }
  }
}

// Theory uses the effective stiffness of layers and levers: K is the sum of the stiffnesses at the
// depth of the contact, times the square of the lever at both ends.
TEST(Stability, LayersAndLeversBecomeUnstableWhereTheFeltStiffnessDoes) {
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    evidence::LoopCase layered;
    layered.renderer = renderer;
    layered.heavy = true;
    layered.layer_share = 2;
    const evidence::BoundaryPoint deep = evidence::boundary_at(layered, 1000);
    EXPECT_DOUBLE_EQ(deep.theory, 3000 * 1e-3 / 2);
    EXPECT_NEAR(deep.measured / deep.theory, 1, 0.02);
  }
  for (const auto& [fraction, gain] : {std::pair(1.0, 25.0 + 16.0), std::pair(0.5, 9.0 + 4.0)}) {
    evidence::LoopCase far;
    far.heavy = true;
    far.settings.reach = rendering::Reach{.factor = 5, .fraction = fraction};
    const evidence::BoundaryPoint p = evidence::boundary_at(far, 100);
    EXPECT_NEAR(p.theory, 100 * gain * 1e-3 / 2, 1e-12);
    EXPECT_NEAR(p.measured / p.theory, 1, 0.02) << fraction;
  }
}

// A constructed loop that finally neither grows nor shrinks: it is not at rest, however long it
// lasts.
TEST(Stability, ALimitCycleIsUnstableWhateverItsAmplitude) {
  evidence::LoopOutcome cycle;
  cycle.initial_swing = 2e-4;
  cycle.floor = 2e-6;
  for (const double amplitude : {3e-6, 1e-4, 3.26e-3}) {
    cycle.early_swing = cycle.late_swing = amplitude;
    EXPECT_EQ(evidence::verdict_on(cycle, false), evidence::Verdict::unstable) << amplitude;
    cycle.late_swing = 0.999 * amplitude;  // a slight decrease is chance
    EXPECT_EQ(evidence::verdict_on(cycle, false), evidence::Verdict::unstable) << amplitude;
  }
  cycle.early_swing = cycle.late_swing = 1.9e-6;
  EXPECT_EQ(evidence::verdict_on(cycle, false), evidence::Verdict::stable) << "within the floor";
  cycle.early_swing = 1e-4;
  cycle.late_swing = 1e-5;
  EXPECT_EQ(evidence::verdict_on(cycle, false), evidence::Verdict::open)
      << "it shrinks, and may stop at a cycle";
  EXPECT_EQ(evidence::verdict_on(cycle, true), evidence::Verdict::stable)
      << "what is linear shrinks for ever";
  cycle.early_swing = cycle.late_swing = 3.26e-3;
  EXPECT_EQ(evidence::verdict_on(cycle, true), evidence::Verdict::unstable)
      << "the contact is lost and found again";
}

// The swing of 3.26 mm that once counted as stable, and its neighbourhood.
TEST(Stability, TheControllersLoopIsUnstableOnlyAboveItsBoundary) {
  evidence::LoopSettings settings;
  settings.passivity_controller = true;
  const auto run = [&](double stiffness) {
    stimuli::Material material;
    material.stiffness = stiffness;
    return evidence::run_loop(
        settings,
        evidence::LoopScene(evidence::ContactCase::wall, protocols::RendererKind::point, material));
  };
  const evidence::LoopOutcome swinging = run(1.19e5);
  EXPECT_FALSE(swinging.stable);
  EXPECT_GT(swinging.late_swing, 1e-3);
  int changes = 0;
  bool before = true;
  for (double stiffness = 500; stiffness < 3e5; stiffness *= 1.07) {
    const evidence::LoopOutcome outcome = run(stiffness);
    changes += outcome.stable != before;
    before = outcome.stable;
    if (outcome.stable) {
      EXPECT_LE(outcome.late_swing, outcome.floor);
    }
  }
  EXPECT_FALSE(before);
  EXPECT_EQ(changes, 1) << "stable up to a stiffness, unstable from it on";
}

TEST(Stability, EachCaseTouchesItsObjects) {
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const evidence::ContactCase contact_case : evidence::kContactCases) {
      const evidence::LoopScene scene(contact_case, renderer, stimuli::Material{});
      EXPECT_EQ(scene.contacts(), contact_case == evidence::ContactCase::two_objects ? 2 : 1);
      EXPECT_GT(scene.force_tip(), 0);
      const bool side = renderer == protocols::RendererKind::ray &&
                        contact_case != evidence::ContactCase::wall &&
                        contact_case != evidence::ContactCase::body;
      EXPECT_EQ(scene.force_tail() > 0, side) << evidence::to_string(contact_case);
    }
  }
}

TEST(Stability, TheoryNeedsFrictionAboveQuantisation) {
  evidence::LoopCase loop;
  loop.settings.friction = 0.025;
  loop.settings.resolution = 3e-5;
  EXPECT_TRUE(evidence::boundary_at(loop, 1600).promised);
  EXPECT_FALSE(evidence::boundary_at(loop, 1700).promised);  // 2 f_c / Delta = 1667 N/m
}

TEST(Stability, ThePassivityControllerExtendsTheStableRange) {
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const evidence::ContactCase contact_case : evidence::kContactCases) {
      evidence::LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      constexpr double kDamping = 0.25;
      double unstable = kDamping / evidence::passive_damping(loop, 1);  // passive yet
      while (evidence::is_stable(loop, unstable, kDamping)) unstable *= 1.15;
      loop.settings.passivity_controller = true;
      for (double stiffness = unstable; stiffness < 12 * unstable; stiffness *= 1.3)
        EXPECT_TRUE(evidence::is_stable(loop, stiffness, kDamping))
            << evidence::to_string(contact_case) << ", " << stiffness << " of " << unstable;
    }
  }
}

TEST(Integrators, TheExactIntegratorIsExactAndTheOthersConverge) {
  const auto rows = evidence::compare_integrators([] {
    return std::chrono::duration<double, std::nano>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
  });
  int blown_up = 0;
  for (const evidence::IntegratorRow& row : rows) {
    if (row.method == "exact") {
      EXPECT_LT(row.error, 1e-12) << row.oscillator;
      continue;
    }
    blown_up += std::isinf(row.error);
    if (row.method == "implicit") {
      EXPECT_TRUE(std::isfinite(row.error));
    }
    if (row.steps == 1024) {
      EXPECT_LT(row.error, 1e-5) << row.oscillator << " " << row.method;
      EXPECT_GT(row.error, 1e-12);
    }
  }
  EXPECT_GT(blown_up, 2);
}

TEST(SoftMap, ScenesAllowOnlyCasesThatComeToRest) {
  const evidence::SoftSwing calm =
      evidence::press_and_hold({.young = 1e6, .stiffness = 3000, .rate = 62.5});
  EXPECT_TRUE(calm.accepted);
  EXPECT_TRUE(calm.settles()) << calm.swing;
  EXPECT_GT(calm.force, 0.1);
  const evidence::SoftSwing wild =
      evidence::press_and_hold({.young = 1e3, .stiffness = 3000, .rate = 125, .damping = 0});
  EXPECT_TRUE(wild.finite);
  EXPECT_FALSE(wild.settles()) << wild.swing;
  EXPECT_FALSE(wild.accepted);
  // Pressed elsewhere it swings by 4 % of 7 N, however long it is held.
  for (const evidence::SoftCase& one : evidence::soft_cases_elsewhere(18)) {
    if (one.young != 1e5 || one.stiffness != 3000 || one.rate != 62.5 || one.radius != 0.01)
      continue;
    const evidence::SoftSwing hidden = evidence::press_and_hold(one);
    EXPECT_GT(hidden.swing, 0.03);
    EXPECT_FALSE(hidden.accepted);
  }
}

TEST(SoftMap, AllowedCasesComeToRestElsewhereToo) {
  const std::vector<evidence::SoftCase> cases = evidence::soft_cases_elsewhere(3),
                                        others = evidence::soft_cases_elsewhere(4);
  ASSERT_EQ(cases.size(), evidence::soft_cases().size());
  EXPECT_NE(cases[0].x, others[0].x);
  int tried = 0;
  for (std::size_t i = 0; i < cases.size(); i += 16) {
    EXPECT_LT(std::max(std::abs(cases[i].x), std::abs(cases[i].y)), 0.02);
    const evidence::SoftSwing swing = evidence::press_and_hold(cases[i]);
    EXPECT_TRUE(swing.finite);
    if (!swing.accepted) continue;
    EXPECT_TRUE(swing.settles()) << i << " " << swing.swing;
    ++tried;
  }
  EXPECT_GT(tried, 9);
}

}  // namespace
}  // namespace palpate::runner::stability
