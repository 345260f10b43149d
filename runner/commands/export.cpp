#include <iostream>
#include <string>

#include "data/export_csv.h"
#include "data/store.h"
#include "runner/commands/command.h"

namespace palpate {

namespace po = boost::program_options;

int export_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate export --db FILE --format csv --out PATH [--force]";
  line.summary =
      "Writes the trials of a database for others: every completed trial as a row of PATH, and "
      "the\n"
      "attempts that were cut off, where there are any, to attempts.csv in the same folder. Can "
      "be\n"
      "used while a session runs.";
  line.example =
      "  palpate export --db study.db --format csv --out trials.csv\n"
      "  palpate export --db study.db --format csv --out trials.csv --force   (replaces both "
      "files)";
  std::string database, format, out;
  auto add = line.options.add_options();
  add("db", po::value(&database)->required()->value_name("FILE"), "the study's database");
  add("format", po::value(&format)->required()->value_name("NAME"), "csv");
  add("out", po::value(&out)->required()->value_name("PATH"), "the file to write");
  add("force", po::bool_switch(), "replace files that are there already");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (format != "csv") {
    throw UsageError("no format '" + format + "'; there is: csv\nUsage: " + line.usage);
  }
  try {
    Store store = Store::open(database, Store::Mode::read_only);
    const ExportDone done = export_csv(store, out, (*values)["force"].as<bool>());
    std::cerr << out << ": " << done.trials << " trials\n";
    if (done.attempts > 0) {
      std::cerr << done.attempts_path << ": " << done.attempts << " attempts that were cut off\n";
    }
  } catch (const StoreRefused& error) {
    throw UsageError(error.what());  // the files named are bad input: status 2
  }
  return 0;
}

}  // namespace palpate
