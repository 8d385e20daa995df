#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/calibration_limits.hpp"
#include "modules/core/camera_calibration.hpp"
#include "modules/core/config.hpp"
#include "modules/sensors/rig_completion.hpp"

namespace km {

/// What a calibration is off by, in a file.
struct RigCorrectionFile {
  std::optional<double> camera_time_offset_s;
  std::vector<double> T_body_rig;

  void visit_fields(auto& visitor) {
    visitor.field("camera_time_offset_s", camera_time_offset_s, kTimeOffset_s,
                  "[s] added to the stamps of images: they are then those of the IMU; none: as the "
                  "calibration says, or 0");
    visitor.field(
        "T_body_rig", T_body_rig, {-1e3, 1e3},
        "[m] 16 numbers, row by row: poses of the cameras in the body are this times those "
        "of the calibration; empty: they are right");
    visitor.check(T_body_rig.empty() || T_body_rig.size() == 16, "T_body_rig",
                  "has not 16 numbers");
  }
};

/// What a user says of the sensors in a recording, or of a live robot: which topics they are, and
/// where their calibration is.
struct RigFile {
  struct Camera {
    std::string topic;
    int camera = 0;
    std::string info_topic;
    std::optional<bool> rectified;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "sensor_msgs/Image or CompressedImage");
      visitor.field("camera", camera, {0, 99}, "number in the calibration: cam0, cam1, ...");
      visitor.field("info_topic", info_topic,
                    "sensor_msgs/CameraInfo, where the calibration does not tell the camera; "
                    "empty: camera_info beside the images");
      visitor.field("rectified", rectified,
                    "images are rectified, as P of CameraInfo has them; none: if rect is in the "
                    "topic's last name");
      visitor.required({"topic"});
    }
  };
  struct Depth {
    std::string topic;
    double scale_m = 1e-3;
    double min_range_m = 0.0, max_range_m = 65.0;
    double baseline_m = 0.1;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic,
                    "images of depth, aligned with the left ones; without a right camera, the "
                    "rig is an RGB-D one; empty: none");
      visitor.field("scale_m", scale_m, kDepthScale_m,
                    "[m] of a unit in images of 16 bits; those of 32 bits are in metres");
      visitor.field("min_range_m", min_range_m, {0.0, kDepthRange_m.max},
                    "[m] least distance that the sensor measures");
      visitor.field("max_range_m", max_range_m, kDepthRange_m, "[m] largest one");
      visitor.field("baseline_m", baseline_m, kDepthBaseline_m,
                    "[m] of an RGB-D sensor: errors of depth z are about z^2 / (focal length in "
                    "px * baseline)");
      visitor.check(min_range_m < max_range_m, "min_range_m", "is not less than max_range_m");
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

  struct Odometry {
    std::string topic;
    std::optional<std::filesystem::path> file;
    std::vector<double> T_child_body;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "nav_msgs/Odometry without jumps (its tf `odom`, not `map`)");
      visitor.field("file", file, Input{},
                    "or poses of the body, TUM: t[s] x y z qx qy qz qw, each with or without the "
                    "36 numbers of a covariance as in nav_msgs/Odometry");
      visitor.field("T_child_body", T_child_body, {-1e3, 1e3},
                    "[m] 16 numbers, row by row: the body in the topic's child frame; empty: they "
                    "are one");
      visitor.check(topic.empty() || !file, "topic", "is there beside file: name one");
      visitor.check(T_child_body.empty() || T_child_body.size() == 16, "T_child_body",
                    "has not 16 numbers");
    }
  };

  Camera left, right = {.topic = {}, .camera = 1, .info_topic = {}, .rectified = {}};
  Depth depth;
  Imu imu;
  Odometry odometry;
  std::vector<std::filesystem::path> calibration;
  std::string body_frame;
  RigCorrectionFile correction;
  bool has_poses = false;  ///< An odometry that the file need not name.

  void visit_fields(auto& visitor) {
    visitor.section("left", left);
    visitor.section("right", right, "leave it out for an RGB-D camera");
    visitor.section("depth", depth);
    visitor.section("imu", imu);
    visitor.section("odometry", odometry,
                    "of the robot's own, in place of the one by cameras and inertial sensor");
    visitor.field("calibration", calibration, Input{},
                  "relative to this file: Kalibr's files ([camchain.yaml, imu.yaml]), one of "
                  "Basalt (.json), a EuRoC folder with the sensor.yaml of cam0, cam1 and imu0, or "
                  "keys as in Kalibr's files; CameraInfo and /tf_static tell what it lacks");
    visitor.field(
        "body_frame", body_frame,
        "frame of the inertial sensor in /tf_static; empty: that of its messages, or without "
        "them the child frame of the odometry");
    correction.visit_fields(visitor);
    visitor.required({"left"});
    visitor.check(
        !imu.topic.empty() || !imu.gyro_topic.empty() || !odometry.topic.empty() ||
            odometry.file.has_value() || has_poses,
        "imu",
        "is missing: odometry goes by cameras and an inertial sensor; a robot without one "
        "names the odometry that it has: odometry: {topic: ...} or {file: ...}, or --odometry "
        "FILE");
    visitor.check(!right.topic.empty() || !depth.topic.empty(), "left",
                  "is alone: a right camera or depth is needed (one camera does not tell how far "
                  "things are)");
  }
};

/// Reads a rig file and its calibration; `has_poses`: an odometry is named elsewhere, in place of
/// the file's. Throws ConfigError with every problem by file and line, and DatasetError for a
/// calibration that cannot be used.
[[nodiscard]] PartialRig read_rig_file(const std::filesystem::path& file, bool has_poses = false);

/// Reads a file that has nothing but RigCorrectionFile's keys, for a recording that tells the rest.
/// Errors as above.
[[nodiscard]] CameraCalibration read_rig_correction(const std::filesystem::path& file);

/// The text of a rig file that says what `correction` does; all else is as in the rig file `base`,
/// wherever it is read from. With an empty path it is one for read_rig_correction(). Comments are
/// not kept. Throws ConfigError if `base` cannot be read.
[[nodiscard]] std::string corrected_rig_text(const std::filesystem::path& base,
                                             const CameraCalibration& correction);

/// Where drivers tell the camera of a topic of images: "/left/camera_info" of "/left/image_raw" and
/// of "/left/image_raw/compressed".
[[nodiscard]] std::string camera_info_beside(const std::string& topic);

/// The text of a rig file: keys with their meaning.
[[nodiscard]] std::string rig_file_text(RigFile rig);

}  // namespace km
