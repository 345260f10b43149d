#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMostPages = 100, kMostItems = 100, kMostChoices = 20;
constexpr NumberRange kPageNumber{-1e12, 1e12};

void read_choices(ObjectReader& reader, PageItem& item) {
  const bool asks = item.kind == PageItem::Kind::choice || item.kind == PageItem::Kind::scale;
  const char* const key = item.kind == PageItem::Kind::scale ? "labels" : "choices";
  if (!asks) return;
  const json* const list = reader.array(key, 2, kMostChoices, Presence::required);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& value = (*list)[i];
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    const std::string pointer = child_pointer(reader.pointer(key), i);
    if (text.empty()) {
      reader.faults().add(pointer, "expected a text that is not empty" + found_text(value));
    } else if (std::find(item.choices.begin(), item.choices.end(), text) != item.choices.end()) {
      reader.faults().add(pointer, "expected a text of its own, found '" + text + "' again");
    }
    item.choices.push_back(text);
  }
}

PageItem read_item(ObjectReader& reader) {
  PageItem item;
  reader.name("name", item.name);
  reader.text("question", item.question);
  reader.member("question", Presence::required);
  reader.choice("kind", item.kind,
                {{"text", PageItem::Kind::text},
                 {"number", PageItem::Kind::number},
                 {"choice", PageItem::Kind::choice},
                 {"scale", PageItem::Kind::scale}},
                Presence::required);
  if (item.kind == PageItem::Kind::number) {
    reader.number("min", item.least, kPageNumber);
    reader.number("max", item.most, kPageNumber);
    if (item.least && item.most && *item.least > *item.most)
      reader.faults().add(reader.pointer("max"), "expected at least min");
  }
  read_choices(reader, item);
  reader.boolean("required", item.required);
  reader.refuse_unknown_keys();
  return item;
}

void read_items(ObjectReader& reader, PageSpec& page) {
  const json* const list = reader.array("items", 1, kMostItems, Presence::required);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("items"), i), reader.faults());
    page.items.push_back(read_item(item));
    const std::string& name = page.items.back().name;
    if (!name.empty() && !names.insert(name).second) {
      reader.faults().add(item.pointer("name"),
                          "expected a name of its own, found '" + name + "' again");
    }
  }
}

void read_place(ObjectReader& reader, const Protocol& protocol, PageSpec& page) {
  reader.choice("when", page.when,
                {{"before", PageSpec::When::before},
                 {"between", PageSpec::When::between},
                 {"after", PageSpec::When::after}});
  if (page.when != PageSpec::When::between) return;
  reader.text("block", page.before_block);
  const json* const value = reader.member("block", Presence::required);
  const bool known = std::any_of(protocol.blocks.begin(), protocol.blocks.end(),
                                 [&](const TaskBlock& b) { return b.name == page.before_block; });
  if (value != nullptr && !known) {
    reader.faults().add(reader.pointer("block"),
                        "expected the name of the block that it comes before" + found_text(*value));
  }
}

PageSpec read_page(ObjectReader& reader, const Protocol& protocol) {
  PageSpec page;
  reader.name("name", page.name);
  reader.choice("kind", page.kind,
                {{"instructions", PageSpec::Kind::instructions},
                 {"consent", PageSpec::Kind::consent},
                 {"questionnaire", PageSpec::Kind::questionnaire}},
                Presence::required);
  read_place(reader, protocol, page);
  reader.text("text", page.text);
  if (page.kind != PageSpec::Kind::questionnaire) reader.member("text", Presence::required);
  if (page.kind == PageSpec::Kind::consent) {
    reader.text("consent_version", page.version);
    reader.member("consent_version", Presence::required);
    if (page.when != PageSpec::When::before) {
      reader.faults().add(reader.pointer("when"),
                          "expected 'before': consent is asked before the first trial");
    }
  }
  if (page.kind == PageSpec::Kind::questionnaire) read_items(reader, page);
  reader.refuse_unknown_keys();
  return page;
}

}  // namespace

void read_pages(ObjectReader& reader, Protocol& protocol) {
  const json* const list = reader.array("pages", 0, kMostPages);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("pages"), i), reader.faults());
    protocol.pages.push_back(read_page(item, protocol));
    const std::string& name = protocol.pages.back().name;
    if (!name.empty() && !names.insert(name).second) {
      reader.faults().add(item.pointer("name"),
                          "expected a name of its own, found '" + name + "' again");
    }
  }
}

}  // namespace palpate::protocols
