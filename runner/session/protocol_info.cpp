#include "runner/session/protocol_info.h"

#include <algorithm>

namespace palpate {
namespace {

void add_files(const ObjectSpec& spec, std::vector<ProtocolFile>& files) {
  for (const ObjectSpec& part : spec.parts) add_files(part, files);
  if (!spec.file_bytes) return;
  const bool known = std::any_of(files.begin(), files.end(),
                                 [&](const auto& file) { return file.name == spec.file_name; });
  if (!known) files.push_back({spec.file_name, *spec.file_bytes});
}

}  // namespace

ProtocolInfo info_of(const Protocol& protocol) {
  ProtocolInfo info{protocol.name, protocol.source_text, protocol.sha256};
  for (const StimulusSpec& stimulus : protocol.stimuli) add_files(stimulus.object, info.files);
  return info;
}

}  // namespace palpate
