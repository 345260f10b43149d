#include "runner/session/protocol_info.h"

#include <algorithm>

namespace palpate::runner {
namespace {

void add_file(const std::string& name, const std::shared_ptr<const std::string>& bytes,
              std::vector<data::ProtocolFile>& files) {
  if (!bytes) return;
  const bool known =
      std::any_of(files.begin(), files.end(), [&](const auto& file) { return file.name == name; });
  if (!known) files.push_back({name, *bytes});
}

void add_files(const stimuli::ObjectSpec& spec, std::vector<data::ProtocolFile>& files) {
  for (const stimuli::ObjectSpec& part : spec.parts) add_files(part, files);
  add_file(spec.file_name, spec.file_bytes, files);
}

}  // namespace

data::ProtocolInfo info_of(const protocols::Protocol& protocol) {
  data::ProtocolInfo info{protocol.name, protocol.source_text, protocol.sha256};
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    add_files(stimulus.object, info.files);
  for (const protocols::PageSpec& page : protocol.pages) {
    for (const protocols::PagePicture& picture : page.pictures)
      add_file(picture.file, picture.bytes, info.files);
  }
  return info;
}

}  // namespace palpate::runner
