#pragma once
// Texts that the build embeds for the page of palpate design.

#include <span>
#include <string_view>

namespace palpate::runner::design {

struct Asset {
  std::string_view name, text;  ///< "main.js" and its contents
};

/// design.html, its style, its scripts, the schemas of protocols.
std::span<const Asset> page_assets();
/// Protocols to begin with, in the order in which they are offered.
std::span<const Asset> template_assets();

/// The text of that name; empty: there is none.
std::string_view text_of_asset(std::span<const Asset> assets, std::string_view name);

}  // namespace palpate::runner::design
