#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/sensors/bag_dataset.hpp"

namespace km {

/// What a user says of the sensors in a recording, or of a live robot: which topics they are, and
/// where their calibration is.
struct RigFile {
  struct Camera {
    std::string topic;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "sensor_msgs/Image or CompressedImage");
      visitor.required({"topic"});
    }
  };
  struct Depth {
    std::string topic;
    double scale_m = 1e-3;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic,
                    "images of depth, aligned with the left ones; without a right camera, the "
                    "rig is an RGB-D one; empty: none");
      visitor.field("scale_m", scale_m, {1e-6, 1.0},
                    "[m] of a unit in images of 16 bits; those of 32 bits are in metres");
    }
  };
  struct Imu {
    std::string topic, gyro_topic, accel_topic;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "sensor_msgs/Imu; or both of:");
      visitor.field("gyro_topic", gyro_topic, "sensor_msgs/Imu with angular velocities alone");
      visitor.field("accel_topic", accel_topic, "sensor_msgs/Imu with accelerations alone");
      const bool both = !gyro_topic.empty() && !accel_topic.empty();
      const bool neither = gyro_topic.empty() && accel_topic.empty();
      visitor.check(topic.empty() ? both : neither, "topic",
                    "is needed, or gyro_topic and accel_topic");
    }
  };

  Camera left, right;
  Depth depth;
  Imu imu;
  std::filesystem::path calibration;
  double camera_time_offset_s = 0.0;

  void visit_fields(auto& visitor) {
    visitor.section("left", left);
    visitor.section("right", right, "leave it out for an RGB-D camera");
    visitor.section("depth", depth);
    visitor.section("imu", imu);
    visitor.field(
        "calibration", calibration, Input{},
        "EuRoC folder with the sensor.yaml of cam0, cam1 and imu0, relative to this file");
    visitor.field("camera_time_offset_s", camera_time_offset_s, {-1.0, 1.0},
                  "[s] added to the stamps of images: they are then those of the IMU");
    visitor.required({"left", "imu", "calibration"});
    visitor.check(!right.topic.empty() || !depth.topic.empty(), "left",
                  "is alone: a right camera or depth is needed (one camera does not tell how far "
                  "things are)");
  }
};

/// Reads a rig file and its calibration. Throws ConfigError with every problem by file and line,
/// and DatasetError for a calibration that cannot be used.
[[nodiscard]] Rig read_rig_file(const std::filesystem::path& file);

/// The text of a rig file: keys with their meaning.
[[nodiscard]] std::string rig_file_text(RigFile rig);

}  // namespace km
