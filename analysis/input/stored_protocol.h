#pragma once
// What analyses read of a protocol's stored text. Not validated again: it was valid when stored,
// and its mesh files may be missing now. What the text does not have, or has as another type,
// keeps its default.

#include <string>
#include <vector>

namespace palpate::analysis {

struct StoredProtocol {
  int version = 1;
  std::string name, title;           ///< "": none
  std::string seed;                  ///< of the trial orders, as written; "": none
  std::vector<std::string> stimuli;  ///< names, in the protocol's order
  int repetitions = 0;               ///< of version 1
};

StoredProtocol read_stored_protocol(const std::string& text);

}  // namespace palpate::analysis
