#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace km {

/// Capacity of a recorded link: the instants at which it carries one packet of kPacket_bytes. The
/// schedule begins with the run and repeats at its last instant. Smaller packets share an instant,
/// and an instant without a waiting packet is lost (Netravali et al., "Mahimahi: Accurate
/// Record-and-Replay for HTTP", USENIX ATC 2015, whose files these are).
class PacketSchedule {
 public:
  static constexpr double kPacket_bytes = 1500.0;

  /// For instants [ms]. Throws std::invalid_argument unless they do not decrease and the last one
  /// is positive.
  explicit PacketSchedule(std::vector<std::uint32_t> times_ms);

  /// Bytes that the link can carry from the start of the run until `time_s`, inclusive. O(log
  /// instants). Precondition: `time_s` is finite, and not negative.
  [[nodiscard]] double capacity_until(double time_s) const;

  /// The first time at which capacity_until() is at least `bytes`.
  /// Precondition: `bytes` is finite, and not negative.
  [[nodiscard]] double time_of(double bytes) const;

 private:
  std::vector<std::uint32_t> times_ms_;
};

/// Parses a text with one instant [ms] a line. `name` stands for the file in messages. Throws
/// LinkTraceError for a line that is not one whole number from 0 to 2^32 - 1, for instants that
/// decrease, and if the last instant is 0 or missing.
[[nodiscard]] PacketSchedule parse_packet_schedule(std::string_view text, const std::string& name);

/// Reads the text from a file. Throws LinkTraceError.
[[nodiscard]] PacketSchedule read_packet_schedule(const std::filesystem::path& file);

}  // namespace km
