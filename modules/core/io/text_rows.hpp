#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace km {

/// Byte order mark that some editors put in front of UTF-8.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// One line of a table, divided into fields.
struct TextRow {
  int line = 0;                          ///< Counted from 1.
  std::vector<std::string_view> fields;  ///< Views of the text, without surrounding blanks.
};

/// Reads the rows of split_rows() one by one. `text` must outlive the rows.
class RowReader {
 public:
  /// A row has at most `max_fields` fields, and further ones are not read. So a file of one endless
  /// line takes little memory, if `max_fields` is more than any valid row has.
  explicit RowReader(std::string_view text,
                     std::size_t max_fields = std::numeric_limits<std::size_t>::max());

  /// nullopt after the last row.
  [[nodiscard]] std::optional<TextRow> next();

 private:
  std::string_view text_;
  std::size_t max_fields_;
  int line_ = 0;
};

/// Rows of a CSV or blank-separated table. A line with a comma is divided at its commas, another
/// one with a semicolon at its semicolons, any other line at its blanks. `#` starts a comment;
/// lines without content are dropped; CRLF line ends and a byte order mark are accepted. `text`
/// must outlive the result.
[[nodiscard]] std::vector<TextRow> split_rows(std::string_view text);

/// The number in the whole of `field`, or nullopt. NaN and infinities are numbers here.
[[nodiscard]] std::optional<double> parse_double(std::string_view field);
[[nodiscard]] std::optional<std::int64_t> parse_int64(std::string_view field);

/// The number in field `i` of a row; nullopt if there is no such field, or it is not a number.
[[nodiscard]] std::optional<double> number_in(const TextRow& row, std::size_t i);

/// `text` for messages: control characters become '?', and it has at most `max_size` bytes.
[[nodiscard]] std::string readable(std::string_view text, std::size_t max_size = 200);

}  // namespace km
