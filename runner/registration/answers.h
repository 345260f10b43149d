#pragma once
// The answers of a registration to the questions of the form that differ between studies: which
// shape it is, and the tasks of version 2.

#include <memory>
#include <string>
#include <vector>

#include "runner/registration/planned_studies.h"
#include "runner/registration/registration.h"

namespace palpate::runner::registration {

/// A paragraph, an item of a list, literal lines, or what only the lab can say.
struct Paragraph {
  enum class Kind { text, item, lines, field } kind = Kind::text;
  std::string text;
};

Paragraph text(std::string words);
Paragraph item(std::string words);
Paragraph lines(std::string words);
Paragraph fill_in(std::string words);

/// The fewest digits that identify the number.
std::string plain(double value);
std::string percent(double share);

class StudyAnswers {
 public:
  /// \param made  must outlive it
  explicit StudyAnswers(const Registration& made) : made_(made), protocol_(made.protocol) {}
  virtual ~StudyAnswers() = default;

  /// The names in the conditions of the hypotheses.
  virtual std::string names() const = 0;
  /// Whether the participant learns whether an answer was right; "": never.
  virtual std::string feedback() const = 0;
  virtual std::vector<Paragraph> design() const = 0;
  /// The random draws, and those that are fixed, before the checksums of the orders.
  virtual std::vector<Paragraph> randomisation() const = 0;
  virtual std::vector<Paragraph> sample_size() const = 0;
  /// When a session's blocks end, beside the study's stopping rule; empty: their length is fixed.
  virtual std::vector<Paragraph> stopping() const { return {}; }
  virtual std::vector<Paragraph> manipulated() const = 0;
  virtual std::vector<Paragraph> measured() const = 0;
  virtual std::vector<Paragraph> indices() const = 0;
  virtual std::vector<Paragraph> models() const = 0;
  virtual std::vector<Paragraph> transformations() const = 0;
  virtual std::vector<Paragraph> inference() const = 0;
  virtual std::vector<Paragraph> exclusion() const = 0;
  virtual std::vector<Paragraph> missing() const = 0;
  /// How the rehearsed studies were made, in sentences behind their numbers.
  virtual std::string rehearsal() const = 0;
  /// Studies as the plan expects them.
  virtual std::unique_ptr<PlannedStudies> planned() const = 0;
  /// The contents of simulated/, for its README.
  virtual std::string simulated() const = 0;

  std::vector<Paragraph> rationale() const;
  /// The name of the rehearsed studies without the planned effect: "no effect".
  std::string contrast() const;

 protected:
  /// The planned effects, standard deviations and tests.
  virtual std::vector<Paragraph> plan() const = 0;
  /// "all of the effects"
  virtual std::string goal() const = 0;

  const Registration& made_;
  const protocols::Protocol& protocol_;
};

/// The power analysis of another measure than times.
std::vector<Paragraph> plan_of_measure(const Registration& made);
/// The test and the model of shares correct.
std::string accuracy_in_words();

std::unique_ptr<StudyAnswers> study_answers(const Registration& made);
/// Requires a study that study_answers() can speak of. \throws UsageError
void require_registrable(const protocols::Protocol& protocol, const std::string& path);

std::unique_ptr<StudyAnswers> identification_answers(const Registration& made);
void require_two_renderers(const protocols::Protocol& protocol, const std::string& path);
std::unique_ptr<StudyAnswers> task_answers(const Registration& made);
void require_own_trials(const protocols::Protocol& protocol, const std::string& path);

}  // namespace palpate::runner::registration
