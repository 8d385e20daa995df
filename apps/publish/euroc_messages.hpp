#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// A EuRoC recording as the messages of its drivers: sensor_msgs/Image on /cam0/image_raw and
/// /cam1/image_raw, or /depth0/image_raw, and sensor_msgs/Imu on /imu0. They are logged at their
/// stamps.
class EurocMessages final : public BagReader {
 public:
  explicit EurocMessages(std::unique_ptr<DatasetReader> dataset);

  [[nodiscard]] const std::vector<BagChannel>& channels() const override { return channels_; }
  [[nodiscard]] std::optional<BagMessage> next() override;
  [[nodiscard]] BagReport report() const override { return {}; }

 private:
  void take(const SensorPacket& packet);
  void add(const char* topic, Stamp stamp, std::vector<std::uint8_t> bytes);

  std::unique_ptr<DatasetReader> dataset_;
  std::vector<BagChannel> channels_;
  std::deque<BagMessage> messages_;
  std::optional<Stamp> last_sample_;
};

}  // namespace km
