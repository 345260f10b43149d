#pragma once
// Files that the build puts into the program for the report.

#include <string_view>
#include <vector>

namespace palpate::analysis {

struct ScriptModule {
  std::string_view name, text;
};

std::string_view report_style();
std::string_view report_script();
std::string_view vega_notice();  ///< Vega's copyright and licence
/// Vega's modules in the order of their use; empty where the build found none.
std::vector<ScriptModule> vega_modules();

}  // namespace palpate::analysis
