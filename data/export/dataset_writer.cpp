#include "data/export/dataset_writer.h"

namespace palpate::data {

void DatasetWriter::write(const std::string& name, const std::string& text) {
  FileSink file(folder_.prepare(name));
  file.write(text);
  file.close(false);
}

}  // namespace palpate::data
