#include "analysis/report/study_report.h"

#include <memory>
#include <utility>

#include "analysis/report/report.h"

namespace palpate::analysis {
namespace {

/// The report of an analysis, in each form.
class StudyReport {
 public:
  explicit StudyReport(const StudyAnalysis& analysis) : analysis_(analysis) {}
  virtual ~StudyReport() = default;
  virtual std::string text() const = 0;
  virtual std::string json() const = 0;
  virtual std::string html(const StudyRecord& record) const = 0;
  virtual std::vector<Figure> figures(const StudyRecord& record) const = 0;

 protected:
  const StudyAnalysis& analysis_;
};

class IdentificationReport final : public StudyReport {
 public:
  using StudyReport::StudyReport;
  std::string text() const override { return report_text(*analysis_.identification); }
  std::string json() const override { return report_json(*analysis_.identification); }
  std::string html(const StudyRecord& record) const override {
    return report_html(*analysis_.identification, record);
  }
  std::vector<Figure> figures(const StudyRecord& record) const override {
    return figures_of(*analysis_.identification, record);
  }
};

class TaskReport final : public StudyReport {
 public:
  using StudyReport::StudyReport;
  std::string text() const override { return task_report_text(analysis_); }
  std::string json() const override {
    return task_report_json(analysis_, analysis_.program_version);
  }
  std::string html(const StudyRecord& record) const override {
    return task_report_html(analysis_, analysis_.program_version, record);
  }
  std::vector<Figure> figures(const StudyRecord&) const override {
    std::vector<Figure> figures = between_figures(analysis_);
    for (Figure& figure : task_figures(analysis_)) figures.push_back(std::move(figure));
    if (analysis_.identification) {
      for (Figure& figure : figures_of(*analysis_.identification, {}))
        figures.push_back(std::move(figure));
    }
    return figures;
  }
};

/// A study of shapes has no cells of tasks.
std::unique_ptr<StudyReport> report_of(const StudyAnalysis& analysis) {
  if (analysis.cells.empty()) return std::make_unique<IdentificationReport>(analysis);
  return std::make_unique<TaskReport>(analysis);
}

}  // namespace

std::string study_text(const StudyAnalysis& analysis) { return report_of(analysis)->text(); }

std::string study_json(const StudyAnalysis& analysis) { return report_of(analysis)->json(); }

std::string study_html(const StudyAnalysis& analysis, const StudyRecord& record) {
  return report_of(analysis)->html(record);
}

std::vector<Figure> study_figures(const StudyAnalysis& analysis, const StudyRecord& record) {
  return report_of(analysis)->figures(record);
}

}  // namespace palpate::analysis
