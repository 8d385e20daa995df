#include "modules/link_emulation/packet_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "modules/core/input_file.hpp"
#include "modules/core/text_rows.hpp"
#include "modules/link_emulation/link_trace.hpp"

namespace km {
namespace {

constexpr double kMs_per_s = 1e3;
constexpr double kRounding_ms = 1e-6;  // error of a time in seconds that stands for a whole number

std::uint32_t parse_time_ms(const TextRow& row, const std::string& where) {
  if (row.fields.size() != 1)
    throw LinkTraceError(where + std::to_string(row.fields.size()) + " fields, expected a time");
  const auto value = parse_int64(row.fields.front());
  if (!value || *value < 0 || *value > std::numeric_limits<std::uint32_t>::max())
    throw LinkTraceError(where + readable(row.fields.front()) +
                         " is not a whole number of milliseconds");
  return static_cast<std::uint32_t>(*value);
}

}  // namespace

PacketSchedule::PacketSchedule(std::vector<std::uint32_t> times_ms)
    : times_ms_(std::move(times_ms)) {
  if (times_ms_.empty() || times_ms_.back() == 0 || !std::ranges::is_sorted(times_ms_))
    throw std::invalid_argument("packet schedule: times decrease, or the last one is 0 or missing");
}

double PacketSchedule::capacity_until(double time_s) const {
  const double time_ms = std::floor(time_s * kMs_per_s + kRounding_ms);
  const double periods = std::floor(time_ms / times_ms_.back());
  const double rest_ms = time_ms - periods * times_ms_.back();
  const auto passed = std::ranges::upper_bound(times_ms_, rest_ms) - times_ms_.begin();
  return kPacket_bytes *
         (periods * static_cast<double>(times_ms_.size()) + static_cast<double>(passed));
}

double PacketSchedule::time_of(double bytes) const {
  if (bytes <= 0.0) return 0.0;
  const double before = std::ceil(bytes / kPacket_bytes) - 1.0;  // instants before the one sought
  const double periods = std::floor(before / static_cast<double>(times_ms_.size()));
  const auto i = static_cast<std::size_t>(before - periods * static_cast<double>(times_ms_.size()));
  return (periods * times_ms_.back() + times_ms_[i]) / kMs_per_s;
}

PacketSchedule parse_packet_schedule(std::string_view text, const std::string& name) {
  std::vector<std::uint32_t> times_ms;
  for (const TextRow& row : split_rows(text)) {
    const std::string where = name + ':' + std::to_string(row.line) + ": ";
    times_ms.push_back(parse_time_ms(row, where));
    if (times_ms.size() > 1 && times_ms.back() < times_ms[times_ms.size() - 2])
      throw LinkTraceError(where + readable(row.fields.front()) + " is before the time above it");
  }
  if (times_ms.empty() || times_ms.back() == 0)
    throw LinkTraceError(name + ": the last time is 0 or missing");
  return PacketSchedule(std::move(times_ms));
}

PacketSchedule read_packet_schedule(const std::filesystem::path& file) try {
  return parse_packet_schedule(read_input_file(file), file.string());
} catch (const InputFileError& error) {
  throw LinkTraceError(error.what());
}

}  // namespace km
