#pragma once
// report.css and report.js, embedded by the build (report_assets.cmake).

#include <string_view>

namespace palpate::analysis {

std::string_view report_style();
std::string_view report_script();

}  // namespace palpate::analysis
