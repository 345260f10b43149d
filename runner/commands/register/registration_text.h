#pragma once
// The text of a registration: the questions of OSF Preregistration, version 3, that the protocol,
// the plan and the hypotheses answer. Questions that only the lab can answer stay open.

#include <string>
#include <string_view>
#include <vector>

#include "runner/commands/register/registration.h"

namespace palpate::runner::commands {

/// Marks text that only the lab can provide.
inline constexpr const char* kFillIn = "FILL IN: ";

/// A paragraph, an item of a list, or literal lines.
struct Paragraph {
  enum class Kind { text, item, lines } kind = Kind::text;
  std::string text;
};

/// A question of the form with its answer.
struct Question {
  std::string id;     ///< "q2"
  std::string title;  ///< "Hypotheses"
  std::vector<Paragraph> answer;
  std::vector<std::string> chosen = {};  ///< of the form's options, in its words
  bool several = false;                  ///< options can be chosen together
};

std::vector<Question> registration_questions(const Registration& registration);

/// registration.md
std::string registration_markdown(const Registration& registration,
                                  const std::vector<Question>& questions);
/// osf.json: the answers by question id.
std::string registration_osf(const std::vector<Question>& questions);

}  // namespace palpate::runner::commands
