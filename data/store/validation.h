#pragma once
// Internal to data/store: validates values before they are written to the database, so that a
// caller learns every fault at once and not SQLite's first failed CHECK. Every writing call of
// Store uses it; attempt_reader.cpp uses is_clean_utf8 on what it reads.

#include <string>
#include <string_view>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// Collects the faults of one record.
class Validator {
 public:
  /// Text that SQLite and CSV return unchanged: UTF-8 without NUL.
  void text(const char* field, std::string_view value);
  void present(const char* field, std::string_view value);  ///< text, and not empty
  void finite(const char* field, double value);
  void amount(const char* field, double value);  ///< finite, and not below zero
  void positive(const char* field, int value);
  void expect(bool holds, const std::string& expectation);
  /// \throws StoreRefused with all faults. \param what is validated: "PATH: trial 3"
  void throw_if_invalid(const std::string& what) const;

 private:
  std::vector<std::string> faults_;
};

bool is_clean_utf8(std::string_view text);  ///< well-formed, and no NUL

void validate(Validator& validator, const ProtocolInfo& protocol);
void validate(Validator& validator, const RunInfo& info, bool simulated);
/// The fields that are known before the trial is shown.
void validate_plan(Validator& validator, const TrialRecord& record, int session);
void validate(Validator& validator, const PageAnswer& answer);
/// The fields that are known when it has ended.
void validate_outcome(Validator& validator, const TrialRecord& record);

}  // namespace palpate::data
