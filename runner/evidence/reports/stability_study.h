#pragma once
// The loops that `palpate stability` closes: the map of boundaries, and that of soft bodies.

#include <functional>
#include <vector>

#include "runner/evidence/reports/stability_report.h"

namespace palpate::runner::evidence {

struct StudyJobs {
  int threads = 1;
  std::function<void(double)> progress;  ///< gets the share that is done
  std::function<double()> now_ns;        ///< a clock for the cost of integrators
};

/// \param full  four stiffnesses a decade instead of one
StabilityReport stability_study(bool full, const StudyJobs& jobs);
std::vector<SoftSwing> soft_study(const std::vector<SoftCase>& cases, const StudyJobs& jobs);

}  // namespace palpate::runner::evidence
