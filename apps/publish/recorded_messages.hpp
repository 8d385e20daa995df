#pragma once

#include <memory>
#include <string>
#include <vector>

#include "modules/core/received_fix.hpp"
#include "modules/recordings/bag_reader.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

/// Message types of fixes: for GNSS and for a motion capture.
inline constexpr const char* kGnssType = "sensor_msgs/msg/NavSatFix";
inline constexpr const char* kMotionCaptureType = "geometry_msgs/msg/PoseStamped";

/// A EuRoC recording as the messages of its drivers: sensor_msgs/Image on /cam0/image_raw and
/// /cam1/image_raw, or /depth0/image_raw, and sensor_msgs/Imu on /imu0. They are logged at their
/// stamps.
[[nodiscard]] std::unique_ptr<BagReader> euroc_messages(std::unique_ptr<DatasetReader> dataset);

/// A recording with one more topic, of absolute fixes. They are logged at their stamps; those
/// before the first and after the last message of the recording are left out. `type` is one of the
/// message types above. Throws std::invalid_argument if the recording has `topic` already.
[[nodiscard]] std::unique_ptr<BagReader> with_fixes(std::unique_ptr<BagReader> recording,
                                                    std::vector<ReceivedFix> fixes,
                                                    const std::string& topic,
                                                    const std::string& type);

}  // namespace km
