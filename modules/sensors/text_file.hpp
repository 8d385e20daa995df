#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "modules/core/io/text_rows.hpp"
#include "modules/core/stamp.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// The bytes of `file`. Throws DatasetError if it is not a regular file or cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);

/// Start of every message about a row: "FILE line N".
[[nodiscard]] std::string at_line(const std::filesystem::path& file, int line);

/// The reason why a row is skipped.
struct RowFault {
  ReaderFault fault = ReaderFault::kMalformedRow;
  std::string why;
};

/// Throws DatasetError "FILE: PROBLEM; FAULTS" for a list without a valid row.
[[noreturn]] void refuse_list(const std::filesystem::path& file, const std::string& problem,
                              const ReaderReport& faults);

/// A valid row with its parsed value.
template <typename Value>
struct StampedRow {
  Stamp stamp = 0;
  int line = 0;
  int index = 0;  ///< Number of rows before it; faulty rows count, blank lines do not.
  Value value;
};

/// Rows of `text` without the header, which is a first row that starts with a letter and not with a
/// number ("nan").
[[nodiscard]] std::vector<TextRow> rows_below_header(const std::string& text);

/// The stamp [ns] at the start of a row; a fault unless the row has at least `fields` fields.
[[nodiscard]] std::variant<Stamp, RowFault> stamp_of(const TextRow& row, std::size_t fields);

/// The time [s] at the start of a row; a fault unless the row has at least `fields` fields.
[[nodiscard]] std::variant<Stamp, RowFault> stamp_of_seconds(const TextRow& row,
                                                             std::size_t fields);

/// True for each valid stamp (see judge_stamps()). Invalid stamps are counted in `report`, with
/// `file` and their `lines`.
[[nodiscard]] std::vector<bool> in_order(const std::vector<Stamp>& stamps,
                                         const std::vector<int>& lines,
                                         const std::filesystem::path& file, ReaderReport& report);

/// The valid rows of `file` with their values. A valid row starts with a stamp (`stamp_of` reads
/// it), has at least `fields` fields, is in order of time, and `parse(row)` returns a Value and not
/// a RowFault. All other rows are counted in `report`. Throws DatasetError if `file` is missing,
/// and with `problem` and the faults of the rows if no row is valid.
template <typename Value, typename Parse>
[[nodiscard]] std::vector<StampedRow<Value>> read_ordered_rows(
    const std::filesystem::path& file, std::size_t fields, const std::string& problem,
    ReaderReport& report, const Parse& parse,
    std::variant<Stamp, RowFault> (*stamp_of)(const TextRow&, std::size_t) = km::stamp_of) {
  const std::string text = read_file(file);
  ReaderReport faults;
  std::vector<StampedRow<Value>> rows;
  std::vector<Stamp> stamps;
  std::vector<int> lines;
  for (int index = -1; const TextRow& row : rows_below_header(text)) {
    ++index;
    const auto count = [&](const RowFault& fault) {
      faults.add(fault.fault, at_line(file, row.line) + ": " + fault.why);
    };
    const std::variant<Stamp, RowFault> stamp = stamp_of(row, fields);
    if (const auto* fault = std::get_if<RowFault>(&stamp)) {
      count(*fault);
      continue;
    }
    std::variant<Value, RowFault> value = parse(row);
    if (const auto* fault = std::get_if<RowFault>(&value)) {
      count(*fault);
      continue;
    }
    stamps.push_back(std::get<Stamp>(stamp));
    lines.push_back(row.line);
    rows.push_back({stamps.back(), row.line, index, std::get<Value>(std::move(value))});
  }
  const std::vector<bool> counts = in_order(stamps, lines, file, faults);
  std::size_t row = 0;
  std::erase_if(rows, [&](const auto&) { return !counts[row++]; });
  if (rows.empty()) refuse_list(file, problem, faults);
  report.add(faults);
  return rows;
}

}  // namespace km
