#pragma once
// The page of palpate design, and what it asks of this program: a message is a POST request with a
// JSON object and has one as its answer.
//
//   open {}                                the file, its checksum, templates if there is no file
//   check {text}                           faults; summary, devices, time
//   data {text}                            data that the protocol's name has already
//   recover {text, block, participants}    bias and spread of a block's procedures
//   picture {text}, schedule {text, participant}
//   rehearse {text, participants, seed}, progress {}, stop {}
//   save {text, sha256}, copy {text}
//   upload {}, part {upload, bytes}        a file that is longer than a message, in parts
//   mesh {name, bytes: base64 | upload}    a file beside the protocol
//   languages {}, texts {text}, translation {language}, check_translation {text, language,
//   translation}, save_translation {language, text, sha256}
//
// An answer with status 409 has "error", a sentence; of save and
// save_translation also "found", the file as it is now.

#include <string>
#include <vector>

#include "runner/design/answers.h"
#include "runner/design/protocol_file.h"
#include "runner/design/rehearsal.h"
#include "runner/design/uploads.h"
#include "runner/serve/page_server.h"

namespace palpate::runner::design {

/// Bytes of a message: a little less than the longest protocol that palpate reads.
inline constexpr std::size_t kMostMessage = 16 << 20;

class DesignPage {
 public:
  /// \param databases  that may hold data of the protocol, besides those in its folder
  DesignPage(const ProtocolFile& file, const TemporaryFolder& folder,
             std::vector<std::string> databases = {});

  serve::PageAnswer get(const std::string& target);
  serve::PageAnswer post(const std::string& target, const std::string& body);
  /// Whether the answer to a message may take long and depends on nothing but the message: then it
  /// can be made in another thread.
  static bool is_slow(const std::string& target);

 private:
  serve::PageAnswer page() const;
  serve::PageAnswer report(const std::string& key);
  nlohmann::ordered_json answer(const std::string& message, const nlohmann::json& values);

  const ProtocolFile& file_;
  const TemporaryFolder& folder_;
  std::vector<std::string> databases_;
  Rehearsal rehearsal_;
  Uploads uploads_;
  BuiltShapes shapes_;
};

}  // namespace palpate::runner::design
