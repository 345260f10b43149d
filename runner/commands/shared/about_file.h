#pragma once
// The file of --about: authors, license, funding, ethics of a study. Its keys and what they mean:
// protocols/study.schema.json.

#include <string>

#include "data/export/study_about.h"

namespace palpate::runner {

/// \throws protocols::InputError with every fault.
data::StudyAbout read_about_file(const std::string& path);
/// \param file_name  that faults name
data::StudyAbout read_about_text(const std::string& text, const std::string& file_name);

}  // namespace palpate::runner
