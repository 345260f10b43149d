#pragma once
// What a scene asks for that is left out, said to whoever renders it.

#include <string>
#include <vector>

#include "protocols/parse.h"

namespace palpate::runner {

/// A sentence with its place for each object that falls through others: soft objects touch nothing
/// but the tool. Without line ends.
std::vector<std::string> objects_passed_through(const protocols::SceneSpec& scene);

}  // namespace palpate::runner
