#pragma once
// Internal to data/: what a value must be before it goes into the database.

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// Gathers every fault of what is to be stored.
class Validator {
 public:
  /// Text that SQLite and CSV give back as it is: UTF-8 without NUL.
  void text(const char* field, std::string_view value);
  void present(const char* field, std::string_view value);  ///< text, and not empty
  void finite(const char* field, double value);
  void amount(const char* field, double value);  ///< finite, and not below zero
  void positive(const char* field, int value);
  void expect(bool holds, const std::string& expectation);
  /// \throws StoreRefused with all faults. \param what "PATH: trial 3"
  void raise(const std::string& what) const;

 private:
  std::vector<std::string> faults_;
};

bool is_clean_utf8(std::string_view text);  ///< well-formed, and no NUL

void check(Validator& checks, const ProtocolInfo& protocol);
void check(Validator& checks, const RunInfo& info, bool simulated);
/// What is known of a trial before it is shown.
void validate_plan(Validator& checks, const TrialRecord& record, int session);
/// The rest, known when it is over.
void validate_outcome(Validator& checks, const TrialRecord& record);

}  // namespace palpate::data
