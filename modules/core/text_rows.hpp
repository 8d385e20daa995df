#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace km {

/// What some editors put in front of UTF-8.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// One line of a table, cut into fields.
struct TextRow {
  int line = 0;                          ///< Counted from 1.
  std::vector<std::string_view> fields;  ///< Into the text; without surrounding blanks.
};

/// Rows of a CSV or blank-separated table. A line with a comma is cut at its commas, any other at
/// its blanks. `#` starts a comment; lines without content are left out; CRLF line ends and a byte
/// order mark are accepted. `text` must outlive the result.
[[nodiscard]] std::vector<TextRow> split_rows(std::string_view text);

/// The number that the whole of `field` spells, or nullopt. NaN and infinities are numbers here.
[[nodiscard]] std::optional<double> parse_double(std::string_view field);
[[nodiscard]] std::optional<std::int64_t> parse_int64(std::string_view field);

/// The number in field `i` of a row; nullopt if there is no such field, or it is none.
[[nodiscard]] std::optional<double> number_in(const TextRow& row, std::size_t i);

/// `text` as messages show it: control characters as '?', and no more than `max_size` bytes.
[[nodiscard]] std::string readable(std::string_view text, std::size_t max_size = 200);

}  // namespace km
