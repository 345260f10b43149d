#pragma once
// Columns of numbers in the text of a page: whole numbers of a step, as differences of the order
// that takes the fewest bytes, 7 bits a byte (zigzag, least significant first), one zlib stream
// (RFC 1950) in base64. watch.js reads them.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace palpate::runner {

class WholeNumbers {
 public:
  /// Values are rounded to the step; where one is not finite, the one before stands again.
  /// \param steps_per_unit  1e8: to 10 nm
  void add(const std::string& name, std::span<const double> values, double steps_per_unit);

  /// [[name, count, steps per unit, order], ...]
  const nlohmann::ordered_json& columns() const { return columns_; }
  /// All columns, one after the other.
  std::string text() const;

 private:
  nlohmann::ordered_json columns_ = nlohmann::ordered_json::array();
  std::string bytes_;
};

}  // namespace palpate::runner
