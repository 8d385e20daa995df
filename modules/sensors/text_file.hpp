#pragma once

#include <cctype>
#include <cstddef>
#include <filesystem>
#include <string>

#include "modules/core/stamp.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// The bytes of `file`. Throws DatasetError if it does not exist or cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);

/// "FILE line N", the start of every message about a row.
[[nodiscard]] std::string at_line(const std::filesystem::path& file, int line);

/// Calls `accept(stamp, row)` for every row of `file` that starts with a stamp [ns], has at least
/// `fields` fields and comes later than the last row accepted; `accept` returns why it refuses the
/// row for values that are not numbers, or an empty string. Everything else is counted in `report`.
/// A first row that starts with a letter is a header. Throws DatasetError without `file`.
template <typename Accept>
void read_ordered_rows(const std::filesystem::path& file, std::size_t fields, ReaderReport& report,
                       const Accept& accept) {
  const std::string text = read_file(file);
  bool first = true;
  Stamp last = 0;
  for (const TextRow& row : split_rows(text)) {
    const auto count = [&](ReaderFault fault, const std::string& why) {
      report.add(fault, at_line(file, row.line) + ": " + why);
    };
    const std::string_view head = row.fields.front();
    const bool is_header =
        first && !head.empty() && std::isalpha(static_cast<unsigned char>(head.front())) != 0;
    first = false;
    if (is_header) continue;
    const auto stamp = parse_int64(head);
    if (row.fields.size() < fields) {
      count(ReaderFault::kMalformedRow,
            std::to_string(row.fields.size()) + " fields, expected " + std::to_string(fields));
    } else if (!stamp || *stamp <= 0) {
      count(ReaderFault::kMalformedRow, std::string(head) + " is not a stamp in nanoseconds");
    } else if (*stamp == last) {
      count(ReaderFault::kRepeatedStamp, std::string(head));
    } else if (*stamp < last) {
      count(ReaderFault::kUnorderedStamp,
            std::string(head) + " comes after " + std::to_string(last));
    } else if (const std::string why = accept(*stamp, row); !why.empty()) {
      count(ReaderFault::kMalformedRow, why);
    } else {
      last = *stamp;
    }
  }
}

}  // namespace km
