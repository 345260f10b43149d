#pragma once
// Contact with objects of several convex parts and tools of several segments: the error of the
// contact law against closed forms and the brute-force oracle, beside two simpler methods.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runner/evidence/accuracy/methods.h"
#include "runner/evidence/verification/union_cases.h"

namespace palpate::runner::evidence {

/// An object, a tool and a path with the exact displacement of the ideal tool at every tick.
struct UnionCase {
  OracleParts parts;
  OracleTool tool;  ///< one segment of length 0: the tip alone; one segment: the plain stylus
  std::vector<OraclePose> path;
  std::vector<Vec3> displacement;  ///< m, from the virtual to the ideal tip; 0 in free space
};

/// A kind of case, drawn anew for each seed.
struct UnionCaseKind {
  const char* name;   ///< "groove of 2 degrees"
  const char* truth;  ///< source of the exact displacement
  std::function<UnionCase(std::uint64_t seed, std::size_t ticks)> draw;
};
std::vector<UnionCaseKind> union_case_kinds();

/// A method that finds force and torque on unions.
struct UnionMethod {
  const char* name;
  const char* description;
  bool one_ideal_tool;  ///< it has one ideal tool, which can be checked for penetration
};
const std::vector<UnionMethod>& union_methods();

struct UnionSettings {
  int seeds = 4;             ///< of each case: 1, 2, ...
  std::size_t ticks = 1500;  ///< of each
  int timings = 3;           ///< repetitions; the fastest counts
};

/// One method over one kind of case.
struct UnionRow {
  std::string name, truth;  ///< of the case
  std::size_t segments = 0;
  std::string method;
  double ns_per_tick = 0;  ///< mean over all ticks
  std::size_t ticks = 0;
  std::size_t in_contact = 0;  ///< by the truth
  /// Ticks with the ideal tool in a part by more than 1e-12 of the part's size; 0 for methods
  /// without an ideal tool.
  std::size_t inside = 0;
  bool one_ideal_tool = false;
  std::size_t off_by_a_tenth = 0;  ///< ticks in contact with the force more than 10 % off
  ErrorSpread force;               ///< N, as a vector, at kStiffness, over all ticks
};

/// \param now       a clock, ns
/// \param progress  called with the fraction done before each row
std::vector<UnionRow> union_study(const UnionSettings& settings, const std::function<double()>& now,
                                  const std::function<void(double)>& progress);

}  // namespace palpate::runner::evidence
