#include "runner/session/protocol_info.h"

#include <algorithm>

namespace palpate::runner {
namespace {

void add_files(const stimuli::ObjectSpec& spec, std::vector<data::ProtocolFile>& files) {
  for (const stimuli::ObjectSpec& part : spec.parts) add_files(part, files);
  if (!spec.file_bytes) return;
  const bool known = std::any_of(files.begin(), files.end(),
                                 [&](const auto& file) { return file.name == spec.file_name; });
  if (!known) files.push_back({spec.file_name, *spec.file_bytes});
}

}  // namespace

data::ProtocolInfo info_of(const protocols::Protocol& protocol) {
  data::ProtocolInfo info{protocol.name, protocol.source_text, protocol.sha256};
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    add_files(stimulus.object, info.files);
  return info;
}

}  // namespace palpate::runner
