#pragma once
// Contents of a bundle: its base (trials, what they leave out, about.json, and a registration if
// there was one) and the files that follow from it. 'palpate bundle' writes them, '--verify' makes
// them again.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/input/study_record.h"
#include "data/export/study_about.h"
#include "runner/registration/deviations.h"
#include "runner/registration/registration.h"
#include "runner/study/study_trials.h"

namespace palpate::runner::registration {

inline constexpr const char* kCrate = "ro-crate-metadata.json";
inline constexpr const char* kTrials = "data/trials.csv";
inline constexpr const char* kRecord = "data/record.json";

/// A table of text: the fields as written, without quotes.
struct TextTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;

  /// The place of a column; the number of columns: there is none.
  std::size_t column(std::string_view name) const;
};
/// \throws protocols::InputError: not a table
TextTable read_text_table(const std::string& path);

/// data/record.json: what the table of trials leaves out. Its servo quality is not written: it
/// follows from the trials.
/// \param removed  codes, with 'palpate forget' \param without_trials  who began and completed none
std::string record_json(const analysis::StudyRecord& record, std::size_t removed,
                        const std::vector<data::Participant>& without_trials);

/// \throws protocols::InputError with every fault
analysis::StudyRecord parse_record(const std::string& text, const std::string& file);

/// The points of a check.json. \throws protocols::InputError with every fault
std::vector<CheckPoint> parse_points(const std::string& text, const std::string& file);

/// A study held against its registration.
struct CheckedStudy {
  Registration registered;
  StudyCheck check;
};

/// The facts from which the derived files are made.
struct BundleFacts {
  data::StudyAbout about;
  std::string format;                    ///< "psych-ds", "bids"
  std::string name, title, description;  ///< of the protocol
  std::string label;                     ///< "SIMULATED PARTICIPANTS"; empty: people
  std::size_t participants = 0;
  double too_fast = 0;  ///< s
  TextTable trials;
  analysis::StudyAnalysis analysis;
  analysis::StudyRecord record;
  std::optional<CheckedStudy> checked;  ///< none: the study was not registered
};

/// Requires protocols of one name, by which an analysis without a registration knows its trials.
/// \throws UsageError
void require_one_study(const std::vector<analysis::ProtocolText>& protocols,
                       const std::string& source);

/// Reads the base of a bundle, analyses its trials and judges the hypotheses. \param points  of the
/// check; those that follow from the trials are made again \throws UsageError, InputError
BundleFacts bundle_facts(const std::string& folder, const std::vector<CheckPoint>& points);

/// "Run as registered", ..., or that the study was not registered.
std::string conclusion_of(const BundleFacts& facts);

/// analysis.json, report.html, figures/, README.md and reproduce.sh by name; of a registered study
/// check.json and check.html.
std::map<std::string, std::string> derived_files(const BundleFacts& facts);

/// ro-crate-metadata.json, of all other files. \param date  "2026-11-25"
std::string crate_text(const std::string& folder, const BundleFacts& facts,
                       const std::string& date);

/// Prints the digest, the conclusion and the verdicts.
void print_conclusion(const BundleFacts& facts);

/// Makes everything again that follows from the base, compares the bytes, and the tables of the
/// dataset with the trials. Prints a line for each. \param digest  of the registration, as the
/// registry has it; "": not given \return exit status
int verify_bundle(const std::string& folder, const std::string& digest);

}  // namespace palpate::runner::registration
