#pragma once
// Files that the build puts into the program for its pages.

#include <string_view>

namespace palpate::analysis {

std::string_view report_style();
std::string_view report_script();

}  // namespace palpate::analysis
