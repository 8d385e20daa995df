#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "modules/core/geometry/geometry.hpp"
#include "modules/core/io/text_rows.hpp"

namespace km {

/// Largest magnitude of a coordinate or a depth [m]: far beyond the earth, and squares keep their
/// digits.
inline constexpr double kMaxInput_m = 1e9;

/// One row of a table in a file. All functions throw InputFileError with the file, the line and the
/// fault if the row lacks what is requested. File name and row must outlive this object.
class InputRow {
 public:
  InputRow(const std::string& file, const TextRow& row) : file_(file), row_(row) {}

  /// Throws InputFileError with file, line, and `why`.
  [[noreturn]] void fail(const std::string& why) const;

  [[nodiscard]] std::size_t size() const { return row_.fields.size(); }
  [[nodiscard]] int line() const { return row_.line; }

  // Precondition of the functions below: the fields exist.

  [[nodiscard]] std::string_view text(std::size_t i) const { return row_.fields[i]; }
  [[nodiscard]] double number(std::size_t i) const;                           ///< A finite number.
  [[nodiscard]] std::int64_t integer(std::size_t i, std::int64_t max) const;  ///< From 0 to `max`.

  /// Position [m], and a quaternion of length one in the order x, y, z, w or w, x, y, z.
  [[nodiscard]] SE3 pose(std::size_t i, bool w_first) const;

 private:
  const std::string& file_;
  const TextRow& row_;
};

}  // namespace km
