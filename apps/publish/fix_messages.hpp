#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/received_fix.hpp"
#include "modules/recordings/bag_reader.hpp"

namespace km {

/// A recording with one more topic, of absolute fixes. They are logged at their stamps; those
/// before the first and after the last message of the recording are left out.
class FixMessages final : public BagReader {
 public:
  /// Message types of fixes: for GNSS and for a motion capture.
  static constexpr const char* kGnssType = "sensor_msgs/msg/NavSatFix";
  static constexpr const char* kMotionCaptureType = "geometry_msgs/msg/PoseStamped";

  /// `type` is one of the message types above. Throws std::invalid_argument if the recording has
  /// `topic` already.
  FixMessages(std::unique_ptr<BagReader> recording, std::vector<ReceivedFix> fixes,
              const std::string& topic, const std::string& type);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] std::optional<BagMessage> next() override;
  [[nodiscard]] BagReport report() const override { return recording_->report(); }

 private:
  [[nodiscard]] BagMessage message_of(const ReceivedFix& fix) const;

  std::unique_ptr<BagReader> recording_;
  std::vector<ReceivedFix> fixes_;  // ascending stamps
  std::vector<BagChannel> channels_;
  std::size_t next_fix_ = 0;
  std::optional<BagMessage> next_;  // message of the recording
  bool began_ = false;
};

}  // namespace km
