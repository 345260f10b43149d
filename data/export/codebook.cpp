#include "data/export/codebook.h"

#include <span>

#include "data/export/delimited_row.h"
#include "data/export/page_table.h"
#include "data/files/text_sink.h"

namespace palpate::data {
namespace {

void describe_table(const char* table, std::span<const Column> columns, const ProtocolFacts& facts,
                    const ExportSettings& settings, TextSink& out) {
  DelimitedRow row(DelimitedFormat::csv);
  for (const Column& column : columns) {
    const std::string unit = unit_of(column, facts);
    row << table << column.name << unit << "" << column.description;
    out.write(row.end());
    for (const auto& values :
         {column_levels(column, facts), column_bits(column, settings.fault_bits)}) {
      for (const auto& [value, meaning] : values.items()) {
        // Names of stimuli are guarded already: DelimitedRow would guard them twice.
        row << table << column.name << unit << unguarded(value) << meaning.get<std::string>();
        out.write(row.end());
      }
    }
  }
}

}  // namespace

void write_codebook(TextSink& out, const ProtocolFacts& facts, const ExportSettings& settings,
                    std::span<const Column> trials) {
  DelimitedRow row(DelimitedFormat::csv);
  row << "table"
      << "column"
      << "unit"
      << "value"
      << "meaning";
  out.write(row.end());
  describe_table("trials", trials, facts, settings, out);
  describe_table("attempts", attempt_columns(settings.times), facts, settings, out);
  if (!settings.pages) return;
  describe_table("pages", page_columns(), facts, settings, out);
  for (const auto& [place, question] : facts.questions) {
    row << "pages"
        << "item"
        << "" << place << question;
    out.write(row.end());
  }
}

}  // namespace palpate::data
