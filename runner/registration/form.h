#pragma once
// The texts of a registration, registration.md and osf.json, as they were made: what is fixed, and
// the fields that the lab fills in. form.json holds it, so that a change outside of the fields is
// found without the program's version that made them.

#include <string>
#include <string_view>
#include <vector>

namespace palpate::runner::registration {

/// Stands for the registration's digest, which the form itself has a part in.
inline constexpr std::string_view kDigestMark =
    "0000000000000000000000000000000000000000000000000000000000000000";

struct FormPiece {
  std::string text;  ///< fixed; of a field: what is to be filled in
  bool field = false;
  bool operator==(const FormPiece&) const = default;
};
using FormText = std::vector<FormPiece>;

/// Marks text as a field, for form_text(). Texts that are shown literally have no such mark.
std::string as_field(const std::string& text);
FormText form_text(std::string_view marked);

/// An answer of osf.json: a text, or options of the questionnaire, which are fixed.
struct FormAnswer {
  std::string id;
  FormText text;
  std::vector<std::string> chosen;  ///< empty: a text
  bool operator==(const FormAnswer&) const = default;
};

struct Form {
  FormText markdown;
  std::vector<FormAnswer> osf;
  bool operator==(const Form&) const = default;
};

/// form.json
std::string form_json(const Form& form);
/// \throws protocols::InputError with every fault
Form read_form(const std::string& text, const std::string& file);

/// registration.md and osf.json before the lab fills them in. \param digest  of the registration
std::string markdown_as_made(const Form& form, const std::string& digest);
std::string osf_as_made(const Form& form, const std::string& digest);

/// The differences outside of the fields, a line each. Ends of lines and the space before them do
/// not count. A filled-in text may not hide what follows: no HTML, no heading, no fence.
std::vector<std::string> markdown_changes(const Form& form, const std::string& digest,
                                          const std::string& text);
std::vector<std::string> osf_changes(const Form& form, const std::string& digest,
                                     const std::string& text);

}  // namespace palpate::runner::registration
