#include "modules/sensors/text_file.hpp"

#include <cctype>
#include <sstream>

#include "modules/core/io/input_file.hpp"
#include "modules/sensors/stream_stamps.hpp"

namespace km {
namespace {

// The next good stamp after each stamp; 0 if there is none.
std::vector<Stamp> next_good(const std::vector<Stamp>& stamps,
                             const std::vector<StampVerdict>& verdicts) {
  std::vector<Stamp> next(stamps.size(), 0);
  for (std::size_t i = stamps.size(); i-- > 1;)
    next[i - 1] = verdicts[i] == StampVerdict::kGood ? stamps[i] : next[i];
  return next;
}

}  // namespace

std::string read_file(const std::filesystem::path& file) try {
  if (problem_of_file(file).empty() && !is_file(file))
    throw DatasetError(file.string() + ": not a file");  // a pipe may never end
  return read_input_file(file);
} catch (const InputFileError& error) {
  throw DatasetError(error.what());
}

std::string at_line(const std::filesystem::path& file, int line) {
  return file.string() + " line " + std::to_string(line);
}

void refuse_list(const std::filesystem::path& file, const std::string& problem,
                 const ReaderReport& faults) {
  std::string message = file.string() + ": " + problem;
  std::istringstream lines(to_string(faults));
  for (std::string line; std::getline(lines, line);) message += "; " + line;
  throw DatasetError(message);
}

std::vector<TextRow> rows_below_header(const std::string& text) {
  std::vector<TextRow> rows = split_rows(text);
  if (rows.empty()) return rows;
  const std::string_view head = rows.front().fields.front();
  if (!head.empty() && std::isalpha(static_cast<unsigned char>(head.front())) != 0 &&
      !parse_double(head))
    rows.erase(rows.begin());
  return rows;
}

std::variant<Stamp, RowFault> stamp_of(const TextRow& row, std::size_t fields) {
  if (row.fields.size() < fields)
    return RowFault{ReaderFault::kMalformedRow, std::to_string(row.fields.size()) +
                                                    " fields, expected " + std::to_string(fields)};
  const std::string_view head = row.fields.front();
  const auto stamp = parse_int64(head);
  if (stamp && *stamp > 0) return *stamp;
  return RowFault{ReaderFault::kMalformedRow, std::string(head) + " is not a stamp in nanoseconds"};
}

std::variant<Stamp, RowFault> stamp_of_seconds(const TextRow& row, std::size_t fields) {
  constexpr double kMost_s = 4e9;
  if (row.fields.size() < fields)
    return RowFault{ReaderFault::kMalformedRow, std::to_string(row.fields.size()) +
                                                    " fields, expected " + std::to_string(fields)};
  const auto seconds = parse_double(row.fields[0]);
  if (seconds && *seconds >= 0.0 && *seconds < kMost_s) return nanoseconds(*seconds);
  return RowFault{ReaderFault::kMalformedRow,
                  readable(row.fields[0], 40) + " is no time in seconds"};
}

std::vector<bool> in_order(const std::vector<Stamp>& stamps, const std::vector<int>& lines,
                           const std::filesystem::path& file, ReaderReport& report) {
  const std::vector<StampVerdict> verdicts = judge_stamps(stamps);
  const std::vector<Stamp> next = next_good(stamps, verdicts);
  std::vector<bool> counts(stamps.size());
  Stamp last = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const std::string place = at_line(file, lines[i]) + ": " + std::to_string(stamps[i]);
    switch (verdicts[i]) {
      case StampVerdict::kGood:
        counts[i] = true;
        last = stamps[i];
        break;
      case StampVerdict::kRepeated:
        report.add(ReaderFault::kRepeatedStamp, place);
        break;
      case StampVerdict::kUnordered:
        report.add(ReaderFault::kUnorderedStamp,
                   place + (stamps[i] <= last ? " comes after " + std::to_string(last)
                                              : " comes before " + std::to_string(next[i])));
        break;
      case StampVerdict::kJump:
        report.add(ReaderFault::kJumpingStamp,
                   place + " is more than an hour away from where most stamps are");
        break;
    }
  }
  return counts;
}

}  // namespace km
