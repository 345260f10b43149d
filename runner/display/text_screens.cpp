#include "runner/display/text_screens.h"

#include <algorithm>
#include <utility>

#include "runner/display/text_input.h"
#include "stimuli/text.h"

namespace palpate::runner {
namespace {

constexpr Page::Kind kText = Page::Kind::text;

std::string text_of(const Page& page) {
  std::string text = stimuli::printable_lines(page.text);
  if (page.kind == Page::Kind::neutral && !page.go) return text;
  if (page.seconds_left > 0) text += "\n[" + std::to_string(page.seconds_left) + " s]";
  if (page.done > 0 && page.kind != Page::Kind::feedback)
    text += "\n[" + std::to_string(page.done) + " of " + std::to_string(page.trials) + "]";
  if (page.parts > 1)
    text += "\n[" + std::to_string(page.part) + " / " + std::to_string(page.parts) + "]";
  if (page.picture) text += "\n[a picture, which the window shows]";
  if (page.kind == kText && page.keys.empty()) text += "\n[space bar: go on]";
  if (page.kind == Page::Kind::message && page.parts == 0 && page.typing == Page::Typing::none)
    return text;  // nothing to answer now
  if (!page.keys.empty() && page.kind != Page::Kind::neutral) text += "\n";
  if (page.typing != Page::Typing::none) text += "\n> " + stimuli::printable(page.typed);
  for (const auto& [key, answer] : page.keys) {
    text += text.empty() ? "" : "   ";
    text += stimuli::printable(key);
    text += ' ';
    text += stimuli::printable(answer);
  }
  return text;
}

std::string checklist_text(const Checklist& list) {
  std::size_t due = 0;
  while (due < list.steps.size() && list.steps[due].state != Checklist::Step::State::now) ++due;
  std::string text = "* step " + std::to_string(due + 1) + " of " +
                     std::to_string(list.steps.size()) + ": " +
                     stimuli::printable(list.instruction);
  std::string choices;
  for (const auto& [kind, meaning] : list.choices) {
    choices += choices.empty() ? " (" : "; ";
    choices += "':" + std::string(text_command(kind)) + "': " + meaning;
  }
  return text + choices + (choices.empty() ? "\n" : ")\n");
}

std::string status(const ConsoleState& state) {
  std::string text = "[" + state.state;
  if (state.practice && (state.state == "trial" || state.state == "homing")) text += ", practice";
  if (state.trial > 0) {
    text += ", block " + std::to_string(state.block) + " of " + std::to_string(state.blocks) +
            ", trial " + std::to_string(state.trial) + " of " + std::to_string(state.trials);
  }
  if (state.remaining > 60)
    text += ", " + std::to_string(static_cast<int>(state.remaining / 60)) + " min left";
  if (state.missed_ticks > 0) text += ", " + std::to_string(state.missed_ticks) + " ticks missed";
  if (!state.held_by.empty()) text += ": " + stimuli::printable(state.held_by);
  return text + "]\n";
}

}  // namespace

void TextScreen::show(const Page& page) {
  const Page before = std::exchange(last_, page);
  std::string text;
  if (page.kind != before.kind || page.text != before.text || page.go != before.go ||
      page.typing != before.typing || page.keys != before.keys ||
      (page.keys.empty() && page.seconds_left > before.seconds_left) || page.kind == kText) {
    text = text_of(page);
  } else if (page.typed != before.typed) {
    text = "> " + stimuli::printable(page.typed);
  }
  if (page.reply != before.reply && !page.reply.empty())
    text += (text.empty() ? "" : "\n") + stimuli::printable(page.reply);
  if (text.empty()) return;
  out_.add({STDOUT_FILENO, text + "\n"});
  wake_.signal();
}
void TextConsole::show(const ConsoleState& state) {
  std::string text;
  for (messages_shown_ = std::max(messages_shown_, state.older_messages);
       messages_shown_ < state.older_messages + state.messages.size(); ++messages_shown_) {
    text += "* ";
    text += stimuli::printable_lines(state.messages[messages_shown_ - state.older_messages]);
    text += '\n';
  }
  if (state.checklist.instruction != instruction_) {
    instruction_ = state.checklist.instruction;
    if (!instruction_.empty()) text += checklist_text(state.checklist);
  }
  if (!state.state.empty() &&
      (state.state != state_ || state.trial != trial_ || state.held_by != held_by_)) {
    state_ = state.state;
    held_by_ = state.held_by;
    trial_ = state.trial;
    text += status(state);
  }
  if (text.empty()) return;
  out_.add({STDERR_FILENO, text});
  wake_.signal();
}
std::string TextConsole::name_of(ConsoleCommand::Kind kind) const {
  return "':" + std::string(text_command(kind)) + "'";
}

}  // namespace palpate::runner
