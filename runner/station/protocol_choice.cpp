#include "runner/station/protocol_choice.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/terminal.h"
#include "runner/usage_error.h"

namespace palpate::runner::station {
namespace {

std::string to_the_minute(std::int64_t utc_ns) {
  std::string text = data::format_utc(utc_ns).substr(0, 16);
  text[10] = ' ';
  return text + " UTC";
}

const char* word_for(ProtocolChoice choice) {
  switch (choice) {
    case ProtocolChoice::stored:
      return "stored";
    case ProtocolChoice::new_texts:
      return "new texts";
    case ProtocolChoice::new_code:
      return "begun anew";
  }
  return "";
}

std::string what_happened(const ChangedProtocol& changed,
                          const protocols::ProtocolDifference& difference) {
  const EarlierProtocol& earlier = changed.earlier;
  return changed.code + " began with another text of protocol " + changed.now.name + " (" +
         std::to_string(earlier.trials) + (earlier.trials == 1 ? " trial" : " trials") +
         " on record" + (earlier.last_run.empty() ? "" : ", last run on " + earlier.last_run) +
         "). " + changed.path + " has changed since (" + protocols::in_words(difference) + ")";
}

ProtocolChoice ask_which(const std::string& code, bool only_texts) {
  std::string question = "  s  use the stored protocol (Enter alone)\n";
  if (only_texts) question += "  t  use the new texts\n";
  question +=
      "  n  begin as a new participant under another code\n  q  quit\n" + code + ", which? ";
  while (true) {
    const auto answer = ask(question);
    if (!answer || answer == "q")
      throw UsageError("nothing was started; the same command asks again");
    if (answer == "" || answer == "s") return ProtocolChoice::stored;
    if (answer == "t" && only_texts) return ProtocolChoice::new_texts;
    if (answer == "n") return ProtocolChoice::new_code;
  }
}

}  // namespace

std::optional<EarlierProtocol> earlier_protocol(data::Store& store,
                                                const protocols::Protocol& protocol,
                                                const std::string& code) {
  std::optional<EarlierProtocol> found;
  std::int64_t found_ns = 0;
  const std::vector<data::StoredRun> runs = store.runs();
  for (data::ProtocolInfo& info : store.protocols()) {
    if (info.name != protocol.name || info.sha256 == protocol.sha256) continue;
    for (const data::Participant& person : store.participants(info.sha256)) {
      if (person.code != code) continue;
      EarlierProtocol one{info, "", 0, ""};
      one.info.files = store.files(info.sha256);
      std::int64_t latest_ns = 0;
      std::set<int> sessions;
      for (const data::StoredRun& run : runs) {
        if (run.participant.id != person.id) continue;
        sessions.insert(run.info.session);
        if (run.info.clock.utc_ns < latest_ns) continue;
        latest_ns = run.info.clock.utc_ns;
        one.shown_sha256 = run.info.protocol_sha256;
        one.last_run = to_the_minute(latest_ns);
      }
      for (const int session : sessions)
        one.trials += store.progress(person, session).completed.size();
      if (found && latest_ns < found_ns) continue;
      found = std::move(one);
      found_ns = latest_ns;
    }
  }
  return found;
}

ProtocolChoice choose_protocol(const ChangedProtocol& changed) {
  const protocols::ProtocolDifference differs =
      protocols::difference(changed.earlier.info.text, changed.now.source_text);
  const std::string happened = what_happened(changed, differs);
  if (changed.option == "texts" && !differs.only_texts()) {
    throw UsageError("--changed-protocol texts: " + happened +
                     ": not only texts. Leave the option out to resume with the stored protocol, "
                     "or begin again with another --participant");
  }
  if (changed.option == "texts") {
    say(happened + "; resuming with the new texts");
    return ProtocolChoice::new_texts;
  }
  if (changed.option.empty() && changed.earlier.shown_sha256 == changed.now.sha256) {
    say(happened + "; resuming with these texts, as in the last run");
    return ProtocolChoice::new_texts;
  }
  if (changed.option.empty() && !differs.nothing() && on_a_terminal()) {
    say(happened);
    return ask_which(changed.code, differs.only_texts());
  }
  say(happened + "; resuming with the stored protocol" +
      (!changed.option.empty() || differs.nothing() ? ""
       : differs.only_texts() ? ". --changed-protocol texts shows the new texts"
                              : ". To begin again, give another --participant"));
  return ProtocolChoice::stored;
}

std::string to_json_text(const ChangedProtocol& changed, ProtocolChoice choice) {
  const protocols::ProtocolDifference differs =
      protocols::difference(changed.earlier.info.text, changed.now.source_text);
  nlohmann::ordered_json what = {
      {"shown", word_for(choice)},           {"stored_sha256", changed.earlier.info.sha256},
      {"file_sha256", changed.now.sha256},   {"texts", differs.texts},
      {"stimuli_and_order", differs.design}, {"other_settings", differs.settings}};
  if (choice == ProtocolChoice::new_code) what["earlier_code"] = changed.code;
  return nlohmann::ordered_json{{"protocol_change", what}}.dump();
}

}  // namespace palpate::runner::station
