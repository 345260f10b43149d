#pragma once
// The file of --about: authors, license, funding, ethics of a study. protocols/study.schema.json
// defines its keys.

#include <string>

#include "data/export/study_about.h"

namespace palpate::runner::registration {

/// \throws protocols::InputError with every fault.
data::StudyAbout read_about_file(const std::string& path);
/// \param file_name  named in faults
data::StudyAbout read_about_text(const std::string& text, const std::string& file_name);

}  // namespace palpate::runner::registration
