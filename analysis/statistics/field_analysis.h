#pragma once
// The answers to levels of several dimensions: a function for each participant, the form over all
// of them.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/study_table.h"
#include "analysis/statistics/field_fit.h"

namespace palpate::analysis {

struct ParticipantField {
  std::string participant;
  std::vector<PointCount> counts;  ///< in order of their points
  FieldFit fit;
};

/// How far the locations of participants lie from those of the form at one place: ratios of JNDs as
/// natural logarithms, else differences of thresholds or shifts.
struct MisfitPlace {
  double at = 0;
  std::size_t participants = 0;
  double mean = 0;
  std::optional<Interval> ci95;  ///< t over participants
};

struct FieldAnalysis {
  /// A number of the level.
  struct Dimension {
    std::string name, unit;  ///< "1": without
  };
  std::string undefined;  ///< reason if no form is fitted; empty: it is
  std::vector<Dimension> dimensions;
  protocols::FieldFunction function;
  std::vector<ParticipantField> participants;
  /// Over participants with a tested form: their deviances and degrees of freedom summed.
  double deviance = 0;
  int df = 0;
  std::optional<double> p;  ///< none: it is not tested
  std::size_t tested = 0;   ///< participants
  std::vector<MisfitPlace> places;

  bool has_jnd() const {
    return undefined.empty() && (function.form == protocols::FieldForm::weber ||
                                 function.form == protocols::FieldForm::power);
  }
};

/// Below this p of the deviance a report says that the form does not hold.
inline constexpr double kMisfitLevel = 0.05;

/// The form of a block's QUEST+; without one `weber`, where one dimension of the standard and one
/// of the comparison have one path. \param trials  of a block, stimulus and renderer
FieldAnalysis analyze_field(const std::vector<const StudyTrial*>& trials,
                            const protocols::BlockProcedures& block);

/// The unit of a parameter; "": none. \param name  as in FieldParameter
std::string unit_of_parameter(const FieldAnalysis& field, const std::string& name);

}  // namespace palpate::analysis
